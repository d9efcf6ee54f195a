#include "polestar/texture/detail/leaf_images.h"

#include <algorithm>

namespace polestar::detail {
namespace {

constexpr int kLeaf = VoxelBatch::kLeafSize, kBlock = 4, kBlocks = 8;
constexpr std::size_t kVoxels = std::size_t{1} * kLeaf * kLeaf * kLeaf;
constexpr int kSpacing = 2;                   // of the nodes, voxels
constexpr int kNodes = kLeaf / kSpacing + 1;  // along an axis of a leaf
constexpr int kAllNodes = kNodes * kNodes * kNodes;
constexpr double kTolerance = 0.1;  // of what a voxel covers

/// Values and slopes, per voxel, of the quadratic polynomials that are 1 at one of three nodes and 0 at the
/// others.
struct Basis {
  std::array<double, 3> value, slope;
  explicit Basis(double voxel) {
    const double t = voxel / kSpacing - 1;  // nodes at -1, 0, 1
    value = {t * (t - 1) / 2, (1 - t) * (1 + t), t * (t + 1) / 2};
    slope = {(t - 0.5) / kSpacing, -2 * t / kSpacing, (t + 0.5) / kSpacing};
  }
};

const std::array<Basis, kBlock>& voxelBases() {
  static const std::array<Basis, kBlock> bases{Basis(0), Basis(1), Basis(2), Basis(3)};
  return bases;
}

/// Voxels between the nodes, where the map must agree: corners of a tetrahedron.
constexpr std::array<std::array<int, 3>, 4> kChecks{{{1, 1, 1}, {1, 3, 3}, {3, 1, 3}, {3, 3, 1}}};

std::array<int, 3> blockOrigin(int block) {
  return {kBlock * (block >> 2), kBlock * (block >> 1 & 1), kBlock * (block & 1)};
}

int nodeIndex(int x, int y, int z) { return (kNodes * x + y) * kNodes + z; }

/// The places of a block's 27 nodes.
struct BlockNodes {
  std::array<Vec3, 27> places;

  BlockNodes(const std::array<Vec3, kAllNodes>& all, int block) {
    const auto [x, y, z] = blockOrigin(block);
    for (int i = 0; i < 27; ++i) {
      places[i] = all[nodeIndex(x / kSpacing + i / 9, y / kSpacing + i / 3 % 3, z / kSpacing + i % 3)];
    }
  }
  bool finite() const {
    return std::all_of(places.begin(), places.end(), [](const Vec3& place) { return place.allFinite(); });
  }
  /// The longest image of a voxel's edge, in the middle.
  double covered() const {
    double longest = 0;
    for (const int step : {9, 3, 1})
      longest = std::max(longest, (places[13 + step] - places[13 - step]).norm() / (2 * kSpacing));
    return longest;
  }
  Vec3 at(const Basis& x, const Basis& y, const Basis& z) const {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 27; ++i) sum += x.value[i / 9] * y.value[i / 3 % 3] * z.value[i % 3] * places[i];
    return sum;
  }
};

using Weights = std::array<double, 3>;

template <std::size_t N>
std::array<Vec3, N / 3> contract(const Weights& weights, const std::array<Vec3, N>& values) {
  std::array<Vec3, N / 3> result;
  for (std::size_t n = 0; n < N / 3; ++n) {
    result[n] =
        weights[0] * values[n] + weights[1] * values[N / 3 + n] + weights[2] * values[2 * (N / 3) + n];
  }
  return result;
}

/// One leaf on its way.
class Leaf {
 public:
  Leaf(const VoxelBatch& batch, LeafImages& images) : batch_(batch), images_(images) {
    rank_.fill(-1);
    for (std::size_t i = 0; i < batch.places.size(); ++i)
      rank_[batch.places[i]] = static_cast<std::int16_t>(i);
  }

  /// How many blocks were filled.
  std::size_t interpolate(const TextureRoute& route);
  void askOthers(const TextureRoute& route);
  void jacobiansOfOthers(const TextureRoute& route);
  void jacobiansOfInterpolated();

 private:
  bool inside(int block) const;
  Vec3 position(const Vec3& voxel) const { return batch_.corner + batch_.voxelSize * voxel; }
  void fill(int block, const BlockNodes& nodes);
  Mat3 differences(std::size_t voxel) const;
  std::int16_t rankAt(int x, int y, int z) const { return rank_[(x * kLeaf + y) * kLeaf + z]; }

  const VoxelBatch& batch_;
  LeafImages& images_;
  std::array<std::int16_t, kVoxels> rank_;  // of a place in the leaf among the points; -1: none
  std::array<bool, kBlocks> filled_{};
  std::vector<std::size_t> others_;
};

bool Leaf::inside(int block) const {
  const auto [x, y, z] = blockOrigin(block);
  for (int i = 0; i < kBlock * kBlock * kBlock; ++i) {
    const std::int16_t rank = rankAt(x + i / 16, y + i / 4 % 4, z + i % 4);
    if (rank < 0 || !(batch_.signedDistance[rank] < 0)) return false;
  }
  return true;
}

std::size_t Leaf::interpolate(const TextureRoute& route) {
  std::array<bool, kBlocks> candidate;
  std::array<bool, kAllNodes> wanted{};
  std::vector<Vec3> points, places;
  for (int block = 0; block < kBlocks; ++block) {
    candidate[block] = inside(block);
    if (!candidate[block]) continue;
    const auto [x, y, z] = blockOrigin(block);
    for (int i = 0; i < 27; ++i) {
      wanted[nodeIndex(x / kSpacing + i / 9, y / kSpacing + i / 3 % 3, z / kSpacing + i % 3)] = true;
    }
    for (const auto& at : kChecks) points.push_back(position(Vec3(x + at[0], y + at[1], z + at[2])));
  }
  const std::size_t checks = points.size();
  if (checks == 0) return 0;
  for (int i = 0; i < kAllNodes; ++i) {
    if (!wanted[i]) continue;
    points.push_back(position(kSpacing * Vec3(i / (kNodes * kNodes), i / kNodes % kNodes, i % kNodes)));
  }
  places.resize(points.size());
  route.map(points, places);

  std::array<Vec3, kAllNodes> nodes;
  std::size_t next = checks;
  for (int i = 0; i < kAllNodes; ++i) {
    if (wanted[i]) nodes[i] = places[next++];
  }
  std::size_t count = 0, check = 0;
  for (int block = 0; block < kBlocks; ++block) {
    if (!candidate[block]) continue;
    const BlockNodes ofBlock(nodes, block);
    bool good = ofBlock.finite();
    const double allowed = kTolerance * ofBlock.covered();
    for (const auto& at : kChecks) {
      const auto& bases = voxelBases();
      const Vec3 guess = ofBlock.at(bases[at[0]], bases[at[1]], bases[at[2]]);
      good = good && (guess - places[check++]).norm() <= allowed;
    }
    if (!good) continue;
    fill(block, ofBlock);
    filled_[block] = true;
    ++count;
  }
  return count;
}

// Axis by axis: 27 nodes, nine of a plane x, three of a line x, y, one voxel.
void Leaf::fill(int block, const BlockNodes& nodes) {
  const auto [x0, y0, z0] = blockOrigin(block);
  for (int x = 0; x < kBlock; ++x) {
    const Basis& bx = voxelBases()[x];
    const std::array<Vec3, 9> plane = contract(bx.value, nodes.places),
                              planeByX = contract(bx.slope, nodes.places);
    for (int y = 0; y < kBlock; ++y) {
      const Basis& by = voxelBases()[y];
      const std::array<Vec3, 3> line = contract(by.value, plane), lineByX = contract(by.value, planeByX),
                                lineByY = contract(by.slope, plane);
      for (int z = 0; z < kBlock; ++z) {
        const Basis& bz = voxelBases()[z];
        const auto voxel = static_cast<std::size_t>(rankAt(x0 + x, y0 + y, z0 + z));
        images_.places[voxel] = contract(bz.value, line)[0];
        images_.footprints[voxel].col(0) = contract(bz.value, lineByX)[0];
        images_.footprints[voxel].col(1) = contract(bz.value, lineByY)[0];
        images_.footprints[voxel].col(2) = contract(bz.slope, line)[0];
      }
    }
  }
}

void Leaf::askOthers(const TextureRoute& route) {
  std::vector<Vec3> points, places;
  for (std::size_t i = 0; i < batch_.places.size(); ++i) {
    const int place = batch_.places[i];
    const int block = (place >> 8 << 2) | (place >> 5 & 1) << 1 | (place >> 2 & 1);
    if (filled_[block]) continue;
    others_.push_back(i);
    points.push_back(batch_.points[i]);
  }
  places.resize(points.size());
  route.map(points, places);
  for (std::size_t k = 0; k < others_.size(); ++k) images_.places[others_[k]] = places[k];
  for (const std::size_t i : others_) images_.footprints[i] = differences(i);
}

// Outside the solid, where places do not change along rays, these are what the eye sees there.
Mat3 Leaf::differences(std::size_t voxel) const {
  const int place = batch_.places[voxel];
  const std::array<int, 3> at{place >> 6, place >> 3 & 7, place & 7}, strides{64, 8, 1};
  Mat3 edges = Mat3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const auto image = [&](int step) -> const Vec3* {
      if (at[axis] + step < 0 || at[axis] + step >= kLeaf) return nullptr;
      const std::int16_t rank = rank_[place + step * strides[axis]];
      return rank >= 0 && images_.places[rank].allFinite() ? &images_.places[rank] : nullptr;
    };
    const Vec3 *before = image(-1), *here = image(0), *after = image(1);
    if (before && after) {
      edges.col(axis) = (*after - *before) / 2;
    } else if (here && (before || after)) {
      edges.col(axis) = after ? Vec3(*after - *here) : Vec3(*here - *before);
    }
  }
  return edges;
}

void Leaf::jacobiansOfOthers(const TextureRoute& route) {
  std::vector<Vec3> points;
  for (const std::size_t i : others_) points.push_back(batch_.points[i]);
  std::vector<Mat3> jacobians(points.size());
  route.jacobian(points, jacobians);
  for (std::size_t k = 0; k < others_.size(); ++k) images_.jacobians[others_[k]] = jacobians[k];
}

void Leaf::jacobiansOfInterpolated() {
  for (std::size_t i = 0; i < batch_.points.size(); ++i)
    images_.jacobians[i] = images_.footprints[i] / batch_.voxelSize;
}

}  // namespace

void LeafImager::locate(const VoxelBatch& batch, LeafImages& images) const {
  images.places.resize(batch.points.size());
  images.footprints.resize(batch.points.size());
  Leaf leaf(batch, images);
  interpolated_ += leaf.interpolate(route_);
  leaf.askOthers(route_);
  blocks_ += kBlocks;
  if (!jacobians_) return;
  images.jacobians.resize(batch.points.size());
  leaf.jacobiansOfInterpolated();
  leaf.jacobiansOfOthers(route_);
}

}  // namespace polestar::detail
