#include "polestar/texture/detail/leaf_images.h"

#include <algorithm>
#include <array>
#include <limits>

namespace polestar::detail {
namespace {

constexpr int kSize = VoxelBatch::kLeafSize;
constexpr std::size_t kVoxels = std::size_t{1} * kSize * kSize * kSize;
constexpr double kSpacing = 3.5;     // of the nodes, voxels: three span a leaf
constexpr double kTolerance = 0.05;  // of what a voxel covers

/// Values and slopes of the three quadratic polynomials that are 1 at one node and 0 at the others.
struct Basis {
  std::array<double, 3> value, slope;
  explicit Basis(double voxel) {
    const double t = voxel / kSpacing - 1;  // nodes at -1, 0, 1
    value = {t * (t - 1) / 2, (1 - t) * (1 + t), t * (t + 1) / 2};
    slope = {(t - 0.5) / kSpacing, -2 * t / kSpacing, (t + 0.5) / kSpacing};
  }
};

struct Interpolant {
  std::array<Vec3, 27> nodes;

  Vec3 at(const Basis& x, const Basis& y, const Basis& z) const {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) {
        const double xy = x.value[i] * y.value[j];
        for (int k = 0; k < 3; ++k) sum += xy * z.value[k] * nodes[9 * i + 3 * j + k];
      }
    }
    return sum;
  }
};

}  // namespace

void LeafImager::locate(const VoxelBatch& batch, LeafImages& images) const {
  ++leaves_;
  images.places.resize(batch.points.size());
  images.footprints.resize(batch.points.size());
  if (jacobians_) images.jacobians.resize(batch.points.size());
  const bool inside =
      batch.points.size() == kVoxels && std::all_of(batch.signedDistance.begin(), batch.signedDistance.end(),
                                                    [](float distance) { return distance < 0; });
  if (inside && interpolate(batch, images)) {
    ++interpolated_;
  } else {
    askEach(batch, images);
  }
}

bool LeafImager::interpolate(const VoxelBatch& batch, LeafImages& images) const {
  const double h = batch.voxelSize;
  std::array<Vec3, 35> points, places;
  for (int i = 0; i < 27; ++i) points[i] = batch.corner + h * kSpacing * Vec3(i / 9, i / 3 % 3, i % 3);
  for (int i = 0; i < 8; ++i) {
    points[27 + i] = batch.corner + h * kSpacing * (Vec3::Constant(0.5) + Vec3(i >> 2, i >> 1 & 1, i & 1));
  }
  route_.map(points, places);
  for (const Vec3& place : places) {
    if (!place.allFinite()) return false;
  }

  Interpolant interpolant;
  std::copy_n(places.begin(), 27, interpolant.nodes.begin());
  const std::array<Basis, 2> middles{Basis(0.5 * kSpacing), Basis(1.5 * kSpacing)};
  // What a voxel covers: the leaf's middle, from the nodes beside it.
  double covered = 0;
  for (const int step : {9, 3, 1}) {
    covered = std::max(covered,
                       (interpolant.nodes[13 + step] - interpolant.nodes[13 - step]).norm() / (2 * kSpacing));
  }
  for (int i = 0; i < 8; ++i) {
    const Vec3 guess = interpolant.at(middles[i >> 2], middles[i >> 1 & 1], middles[i & 1]);
    if (!((guess - places[27 + i]).norm() <= kTolerance * covered)) return false;
  }

  static const std::array<Basis, kSize> kBases{Basis(0), Basis(1), Basis(2), Basis(3),
                                               Basis(4), Basis(5), Basis(6), Basis(7)};
  // Axis by axis: 27 nodes, then 3 x 3 lines of a plane x, then 3 of a line x, y.
  for (int x = 0; x < kSize; ++x) {
    std::array<Vec3, 9> plane, planeByX;
    for (int n = 0; n < 9; ++n) {
      plane[n] = planeByX[n] = Vec3::Zero();
      for (int i = 0; i < 3; ++i) {
        plane[n] += kBases[x].value[i] * interpolant.nodes[9 * i + n];
        planeByX[n] += kBases[x].slope[i] * interpolant.nodes[9 * i + n];
      }
    }
    for (int y = 0; y < kSize; ++y) {
      std::array<Vec3, 3> line, lineByX, lineByY;
      for (int n = 0; n < 3; ++n) {
        line[n] = lineByX[n] = lineByY[n] = Vec3::Zero();
        for (int j = 0; j < 3; ++j) {
          line[n] += kBases[y].value[j] * plane[3 * j + n];
          lineByX[n] += kBases[y].value[j] * planeByX[3 * j + n];
          lineByY[n] += kBases[y].slope[j] * plane[3 * j + n];
        }
      }
      for (int z = 0; z < kSize; ++z) {
        const std::size_t voxel = static_cast<std::size_t>(64 * x + 8 * y + z);
        const Basis& b = kBases[z];
        const auto combine = [](const std::array<double, 3>& w, const std::array<Vec3, 3>& v) -> Vec3 {
          return w[0] * v[0] + w[1] * v[1] + w[2] * v[2];
        };
        images.places[voxel] = combine(b.value, line);
        images.footprints[voxel].col(0) = combine(b.value, lineByX);
        images.footprints[voxel].col(1) = combine(b.value, lineByY);
        images.footprints[voxel].col(2) = combine(b.slope, line);
      }
    }
  }
  if (jacobians_) {
    for (std::size_t i = 0; i < kVoxels; ++i) images.jacobians[i] = images.footprints[i] / h;
  }
  return true;
}

// Footprints from the neighbours in the leaf: outside the solid, where places do not change along rays, these
// are what the eye sees there.
void LeafImager::askEach(const VoxelBatch& batch, LeafImages& images) const {
  route_.map(batch.points, images.places);
  std::array<std::int16_t, kVoxels> rank;
  rank.fill(-1);
  for (std::size_t i = 0; i < batch.places.size(); ++i) rank[batch.places[i]] = static_cast<std::int16_t>(i);
  for (std::size_t i = 0; i < batch.places.size(); ++i) {
    const int place = batch.places[i];
    const std::array<int, 3> at{place >> 6, place >> 3 & 7, place & 7};
    const std::array<int, 3> strides{64, 8, 1};
    for (int axis = 0; axis < 3; ++axis) {
      const auto image = [&](int step) -> const Vec3* {
        const int there = at[axis] + step;
        if (there < 0 || there >= kSize) return nullptr;
        const std::int16_t neighbour = rank[place + step * strides[axis]];
        if (neighbour < 0 || !images.places[neighbour].allFinite()) return nullptr;
        return &images.places[neighbour];
      };
      const Vec3 *before = image(-1), *after = image(1), *here = image(0);
      Vec3 edge = Vec3::Zero();
      if (before && after) {
        edge = (*after - *before) / 2;
      } else if (here && (before || after)) {
        edge = after ? Vec3(*after - *here) : Vec3(*here - *before);
      }
      images.footprints[i].col(axis) = edge;
    }
  }
  if (!jacobians_) return;
  route_.jacobian(batch.points, images.jacobians);
  for (std::size_t i = 0; i < batch.points.size(); ++i) {
    if (!images.jacobians[i].allFinite()) images.jacobians[i] = images.footprints[i] / batch.voxelSize;
  }
}

}  // namespace polestar::detail
