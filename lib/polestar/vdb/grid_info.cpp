// readGridInfo: what a .vdb holds, of ours or of others, with truncated files caught before OpenVDB reads
// their trees.

#include <openvdb/io/Stream.h>

#include <fstream>

#include "polestar/core/error.h"
#include "polestar/vdb/detail/vdb_archive.h"
#include "polestar/vdb/detail/vdb_structure.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {
namespace {

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
    detail::checkVdbStructure(stream, static_cast<std::int64_t>(std::filesystem::file_size(path)));
    stream.seekg(0);
    stream.exceptions(std::ios::failbit | std::ios::badbit);

    openvdb::io::Stream reader(stream, /*delayLoad=*/false);
    std::vector<GridInfo> infos;
    const openvdb::GridPtrVecPtr grids = reader.getGrids();
    for (const openvdb::GridBase::Ptr& grid : *grids) infos.push_back(describe(*grid));
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
