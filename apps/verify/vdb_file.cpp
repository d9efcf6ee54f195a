#include "vdb_file.h"

#include <openvdb/io/Stream.h>
#include <openvdb/openvdb.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <fstream>
#include <numeric>
#include <optional>

#include "report.h"

namespace polestar::verify {
namespace {

using openvdb::Coord;
using openvdb::CoordBBox;
using openvdb::FloatTree;

constexpr double kMostBoxVoxels = 2e9;

struct Grids {
  openvdb::GridPtrVecPtr all;
  openvdb::FloatGrid::Ptr surface, green;
  openvdb::Vec3SGrid::Ptr rest;
};

template <class Grid>
typename Grid::Ptr take(const openvdb::GridPtrVec& grids, const std::string& name) {
  typename Grid::Ptr found;
  for (const auto& grid : grids) {
    if (grid->getName() != name) continue;
    if (found) throw Unreadable("it has two grids " + name);
    found = openvdb::gridPtrCast<Grid>(grid);
    if (!found) throw Unreadable("its grid " + name + " is of type " + grid->valueType());
  }
  if (!found) throw Unreadable("it has no grid " + name + ": not a map of a solid, or an incomplete one");
  return found;
}

/// Between shapes there is no Green's function; anywhere else a file without it is incomplete.
bool isFrameOfMorph(const Grids& grids) { return (*grids.rest)["polestar:weights"] != nullptr; }

Grids readGrids(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) {
    throw Unreadable(code ? code.message() : "it is not a regular file");
  }
  openvdb::initialize();
  try {
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw Unreadable("it cannot be opened");
    // OpenVDB itself does not notice the end of a file.
    stream.exceptions(std::ios::failbit | std::ios::badbit);
    openvdb::io::Stream reader(stream, /*delayLoad=*/false);
    Grids grids;
    grids.all = reader.getGrids();
    if (!grids.all || grids.all->empty()) throw Unreadable("it has no grids");
    grids.surface = take<openvdb::FloatGrid>(*grids.all, "surface");
    grids.rest = take<openvdb::Vec3SGrid>(*grids.all, "rest");
    if (!isFrameOfMorph(grids)) grids.green = take<openvdb::FloatGrid>(*grids.all, "green");
    return grids;
  } catch (const Unreadable&) {
    throw;
  } catch (const std::ios_base::failure&) {
    throw Unreadable("the file ends too early, or is no .vdb");
  } catch (const std::exception& error) {
    throw Unreadable(error.what());
  }
}

Vec3 toVec3(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }

/// World position = origin + index x columns.
struct Affine {
  Vec3 origin, columns[3];
  double scale = 0;
  std::string fault;
};

Affine affineOf(const Grids& grids) {
  const openvdb::math::Transform& transform = grids.surface->transform();
  Affine result;
  for (const auto& grid : *grids.all) {
    if (!(grid->transform() == transform)) {
      result.fault = "grid " + grid->getName() + " has another transform than surface";
    }
  }
  result.origin = toVec3(transform.indexToWorld(openvdb::Vec3d(0)));
  for (int k = 0; k < 3; ++k) {
    openvdb::Vec3d unit(0);
    unit[k] = 1;
    result.columns[k] = toVec3(transform.indexToWorld(unit)) - result.origin;
  }
  const Vec3* c = result.columns;
  const double volume = det(c[0], c[1], c[2]);
  result.scale = std::cbrt(volume);
  // Of differences of large coordinates, only so many digits are left.
  const double far = std::abs(result.origin.x) + std::abs(result.origin.y) + std::abs(result.origin.z);
  const double tolerance = 1e-6 + 1e-14 * far / std::abs(result.scale);
  bool similar = transform.isLinear() && volume > 0;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const double product = dot(c[i], c[j]) / (result.scale * result.scale);
      similar = similar && std::abs(product - (i == j ? 1 : 0)) < tolerance;
    }
  }
  if (!similar) result.fault = "the transform is no similarity that keeps orientation";
  // What the map itself says is exact where differences are not.
  if (similar) result.scale = transform.voxelSize()[0];
  return result;
}

template <class Value>
Value metadata(const Grids& grids, const std::string& key, const char* whenMissing) {
  for (const openvdb::GridBase* grid : std::initializer_list<const openvdb::GridBase*>{
           grids.rest.get(), grids.green.get(), grids.surface.get()}) {
    const auto found = grid ? (*grid)[key] : openvdb::Metadata::Ptr();
    if (!found) continue;
    const auto* typed = dynamic_cast<const openvdb::TypedMetadata<Value>*>(found.get());
    if (!typed) throw Unreadable("its metadata " + key + " is of type " + found->typeName());
    return typed->value();
  }
  throw Unreadable("its metadata " + key + " is missing" + whenMissing);
}

bool hasMetadata(const Grids& grids, const std::string& key) { return (*grids.rest)[key] != nullptr; }

CoordBBox insideBox(const FloatTree& surface, std::size_t& notFinite) {
  if (!(surface.background() > 0)) throw Unreadable("its surface has no outside");
  CoordBBox box;
  for (auto value = surface.cbeginValueAll(); value; ++value) {
    if (*value < 0) box.expand(value.getBoundingBox());
    notFinite += !std::isfinite(*value);
  }
  if (box.empty()) throw Unreadable("no voxel lies inside its surface");
  const openvdb::Vec3d extent = box.extents().asVec3d();
  if (extent.x() * extent.y() * extent.z() > kMostBoxVoxels) {
    throw Unreadable("its box of voxels inside is too large to judge: more than " +
                     shortNumber(kMostBoxVoxels));
  }
  box.expand(1);
  return box;
}

void fillVoxels(const Grids& grids, const CoordBBox& box, VoxelSolid& solid) {
  const Coord extent = box.extents(), low = box.min();
  solid.size = {extent.x(), extent.y(), extent.z()};
  solid.corner = {low.x(), low.y(), low.z()};
  const std::size_t slab = static_cast<std::size_t>(extent.y()) * static_cast<std::size_t>(extent.z());
  solid.slot.assign(static_cast<std::size_t>(extent.x()) * slab, -1);
  std::vector<std::size_t> begin(static_cast<std::size_t>(extent.x()) + 1, 0);
  const auto inSlab = [&](int i, auto&& work) {
    auto surface = grids.surface->getConstUnsafeAccessor();
    std::size_t at = static_cast<std::size_t>(i) * slab;
    for (int j = 0; j < extent.y(); ++j) {
      for (int k = 0; k < extent.z(); ++k, ++at) {
        const Coord place = low.offsetBy(i, j, k);
        const float distance = surface.getValue(place);
        if (distance < 0) work(at, place, distance);
      }
    }
  };
  tbb::parallel_for(0, extent.x(), [&](int i) {
    std::size_t inside = 0;
    inSlab(i, [&](std::size_t, const Coord&, float) { ++inside; });
    begin[static_cast<std::size_t>(i) + 1] = inside;
  });
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  const std::size_t count = begin.back();
  solid.box.resize(count);
  solid.rest.resize(count);
  solid.green.resize(count);
  solid.surface.resize(count);

  const auto size = static_cast<float>(grids.surface->voxelSize()[0]);
  std::vector<std::size_t> noRest(begin.size(), 0), noGreen(begin.size(), 0);
  tbb::parallel_for(0, extent.x(), [&](int i) {
    auto restAt = grids.rest->getConstUnsafeAccessor();
    std::optional<openvdb::FloatGrid::ConstUnsafeAccessor> greenAt;
    if (grids.green) greenAt.emplace(grids.green->getConstUnsafeAccessor());
    const auto slabIndex = static_cast<std::size_t>(i);
    std::size_t voxel = begin[slabIndex];
    inSlab(i, [&](std::size_t at, const Coord& place, float distance) {
      openvdb::Vec3s rest(0);
      float green = 0;
      noRest[slabIndex] += !restAt.probeValue(place, rest);
      noGreen[slabIndex] += greenAt && !greenAt->probeValue(place, green);
      solid.slot[at] = static_cast<std::int32_t>(voxel);
      solid.box[voxel] = static_cast<std::uint32_t>(at);
      solid.surface[voxel] = distance / size;
      solid.rest[voxel] = {rest.x(), rest.y(), rest.z()};
      solid.green[voxel] = green * size;
      ++voxel;
    });
  });
  for (const std::size_t n : noRest) solid.undefinedRest += n;
  for (const std::size_t n : noGreen) solid.undefinedGreen += n;
}

}  // namespace

VoxelSolid readVdb(const std::filesystem::path& path) {
  const Grids grids = readGrids(path);
  const Affine affine = affineOf(grids);
  const auto domain = metadata<std::string>(grids, "polestar:domain", "; is it a file of polestar map?");
  const bool ofCells = domain == "cube" || domain == "polycube";
  if (domain != "ball" && !ofCells) {
    throw Unreadable("it maps onto a " + domain + "; maps onto the ball, a cube or a polycube are judged");
  }

  VoxelSolid solid;
  if (ofCells) {
    solid.domain = Domain(metadata<std::string>(grids, "polestar:domain_cells", ""),
                          metadata<double>(grids, "polestar:domain_cell_side", ""));
  }
  solid.transformFault = affine.fault;
  const CoordBBox box = insideBox(grids.surface->tree(), solid.notFiniteSurface);
  fillVoxels(grids, box, solid);
  const double h = affine.scale;
  const Vec3 center = toVec3(metadata<openvdb::Vec3d>(grids, "polestar:center", ""));
  const Vec3 corner = toVec3(grids.surface->transform().indexToWorld(box.min().asVec3d()));
  for (int k = 0; k < 3; ++k) solid.center[k] = dot(affine.columns[k], center - corner) / (h * h);
  solid.hasGreen = grids.green != nullptr;
  if (!solid.hasGreen) return solid;
  solid.harmonicRadius = metadata<double>(grids, "polestar:harmonic_radius", "") / h;
  solid.greenCap = metadata<double>(grids, "polestar:green_cap", "") * h;
  solid.coreRadius = metadata<double>(grids, "polestar:core_radius", "");
  solid.radiusIsOfGreen = !hasMetadata(grids, "polestar:radius") ||
                          metadata<std::string>(grids, "polestar:radius", "") == "green";
  return solid;
}

}  // namespace polestar::verify
