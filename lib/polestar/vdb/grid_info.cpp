// readGridInfo and readGridHeaders: what a .vdb holds, of ours or of others.

#include <openvdb/io/File.h>

#include <fstream>

#include "polestar/core/error.h"
#include "polestar/vdb/detail/grid_parts.h"
#include "polestar/vdb/detail/vdb_archive.h"
#include "polestar/vdb/detail/vdb_file.h"
#include "polestar/vdb/detail/vdb_structure.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar {
namespace {

std::vector<std::pair<std::string, std::string>> metadataOf(const openvdb::MetaMap& map) {
  std::vector<std::pair<std::string, std::string>> metadata;
  for (auto entry = map.beginMeta(); entry != map.endMeta(); ++entry)
    metadata.emplace_back(entry->first, entry->second->str());
  return metadata;
}

}  // namespace

GridInfo detail::describeGrid(const openvdb::GridBase& grid) {
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
    for (int corner = 0; corner < 8; ++corner) {
      const openvdb::Vec3d index(corner & 1 ? box.max().x() + 0.5 : box.min().x() - 0.5,
                                 corner & 2 ? box.max().y() + 0.5 : box.min().y() - 0.5,
                                 corner & 4 ? box.max().z() + 0.5 : box.min().z() - 0.5);
      const openvdb::Vec3d at = grid.transform().indexToWorld(index);
      info.box.min = info.box.min.cwiseMin(Vec3(at.x(), at.y(), at.z()));
      info.box.max = info.box.max.cwiseMax(Vec3(at.x(), at.y(), at.z()));
    }
  }
  info.voxelSize = grid.voxelSize()[0];
  info.role = detail::roleOf(grid);
  info.metadata = metadataOf(grid);
  return info;
}

std::vector<GridHeader> readGridHeaders(const std::filesystem::path& path) {
  const std::string prefix = "cannot read " + path.string() + ": ";
  detail::initializeOpenVdb();
  std::vector<GridHeader> headers;
  try {
    std::ifstream stream(path, std::ios::binary);
    std::error_code failure;
    const auto size = std::filesystem::file_size(path, failure);
    if (!stream || failure) throw Error(Errc::io, "there is no such file, or it may not be read");
    detail::checkVdbStructure(stream, static_cast<std::int64_t>(size));
    openvdb::io::File file(path.string());
    file.open(/*delayLoad=*/false);
    const openvdb::GridPtrVecPtr grids = file.readAllGridMetadata();
    for (const openvdb::GridBase::Ptr& grid : *grids) headers.push_back({grid->getName(), metadataOf(*grid)});
  } catch (const Error& error) {
    throw Error(Errc::io, prefix + error.what());
  } catch (const openvdb::Exception& error) {
    throw Error(Errc::io, prefix + error.what());
  }
  if (headers.empty()) throw Error(Errc::io, prefix + "it holds no grids");
  return headers;
}

std::vector<GridInfo> readGridInfo(const std::filesystem::path& path) {
  const openvdb::GridPtrVec grids = detail::readVdb(path).grids;
  std::vector<GridInfo> infos;
  try {
    for (const openvdb::GridBase::Ptr& grid : grids) infos.push_back(detail::describeGrid(*grid));
  } catch (const openvdb::Exception& error) {
    throw Error(Errc::io, "cannot read " + path.string() + ": " + error.what());
  }
  return infos;
}

}  // namespace polestar
