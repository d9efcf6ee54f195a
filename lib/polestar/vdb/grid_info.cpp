// readGridInfo and readGridHeaders: what a .vdb holds, of ours or of others.

#include <openvdb/io/File.h>

#include <fstream>

#include "polestar/core/error.h"
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
  info.metadata = metadataOf(grid);
  return info;
}

}  // namespace

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
