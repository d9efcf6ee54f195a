#include "polestar/mesh/read_mesh.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <system_error>

#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar {
namespace detail {
namespace {

MeshSource load(const std::filesystem::path& path) {
  MeshSource source{path, {}};
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found)
    source.fail("there is no such file; check the name");
  if (error) source.fail(error.message());
  if (std::filesystem::is_directory(status)) source.fail("it is a folder; name a mesh file in it");
  if (!std::filesystem::is_regular_file(status))
    source.fail("it is no regular file; copy its content into one");
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) source.fail(error.message());
  if (size == 0) source.fail("the file is empty; export it again");
  std::ifstream in(path, std::ios::binary);
  if (!in) source.fail("it cannot be opened; check its permissions");
  source.bytes.resize(size);
  in.read(source.bytes.data(), static_cast<std::streamsize>(size));
  if (static_cast<std::uintmax_t>(in.gcount()) != size) {
    source.failAtByte(static_cast<std::size_t>(in.gcount()), "reading stopped; is the disk in order?");
  }
  return source;
}

bool startsWithWord(std::string_view text, std::string_view word) {
  if (text.size() <= word.size()) return false;
  const bool same = std::equal(word.begin(), word.end(), text.begin(), [](char a, char b) {
    return a == std::tolower(static_cast<unsigned char>(b));
  });
  return same && std::isspace(static_cast<unsigned char>(text[word.size()]));
}

std::string lowerExtension(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

std::string_view firstWord(const MeshSource& source) {
  TextLines lines(source, {.comment = '#'});
  return lines.nextFullLine() ? lines.word() : std::string_view();
}

}  // namespace

MeshFile parseMesh(MeshSource source) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (source.bytes.starts_with(kByteOrderMark)) source.bytes.erase(0, kByteOrderMark.size());
  const std::string_view bytes = source.bytes;
  if (bytes.starts_with("\x1F\x8B") || bytes.starts_with("PK\x03\x04") ||
      bytes.starts_with("\x28\xB5\x2F\xFD")) {
    source.fail("it is compressed; unpack it first");
  }
  if (startsWithWord(bytes, "ply")) return parsePly(source);
  if (isOffKeyword(firstWord(source))) return parseOff(source);
  if (startsWithWord(bytes, "solid") || hasBinaryStlSize(bytes)) return parseStl(source);
  const std::string extension = lowerExtension(source.path);
  if (extension == ".obj") return parseObj(source);
  if (extension == ".ply") return parsePly(source);
  if (extension == ".stl") return parseStl(source);
  if (extension == ".off") return parseOff(source);
  source.fail("neither its content nor its name says OBJ, PLY, STL or OFF; convert it to one of them");
}

}  // namespace detail

MeshFile readMesh(const std::filesystem::path& path) { return detail::parseMesh(detail::load(path)); }

}  // namespace polestar
