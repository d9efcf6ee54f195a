#include "polestar/mesh/read_mesh.h"

#include <algorithm>
#include <cctype>

#include "polestar/mesh/detail/mesh_bytes_out.h"
#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar {
namespace detail {
namespace {

bool startsWithWord(std::string_view text, std::string_view word) {
  if (text.size() <= word.size()) return false;
  const bool same = std::equal(word.begin(), word.end(), text.begin(), [](char a, char b) {
    return a == std::tolower(static_cast<unsigned char>(b));
  });
  return same && std::isspace(static_cast<unsigned char>(text[word.size()]));
}

std::string_view firstWord(const MeshSource& source) {
  TextLines lines(source, {.comment = '#'});
  return lines.nextFullLine() ? lines.word() : std::string_view();
}

}  // namespace

MeshFile parseMesh(MeshSource source) {
  prepareMeshSource(source);
  const std::string_view bytes = source.bytes;
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

MeshFile readMesh(const std::filesystem::path& path) {
  return detail::parseMesh(detail::loadMeshSource(path));
}

MeshFile readMesh(std::string bytes, const std::filesystem::path& name) {
  detail::MeshSource source{name, std::move(bytes)};
  if (source.bytes.empty()) source.fail("it is empty");
  return detail::parseMesh(std::move(source));
}

}  // namespace polestar
