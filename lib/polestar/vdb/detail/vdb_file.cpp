#include "polestar/vdb/detail/vdb_file.h"

#include <openvdb/io/Stream.h>

#include <fstream>
#include <iostream>
#include <sstream>
#include <type_traits>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"
#include "polestar/vdb/detail/vdb_structure.h"

namespace polestar::detail {
namespace {

openvdb::Metadata::Ptr toOpenVdb(const Metadata& value) {
  return std::visit(
      [](const auto& v) -> openvdb::Metadata::Ptr {
        using Value = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<Value, Vec3>) {
          return std::make_shared<openvdb::Vec3DMetadata>(openvdb::Vec3d(v.x(), v.y(), v.z()));
        } else {
          return std::make_shared<openvdb::TypedMetadata<Value>>(v);
        }
      },
      value);
}

// Shares the tree, has metadata of its own.
openvdb::GridBase::ConstPtr withMetadata(const openvdb::GridBase::Ptr& grid,
                                         const std::map<std::string, Metadata>& metadata,
                                         std::uint32_t compression) {
  // copyGrid() would round the transform; this one returns a new grid, though it calls it constant.
  const auto copy =
      std::const_pointer_cast<openvdb::GridBase>(grid->copyGridReplacingTransform(grid->transformPtr()));
  for (const auto& [key, value] : metadata) copy->insertMeta(key, *toOpenVdb(value));
  addFileMetadata(*copy, compression);
  return copy;
}

VdbContent readFrom(std::istream& stream, std::int64_t size) {
  checkVdbStructure(stream, size);
  stream.seekg(0);
  stream.exceptions(std::ios::failbit | std::ios::badbit);
  openvdb::io::Stream reader(stream, /*delayLoad=*/false);
  VdbContent content{*reader.getGrids(), {}};
  if (const openvdb::MetaMap::Ptr metadata = reader.getMetadata()) content.metadata = *metadata;
  return content;
}

VdbContent readFile(const std::filesystem::path& path) {
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure))
    throw Error(Errc::io, failure ? failure.message() : "not a regular file");
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw Error(Errc::io, std::generic_category().message(errno));
  return readFrom(stream, static_cast<std::int64_t>(std::filesystem::file_size(path)));
}

// As a whole: the format wants a stream that can be searched.
VdbContent readStandardInput() {
  std::stringstream stream;
  if (!(stream << std::cin.rdbuf())) throw Error(Errc::io, "it is empty");
  const auto size = static_cast<std::int64_t>(stream.tellp());
  return readFrom(stream, size);
}

}  // namespace

VdbContent readVdb(const std::filesystem::path& path) {
  initializeOpenVdb();
  const bool standardInput = path == "-";
  const std::string prefix = "cannot read " + (standardInput ? "standard input" : path.string()) + ": ";
  try {
    return standardInput ? readStandardInput() : readFile(path);
  } catch (const Error& error) {
    throw Error(Errc::io, prefix + error.what());
  } catch (const std::ios_base::failure&) {
    throw Error(Errc::io, prefix + "the file ends too early; write it again");
  } catch (const std::exception& error) {
    // OpenVDB names its exception class in front of the reason.
    throw Error(Errc::io, prefix + error.what());
  }
}

void writeVdb(const std::filesystem::path& path, const std::vector<openvdb::GridBase::Ptr>& grids,
              const std::map<std::string, Metadata>& metadata, const VdbForm& form) {
  openvdb::GridCPtrVec written;
  for (const auto& grid : grids) written.push_back(withMetadata(grid, metadata, form.compression));
  const auto cannotWrite = [&](const std::string& reason) {
    return Error(Errc::io, "cannot write " + path.string() + ": " + reason);
  };
  const auto writeTo = [&](std::iostream& stream) {
    try {
      stream.exceptions(std::ios::failbit | std::ios::badbit);
      writeArchive(stream, written, form);
    } catch (const std::ios_base::failure&) {
      throw cannotWrite("the disk is full or the device failed");
    } catch (const openvdb::Exception& error) {
      throw cannotWrite(error.what());
    }
  };
  if (path == "-") {
    std::stringstream stream;
    writeTo(stream);
    stream.seekg(0);
    if (!(std::cout << stream.rdbuf() << std::flush)) throw cannotWrite("standard output was closed");
    return;
  }
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::fstream stream(temporary, std::ios::binary | std::ios::in | std::ios::out | std::ios::trunc);
    if (!stream) throw cannotWrite(std::generic_category().message(errno));
    writeTo(stream);
  });
}

}  // namespace polestar::detail
