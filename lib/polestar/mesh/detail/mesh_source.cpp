#include "polestar/mesh/detail/mesh_source.h"

#include <fstream>
#include <system_error>

namespace polestar::detail {

MeshSource loadMeshSource(const std::filesystem::path& path) {
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

void prepareMeshSource(MeshSource& source) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (source.bytes.starts_with(kByteOrderMark)) source.bytes.erase(0, kByteOrderMark.size());
  const std::string_view bytes = source.bytes;
  if (bytes.starts_with("\x1F\x8B") || bytes.starts_with("PK\x03\x04") ||
      bytes.starts_with("\x28\xB5\x2F\xFD")) {
    source.fail("it is compressed; unpack it first");
  }
}

}  // namespace polestar::detail
