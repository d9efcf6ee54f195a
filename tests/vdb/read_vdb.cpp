#include "vdb/read_vdb.h"

#include <openvdb/openvdb.h>

#include <stdexcept>

namespace polestar::test {
namespace {

openvdb::Coord coord(const Index& i) { return {i[0], i[1], i[2]}; }

std::array<float, 3> toArray(float value) { return {value, 0, 0}; }
std::array<float, 3> toArray(const openvdb::Vec3s& v) { return {v.x(), v.y(), v.z()}; }

template <class Grid>
void setAccess(FileGrid& out, const typename Grid::ConstPtr& grid) {
  out.background = toArray(grid->background());
  out.value = [grid](const Index& i) { return toArray(grid->tree().getValue(coord(i))); };
  out.active = [grid](const Index& i) { return grid->tree().isValueOn(coord(i)); };
}

FileGrid toPlain(const openvdb::GridBase::ConstPtr& grid) {
  FileGrid out;
  out.name = grid->getName();
  out.valueType = grid->valueType();
  out.gridClass = openvdb::GridBase::gridClassToString(grid->getGridClass());
  out.vectorType = openvdb::GridBase::vecTypeToString(grid->getVectorType());
  out.creator = grid->getCreator();
  out.halfFloats = grid->saveFloatAsHalf();
  for (auto entry = grid->beginMeta(); entry != grid->endMeta(); ++entry) {
    out.metadata[entry->first] = entry->second->typeName() + " " + entry->second->str();
  }
  out.uniformLinear = grid->transform().isLinear() && grid->hasUniformVoxels();
  out.voxelSize = grid->voxelSize().x();
  const openvdb::Vec3d origin = grid->indexToWorld(openvdb::Coord(0, 0, 0));
  out.origin = Vec3(origin.x(), origin.y(), origin.z());
  out.activeCount = grid->activeVoxelCount();
  const openvdb::CoordBBox box = grid->evalActiveVoxelBoundingBox();
  for (int k = 0; k < 3; ++k) {
    out.activeMin[k] = box.min()[k];
    out.activeMax[k] = box.max()[k];
  }
  if (const auto scalars = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid)) {
    setAccess<openvdb::FloatGrid>(out, scalars);
  } else if (const auto vectors = openvdb::gridConstPtrCast<openvdb::Vec3SGrid>(grid)) {
    setAccess<openvdb::Vec3SGrid>(out, vectors);
  } else {
    throw std::runtime_error("grid " + out.name + " has the unexpected type " + grid->type());
  }
  return out;
}

}  // namespace

std::map<std::string, FileGrid> readVdb(const std::filesystem::path& path) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open(/*delayLoad=*/false);
  std::map<std::string, FileGrid> grids;
  const openvdb::GridPtrVecPtr all = file.getGrids();
  for (const openvdb::GridBase::Ptr& grid : *all) {
    if (!grids.emplace(grid->getName(), toPlain(grid)).second) {
      throw std::runtime_error("two grids are named " + grid->getName());
    }
  }
  return grids;
}

}  // namespace polestar::test
