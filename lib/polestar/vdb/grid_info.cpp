// readGridInfo: what a .vdb holds, of ours or of others.

#include "polestar/core/error.h"
#include "polestar/vdb/detail/vdb_file.h"
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
  const openvdb::GridPtrVec grids = detail::readVdb(path);
  std::vector<GridInfo> infos;
  try {
    for (const openvdb::GridBase::Ptr& grid : grids) infos.push_back(describe(*grid));
  } catch (const openvdb::Exception& error) {
    throw Error(Errc::io, "cannot read " + path.string() + ": " + error.what());
  }
  return infos;
}

}  // namespace polestar
