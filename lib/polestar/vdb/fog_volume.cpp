#include "polestar/vdb/fog_volume.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/RayIntersector.h>

#include <cmath>
#include <optional>

#include "polestar/core/error.h"
#include "polestar/vdb/detail/grid_parts.h"
#include "polestar/vdb/detail/vdb_file.h"

namespace polestar {
namespace {

using Intersector = openvdb::tools::VolumeRayIntersector<openvdb::FloatGrid>;
using FogRay = openvdb::math::Ray<double>;

openvdb::Vec3d toOpenVdb(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

openvdb::Vec3SGrid::Ptr findColors(const openvdb::GridPtrVec& grids) {
  for (const char* name : {"Cd", "color"}) {
    for (const openvdb::GridBase::Ptr& grid : grids) {
      const auto colors = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid);
      if (colors && grid->getName() == name) return colors;
    }
  }
  return nullptr;
}

float largestOf(const openvdb::FloatGrid& density, const std::string& path) {
  float largest = 0;
  for (auto value = density.cbeginValueOn(); value; ++value) {
    if (!(*value >= 0) || !std::isfinite(*value)) {
      const openvdb::Vec3d at = density.indexToWorld(value.getCoord());
      throw Error(Errc::io, path + ": the grid " + density.getName() + " has the density " +
                                std::to_string(*value) + " at " + std::to_string(at.x()) + " " +
                                std::to_string(at.y()) + " " + std::to_string(at.z()));
    }
    largest = std::max(largest, *value);
  }
  return largest;
}

/// World to index, without the virtual calls of a transform.
struct ToIndex {
  Mat3 matrix = Mat3::Identity();
  Vec3 offset = Vec3::Zero();

  ToIndex() = default;
  explicit ToIndex(const openvdb::GridBase& grid) {
    const auto at = [&](const Vec3& world) {
      const openvdb::Vec3d index = grid.transform().worldToIndex(toOpenVdb(world));
      return Vec3(index.x(), index.y(), index.z());
    };
    offset = at(Vec3::Zero());
    for (int k = 0; k < 3; ++k) matrix.col(k) = at(Vec3::Unit(k)) - offset;
  }
  openvdb::Vec3d operator()(const Vec3& world) const { return toOpenVdb(matrix * world + offset); }
};

}  // namespace

struct FogVolume::Data {
  ToIndex toDensity, toColor;
  openvdb::FloatGrid::ConstPtr density;
  openvdb::Vec3SGrid::Ptr colors;
  std::string densityName, colorName;
  float largest = 0;
  std::unique_ptr<Intersector> intersector;
};

FogVolume::FogVolume(const std::filesystem::path& path) {
  const openvdb::GridPtrVec grids = detail::readVdb(path).grids;
  auto data = std::make_shared<Data>();
  data->density = detail::findFog({grids.begin(), grids.end()});
  if (!data->density) {
    throw Error(Errc::io, path.string() + " has no fog: no grid density, and none of the class fog volume");
  }
  if (data->density->empty() || data->density->activeVoxelCount() == 0)
    throw Error(Errc::io, path.string() + ": the grid " + data->density->getName() + " is empty");
  if (!data->density->hasUniformVoxels()) {
    throw Error(Errc::io, path.string() + ": the voxels of the grid " + data->density->getName() +
                              " are no cubes; resample it");
  }
  data->largest = largestOf(*data->density, path.string());
  data->densityName = data->density->getName();
  data->colors = findColors(grids);
  if (data->colors) data->colorName = data->colors->getName();
  data->toDensity = ToIndex(*data->density);
  if (data->colors) data->toColor = ToIndex(*data->colors);
  // A voxel more, for what interpolation reads.
  data->intersector = std::make_unique<Intersector>(*data->density, 1);
  data_ = std::move(data);
}

const std::string& FogVolume::densityName() const { return data_->densityName; }
const std::string& FogVolume::colorName() const { return data_->colorName; }
double FogVolume::voxelSize() const { return data_->density->voxelSize()[0]; }
double FogVolume::largestDensity() const { return data_->largest; }
std::size_t FogVolume::activeVoxels() const { return data_->density->activeVoxelCount(); }

std::vector<Vec3> FogVolume::outline() const {
  std::vector<Vec3> points;
  const auto addBox = [&](const openvdb::CoordBBox& box) {
    for (int corner = 0; corner < 8; ++corner) {
      const openvdb::Vec3d index((corner & 1 ? box.max() : box.min()).x(),
                                 (corner & 2 ? box.max() : box.min()).y(),
                                 (corner & 4 ? box.max() : box.min()).z());
      const openvdb::Vec3d world = data_->density->indexToWorld(index);
      points.emplace_back(world.x(), world.y(), world.z());
    }
  };
  for (auto leaf = data_->density->tree().cbeginLeaf(); leaf; ++leaf) {
    openvdb::CoordBBox box;
    leaf->evalActiveBoundingBox(box);
    if (!box.empty()) addBox(box);
  }
  auto tile = data_->density->tree().cbeginValueOn();
  tile.setMaxDepth(decltype(tile)::LEAF_DEPTH - 1);
  for (; tile; ++tile) {
    openvdb::CoordBBox box;
    tile.getBoundingBox(box);
    addBox(box);
  }
  return points;
}

struct FogProbe::Readers {
  std::shared_ptr<const FogVolume::Data> data;
  Intersector intersector;
  openvdb::FloatGrid::ConstAccessor density;
  std::optional<openvdb::Vec3SGrid::ConstAccessor> colors;
  std::vector<FogRay::TimeSpan> hits;

  explicit Readers(std::shared_ptr<const FogVolume::Data> d)
      : data(std::move(d)), intersector(*data->intersector), density(data->density->getConstAccessor()) {
    if (data->colors) colors.emplace(data->colors->getConstAccessor());
  }
};

FogProbe::FogProbe(const FogVolume& fog) : readers_(std::make_unique<Readers>(fog.data_)) {}
FogProbe::~FogProbe() = default;

void FogProbe::spans(const Vec3& origin, const Vec3& direction, std::vector<FogSpan>& result) {
  result.clear();
  const double voxel = readers_->data->density->voxelSize()[0];
  if (!readers_->intersector.setWorldRay(FogRay(toOpenVdb(origin), toOpenVdb(direction)))) return;
  readers_->hits.clear();
  readers_->intersector.hits(readers_->hits);
  for (const FogRay::TimeSpan& hit : readers_->hits) result.push_back({hit.t0 * voxel, hit.t1 * voxel});
}

float FogProbe::density(const Vec3& world) {
  const openvdb::Vec3d index = readers_->data->toDensity(world);
  const openvdb::Coord corner = openvdb::Coord::floor(index);
  const auto* leaf = readers_->density.probeConstLeaf(corner);
  const int x = corner.x() & 7, y = corner.y() & 7, z = corner.z() & 7;
  if (!leaf || x == 7 || y == 7 || z == 7)
    return openvdb::tools::BoxSampler::sample(readers_->density, index);
  // All eight voxels lie in one leaf, z fastest.
  const float* v = leaf->buffer().data() + (x << 6) + (y << 3) + z;
  const auto fx = static_cast<float>(index.x() - corner.x()), fy = static_cast<float>(index.y() - corner.y()),
             fz = static_cast<float>(index.z() - corner.z());
  const auto along = [fz](const float* line) { return line[0] + fz * (line[1] - line[0]); };
  const auto across = [&](const float* plane) {
    const float low = along(plane);
    return low + fy * (along(plane + 8) - low);
  };
  const float low = across(v);
  return low + fx * (across(v + 64) - low);
}

Vec3f FogProbe::color(const Vec3& world) {
  if (!readers_->colors) return Vec3f::Ones();
  const openvdb::Vec3d index = readers_->data->toColor(world);
  const openvdb::Coord corner = openvdb::Coord::floor(index);
  Vec3f sum = Vec3f::Zero();
  float weight = 0;
  for (int k = 0; k < 8; ++k) {
    const openvdb::Coord at = corner.offsetBy(k & 1, k >> 1 & 1, k >> 2);
    openvdb::Vec3s value;
    if (!readers_->colors->probeValue(at, value)) continue;
    float w = 1;
    for (int axis = 0; axis < 3; ++axis)
      w *= static_cast<float>(1 - std::abs(index[axis] - static_cast<double>(at[axis])));
    sum += w * Vec3f(value.x(), value.y(), value.z());
    weight += w;
  }
  return weight > 0 && sum.allFinite() ? Vec3f((sum / weight).cwiseMax(0.0f)) : Vec3f(Vec3f::Ones());
}

}  // namespace polestar
