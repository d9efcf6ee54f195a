#include "polestar/vdb/detail/grid_parts.h"

#include <unistd.h>

#include <sstream>

#include "polestar/core/error.h"

namespace polestar::detail {

double machineMemory() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE));
}

void requireCubes(const openvdb::GridBase& grid) {
  if (grid.transform().isLinear() && grid.hasUniformVoxels()) return;
  throw Error(Errc::usage,
              "the voxels of the grid " + grid.getName() + " are no cubes; make them so first with --voxel");
}

// As if read from a file. OpenVDB's constructors refuse scales whose cube is below 3e-15, as if they were
// zero, and round others on the way through a matrix; the map itself and the format work at any scale.
openvdb::math::Transform::Ptr makeUniformTransform(double scale, const Vec3& translation) {
  using openvdb::Vec3d;
  const Vec3d shift(translation.x(), translation.y(), translation.z()), forward(scale), inverse(1 / scale);
  std::stringstream bytes;
  openvdb::writeString(bytes, openvdb::math::UniformScaleTranslateMap::mapType());
  for (const Vec3d& part : {shift, forward, forward, inverse, inverse * inverse, inverse / 2})
    part.write(bytes);
  openvdb::io::setCurrentVersion(bytes);
  const auto transform = std::make_shared<openvdb::math::Transform>();
  transform->read(bytes);
  return transform;
}

namespace {

openvdb::FloatGrid::ConstPtr findScalars(const openvdb::GridCPtrVec& grids, const std::string& name,
                                         openvdb::GridClass kind) {
  openvdb::FloatGrid::ConstPtr first;
  for (const openvdb::GridBase::ConstPtr& grid : grids) {
    const auto scalars = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid);
    if (!scalars) continue;
    if (grid->getName() == name) return scalars;
    if (!first && grid->getGridClass() == kind) first = scalars;
  }
  return first;
}

}  // namespace

openvdb::FloatGrid::ConstPtr findLevelSet(const openvdb::GridCPtrVec& grids) {
  return findScalars(grids, "surface", openvdb::GRID_LEVEL_SET);
}

openvdb::FloatGrid::ConstPtr findFog(const openvdb::GridCPtrVec& grids) {
  return findScalars(grids, "density", openvdb::GRID_FOG_VOLUME);
}

ValueRole roleOf(const openvdb::GridBase& grid) {
  switch (grid.getVectorType()) {
    case openvdb::VEC_COVARIANT:
      return ValueRole::covariant;
    case openvdb::VEC_COVARIANT_NORMALIZE:
      return ValueRole::covariantNormalized;
    case openvdb::VEC_CONTRAVARIANT_RELATIVE:
      return ValueRole::contravariant;
    case openvdb::VEC_CONTRAVARIANT_ABSOLUTE:
      return ValueRole::position;
    case openvdb::VEC_INVARIANT:
      break;
  }
  return ValueRole::invariant;
}

void setRole(openvdb::GridBase& grid, ValueRole role) {
  switch (role) {
    case ValueRole::invariant:
      return grid.setVectorType(openvdb::VEC_INVARIANT);
    case ValueRole::contravariant:
      return grid.setVectorType(openvdb::VEC_CONTRAVARIANT_RELATIVE);
    case ValueRole::covariant:
      return grid.setVectorType(openvdb::VEC_COVARIANT);
    case ValueRole::covariantNormalized:
      return grid.setVectorType(openvdb::VEC_COVARIANT_NORMALIZE);
    case ValueRole::position:
      return grid.setVectorType(openvdb::VEC_CONTRAVARIANT_ABSOLUTE);
  }
}

}  // namespace polestar::detail
