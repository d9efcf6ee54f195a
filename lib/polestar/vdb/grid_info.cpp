// readGridInfo: what a .vdb holds, of ours or of others, with truncated files caught before OpenVDB reads
// their trees.

#include <openvdb/io/Archive.h>
#include <openvdb/io/GridDescriptor.h>
#include <openvdb/io/Stream.h>

#include <fstream>

#include "polestar/core/error.h"
#include "polestar/vdb/detail/vdb_archive.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {
namespace {

// Follows the grid offsets through the file.
class StructureCheck : public openvdb::io::Archive {
 public:
  /// @throws Error{Errc::io} when a grid ends beyond the end of the file; what OpenVDB throws on a bad
  /// header.
  void run(std::istream& stream, std::int64_t fileSize) {
    readHeader(stream);
    if (!inputHasGridOffsets()) return;  // written to a pipe; only reading all of it will tell
    setFormatVersion(stream);
    setLibraryVersion(stream);
    openvdb::MetaMap().readMeta(stream);
    std::int64_t end = stream.tellg();
    for (std::int32_t left = readGridCount(stream); left > 0; --left) {
      openvdb::io::GridDescriptor descriptor;
      descriptor.read(stream);
      if (descriptor.getEndPos() < end || descriptor.getEndPos() > fileSize) {
        throw Error(Errc::io, "grid " + descriptor.gridName() + " ends at byte " +
                                  std::to_string(descriptor.getEndPos()) + " of " + std::to_string(fileSize) +
                                  ": the file is truncated or damaged");
      }
      end = descriptor.getEndPos();
      descriptor.seekToEnd(stream);
    }
  }
};

GridInfo describe(const openvdb::GridBase& grid) {
  GridInfo info;
  info.name = grid.getName();
  info.valueType = grid.valueType();
  info.gridClass = openvdb::GridBase::gridClassToString(grid.getGridClass());
  info.activeVoxels = grid.activeVoxelCount();
  info.memoryBytes = grid.memUsage();
  if (info.activeVoxels > 0) {
    const openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
    for (int k = 0; k < 3; ++k) {
      info.indexMin[k] = box.min()[k];
      info.indexMax[k] = box.max()[k];
    }
  }
  info.voxelSize = grid.voxelSize()[0];
  for (auto entry = grid.beginMeta(); entry != grid.endMeta(); ++entry) {
    info.metadata.emplace_back(entry->first, entry->second->str());
  }
  return info;
}

}  // namespace

std::vector<GridInfo> readGridInfo(const std::filesystem::path& path) {
  detail::initializeOpenVdb();
  const std::string prefix = "cannot read " + path.string() + ": ";
  std::error_code failure;
  if (!std::filesystem::is_regular_file(path, failure)) {
    throw Error(Errc::io, prefix + (failure ? failure.message() : "not a regular file"));
  }
  try {
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw Error(Errc::io, std::generic_category().message(errno));
    stream.exceptions(std::ios::failbit | std::ios::badbit);
    StructureCheck().run(stream, static_cast<std::int64_t>(std::filesystem::file_size(path)));
    stream.seekg(0);

    openvdb::io::Stream reader(stream, /*delayLoad=*/false);
    std::vector<GridInfo> infos;
    for (const openvdb::GridBase::Ptr& grid : *reader.getGrids()) infos.push_back(describe(*grid));
    return infos;
  } catch (const Error& error) {
    throw Error(Errc::io, prefix + error.what());
  } catch (const std::ios_base::failure&) {
    throw Error(Errc::io, prefix + "the file ends too early; write it again");
  } catch (const std::exception& error) {
    // OpenVDB names its exception class in front of the reason.
    throw Error(Errc::io, prefix + error.what());
  }
}

}  // namespace polestar
