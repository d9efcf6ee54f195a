#include "level_set_paths.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetMorph.h>
#include <openvdb/tools/LevelSetRebuild.h>
#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/VolumeToMesh.h>

#include <algorithm>
#include <cmath>

#include "measure.h"

namespace polestar::bench {
namespace {

using openvdb::FloatGrid;

constexpr float kBand = 3;  // voxels on each side, OpenVDB's own default

FloatGrid::Ptr distancesOf(const TriMesh& mesh, double voxel, float halfWidth) {
  std::vector<openvdb::Vec3s> points;
  for (const Vec3& v : mesh.vertices) points.emplace_back(v.x(), v.y(), v.z());
  std::vector<openvdb::Vec3I> triangles;
  for (const Triangle& t : mesh.triangles)
    triangles.emplace_back(static_cast<openvdb::Index32>(t[0]), static_cast<openvdb::Index32>(t[1]),
                           static_cast<openvdb::Index32>(t[2]));
  return openvdb::tools::meshToLevelSet<FloatGrid>(*openvdb::math::Transform::createLinearTransform(voxel),
                                                   points, triangles, halfWidth);
}

LevelSetFrame seenAs(const FloatGrid& grid) {
  std::vector<openvdb::Vec3s> points;
  std::vector<openvdb::Vec4I> quads;
  openvdb::tools::volumeToMesh(grid, points, quads);
  LevelSetFrame frame{openvdb::tools::levelSetVolume(grid), {}};
  for (const openvdb::Vec3s& p : points) frame.surface.vertices.emplace_back(p.x(), p.y(), p.z());
  for (const openvdb::Vec4I& q : quads) {
    const auto at = [&](int k) { return static_cast<Triangle::value_type>(q[k]); };
    frame.surface.triangles.push_back({at(0), at(1), at(2)});
    frame.surface.triangles.push_back({at(0), at(2), at(3)});
  }
  return frame;
}

}  // namespace

struct LevelSetPair::Grids {
  FloatGrid::Ptr first, last;  ///< bands as wide as the solids
  FloatGrid::Ptr narrowFirst, narrowLast;
};

LevelSetPair::LevelSetPair(const TriMesh& first, const TriMesh& last, double voxel)
    : grids_(std::make_unique<Grids>()) {
  openvdb::initialize();
  const double across = std::max(boundingBox(first).diagonal(), boundingBox(last).diagonal());
  const auto wide = static_cast<float>(across / voxel);
  grids_->first = distancesOf(first, voxel, wide);
  grids_->last = distancesOf(last, voxel, wide);
  grids_->narrowFirst = distancesOf(first, voxel, kBand);
  grids_->narrowLast = distancesOf(last, voxel, kBand);
}

LevelSetPair::~LevelSetPair() = default;

double LevelSetPair::morph(std::size_t frames, const std::function<void(const LevelSetFrame&)>& seen) const {
  using Morphing = openvdb::tools::LevelSetMorphing<FloatGrid>;
  // Far away the speed is the width of the target's band; within it what is left of the way falls like
  // exp(-time).
  const double farthest = [&] {
    const std::vector<double> ways = distancesToLast(seenAs(*grids_->narrowFirst).surface.vertices);
    return *std::max_element(ways.begin(), ways.end());
  }();
  const double voxel = grids_->first->voxelSize()[0], unit = farthest / (kBand * voxel) + 1;
  double arrival = 0;
  {
    const FloatGrid::Ptr grid = grids_->narrowFirst->deepCopy();
    Morphing morphing(*grid, *grids_->narrowLast);
    double off = 1e300;
    for (int step = 0; step < 40; ++step) {
      morphing.advect(0.25 * unit * step, 0.25 * unit * (step + 1));
      arrival = 0.25 * unit * (step + 1);
      const double now = rootMeanSquare(distancesToLast(seenAs(*grid).surface.vertices)) / voxel;
      if (now < 0.1 || now > 0.99 * off) break;
      off = now;
    }
  }
  const FloatGrid::Ptr grid = grids_->narrowFirst->deepCopy();
  Morphing morphing(*grid, *grids_->narrowLast);
  double seconds = 0;
  seen(seenAs(*grid));
  for (std::size_t i = 1; i < frames; ++i) {
    const double end = arrival / static_cast<double>(frames - 1);
    Stopwatch watch;
    morphing.advect(static_cast<double>(i - 1) * end, static_cast<double>(i) * end);
    seconds += watch.lap().cpu;
    seen(seenAs(*grid));
  }
  return seconds;
}

double LevelSetPair::blend(std::size_t frames, const std::function<void(const LevelSetFrame&)>& seen) const {
  double seconds = 0;
  for (std::size_t i = 0; i < frames; ++i) {
    const auto t = static_cast<float>(i) / static_cast<float>(frames - 1);
    Stopwatch watch;
    const FloatGrid::Ptr a = grids_->first->deepCopy(), b = grids_->last->deepCopy();
    a->tree().combine(b->tree(),
                      [t](const float& x, const float& y, float& blended) { blended = (1 - t) * x + t * y; });
    const FloatGrid::Ptr frame = openvdb::tools::levelSetRebuild(*a, 0, kBand);
    seconds += watch.lap().cpu;
    seen(seenAs(*frame));
  }
  return seconds;
}

std::vector<double> LevelSetPair::distancesToLast(const std::vector<Vec3>& points) const {
  const openvdb::tools::GridSampler<FloatGrid, openvdb::tools::BoxSampler> sampler(*grids_->last);
  std::vector<double> distances;
  for (const Vec3& p : points)
    distances.push_back(std::abs(static_cast<double>(sampler.wsSample({p.x(), p.y(), p.z()}))));
  return distances;
}

double rootMeanSquare(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return values.empty() ? 0 : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace polestar::bench
