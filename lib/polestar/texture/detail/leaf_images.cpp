#include "polestar/texture/detail/leaf_images.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace polestar::detail {
namespace {

constexpr int kLeaf = VoxelBatch::kLeafSize, kBlock = 4, kBlocks = 8;
constexpr std::size_t kVoxels = std::size_t{1} * kLeaf * kLeaf * kLeaf;
constexpr int kSpacing = 2;                   // of the nodes, voxels
constexpr int kNodes = kLeaf / kSpacing + 1;  // along an axis of a leaf
constexpr int kAllNodes = kNodes * kNodes * kNodes;
constexpr double kTolerance = 0.1;  // of what a voxel covers
const Vec3 kNowhere = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

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

/// Counted from the first voxel of a leaf.
using Voxel = std::array<int, 3>;

Voxel voxelAt(std::uint16_t place) { return {place >> 6, place >> 3 & 7, place & 7}; }

/// A cube of voxels whose places are those of `rest`, taken onward.
class Brick {
 public:
  Brick(const SolidGrids& mapped, const TextureRoute& route, const std::array<int, 3>& lowest, int size)
      : size_(size) {
    const SolidGrids::Cube cube = mapped.readCube("rest", lowest, size);
    places_.resize(cube.values.size());
    inside_.resize(places_.size());
    for (std::size_t i = 0; i < places_.size(); ++i) {
      places_[i] = cube.active[i] ? Vec3(cube.values[i].cast<double>()) : kNowhere;
      inside_[i] = cube.active[i] && cube.signedDistance[i] < 0;
    }
    route.onward(places_, places_);
  }

  std::size_t index(const Voxel& v) const {
    return static_cast<std::size_t>((v[0] * size_ + v[1]) * size_ + v[2]);
  }
  const Vec3& place(std::size_t i) const { return places_[i]; }

  /// Of a voxel that is not at the rim, the images of its edges: half the way between its neighbours, or all
  /// the way to the one that there is. Columns without a neighbour are 0.
  Mat3 edges(std::size_t i) const {
    const auto isThere = [&](std::size_t k) { return places_[k].allFinite(); };
    Mat3 result = Mat3::Zero();
    if (!isThere(i)) return result;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t before = i - stride(axis), after = i + stride(axis);
      const std::size_t from = isThere(before) ? before : i, to = isThere(after) ? after : i;
      if (from != to)
        result.col(axis) = (places_[to] - places_[from]) / (from == before && to == after ? 2 : 1);
    }
    return result;
  }

  /// The same by voxels inside alone, exact for quadratic maps where there are two on a side; of a voxel two
  /// away from the rim. Nothing where they tell no derivative.
  std::optional<Mat3> edgesInside(std::size_t i) const {
    if (!inside_[i]) return std::nullopt;
    Mat3 result = Mat3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const auto along = [&](std::ptrdiff_t step) {
        return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(i) +
                                        step * static_cast<std::ptrdiff_t>(stride(axis)));
      };
      if (inside_[along(1)] && inside_[along(-1)]) {
        result.col(axis) = (places_[along(1)] - places_[along(-1)]) / 2;
        continue;
      }
      for (const std::ptrdiff_t side : {1, -1}) {
        if (!inside_[along(side)]) continue;
        const double sign = static_cast<double>(side);
        const Vec3 first = places_[along(side)] - places_[i];
        result.col(axis) = inside_[along(2 * side)]
                               ? Vec3(sign * (2 * first - (places_[along(2 * side)] - places_[i]) / 2))
                               : Vec3(sign * first);
      }
    }
    if (!(std::abs(result.determinant()) > 0)) return std::nullopt;
    return result;
  }

 private:
  std::size_t stride(int axis) const {
    return static_cast<std::size_t>(axis == 0 ? size_ * size_ : axis == 1 ? size_ : 1);
  }

  int size_;
  std::vector<Vec3> places_;
  std::vector<char> inside_;
};

/// One leaf on its way.
class Leaf {
 public:
  Leaf(const VoxelBatch& batch, const TextureRoute& route, const SolidGrids* mapped, LeafImages& images)
      : batch_(batch), route_(route), mapped_(mapped), images_(images) {
    rank_.fill(-1);
    for (std::size_t i = 0; i < batch.places.size(); ++i)
      rank_[batch.places[i]] = static_cast<std::int16_t>(i);
  }

  /// By `rest` alone, where the way ends in the ball.
  void read(bool jacobians);

  /// How many blocks were filled.
  std::size_t interpolate();
  void askOthers();
  void jacobiansOfOthers();
  void jacobiansOfInterpolated();

 private:
  bool inside(int block) const;
  Vec3 position(const Voxel& v) const { return batch_.corner + batch_.voxelSize * Vec3(v[0], v[1], v[2]); }
  std::array<int, 3> index(const Voxel& v, int offset) const {
    return {batch_.first[0] + v[0] + offset, batch_.first[1] + v[1] + offset,
            batch_.first[2] + v[2] + offset};
  }
  void ask(std::span<const Voxel> voxels, std::span<Vec3> places) const;
  std::optional<Mat3> jacobianBelow(std::size_t outside) const;
  void fill(int block, const BlockNodes& nodes);
  Mat3 differences(std::size_t voxel) const;
  std::int16_t rankAt(int x, int y, int z) const { return rank_[(x * kLeaf + y) * kLeaf + z]; }

  const VoxelBatch& batch_;
  const TextureRoute& route_;
  const SolidGrids* mapped_;
  LeafImages& images_;
  std::array<std::int16_t, kVoxels> rank_;  // of a place in the leaf among the points; -1: none
  std::array<bool, kBlocks> filled_{};
  std::vector<std::size_t> others_;
};

/// Places of voxels, those of the next leaves towards +x, +y and +z included.
void Leaf::ask(std::span<const Voxel> voxels, std::span<Vec3> places) const {
  if (voxels.empty()) return;
  std::vector<Vec3> points(voxels.size());
  if (!mapped_) {
    std::transform(voxels.begin(), voxels.end(), points.begin(), [&](const Voxel& v) { return position(v); });
    return route_.map(points, places);
  }
  const SolidGrids::Cube rest = mapped_->readCube("rest", batch_.first, kLeaf + 1);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    const auto [x, y, z] = voxels[i];
    const auto at = static_cast<std::size_t>((x * rest.size + y) * rest.size + z);
    points[i] = rest.active[at] ? Vec3(rest.values[at].cast<double>()) : kNowhere;
  }
  route_.onward(points, places);
}

void Leaf::read(bool jacobians) {
  const int rim = jacobians ? 2 : 1;
  const Brick brick(*mapped_, route_, index({0, 0, 0}, -rim), kLeaf + 2 * rim);
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < batch_.places.size(); ++i) {
    const auto [x, y, z] = voxelAt(batch_.places[i]);
    const std::size_t at = brick.index({x + rim, y + rim, z + rim});
    images_.places[i] = brick.place(at);
    images_.footprints[i] = brick.edges(at);
    if (!jacobians) continue;
    const std::optional<Mat3> edges = brick.edgesInside(at);
    images_.jacobians[i] = edges ? Mat3(*edges / batch_.voxelSize) : Mat3(Mat3::Zero());
    if (!edges) open.push_back(i);
  }
  // Beyond the surface places change along rays no more: the derivative there is that below.
  std::vector<Mat3> below(open.size());
  for (std::size_t k = 0; k < open.size(); ++k) {
    const std::optional<Mat3> found = jacobianBelow(open[k]);
    below[k] = found ? *found : Mat3(Mat3::Zero());
    if (!found) others_.push_back(open[k]);
  }
  for (std::size_t k = 0; k < open.size(); ++k) images_.jacobians[open[k]] = below[k];
}

/// That of the first voxel on the way to the center that has one.
std::optional<Mat3> Leaf::jacobianBelow(std::size_t outside) const {
  constexpr int kSteps = 8;
  const Vec3 center = route_.target().chart().green().shape().frame().origin;
  const auto [x, y, z] = voxelAt(batch_.places[outside]);
  const Vec3 from(x, y, z);
  const Vec3 step = ((center - batch_.corner) / batch_.voxelSize - from).normalized();
  const int first = std::max(1, static_cast<int>(batch_.signedDistance[outside] / batch_.voxelSize));
  for (int k = first; k < first + kSteps; ++k) {
    const Vec3 at = from + k * step;
    const Voxel voxel{static_cast<int>(std::lround(at.x())), static_cast<int>(std::lround(at.y())),
                      static_cast<int>(std::lround(at.z()))};
    if (std::all_of(voxel.begin(), voxel.end(), [](int v) { return v >= 0 && v < kLeaf; })) {
      const std::int16_t rank = rankAt(voxel[0], voxel[1], voxel[2]);
      if (rank >= 0 && !images_.jacobians[rank].isZero(0)) return images_.jacobians[rank];
      continue;
    }
    const Brick brick(*mapped_, route_, index(voxel, -2), 5);
    if (const auto edges = brick.edgesInside(brick.index({2, 2, 2}))) return *edges / batch_.voxelSize;
  }
  return std::nullopt;
}

bool Leaf::inside(int block) const {
  const auto [x, y, z] = blockOrigin(block);
  for (int i = 0; i < kBlock * kBlock * kBlock; ++i) {
    const std::int16_t rank = rankAt(x + i / 16, y + i / 4 % 4, z + i % 4);
    if (rank < 0 || !(batch_.signedDistance[rank] < 0)) return false;
  }
  return true;
}

std::size_t Leaf::interpolate() {
  std::array<bool, kBlocks> candidate;
  std::array<bool, kAllNodes> wanted{};
  std::vector<Voxel> voxels;
  for (int block = 0; block < kBlocks; ++block) {
    candidate[block] = inside(block);
    if (!candidate[block]) continue;
    const auto [x, y, z] = blockOrigin(block);
    for (int i = 0; i < 27; ++i) {
      wanted[nodeIndex(x / kSpacing + i / 9, y / kSpacing + i / 3 % 3, z / kSpacing + i % 3)] = true;
    }
    for (const auto& at : kChecks) voxels.push_back({x + at[0], y + at[1], z + at[2]});
  }
  const std::size_t checks = voxels.size();
  if (checks == 0) return 0;
  for (int i = 0; i < kAllNodes; ++i) {
    if (!wanted[i]) continue;
    voxels.push_back(
        {kSpacing * (i / (kNodes * kNodes)), kSpacing * (i / kNodes % kNodes), kSpacing * (i % kNodes)});
  }
  std::vector<Vec3> places(voxels.size());
  ask(voxels, places);

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

void Leaf::askOthers() {
  std::vector<Voxel> voxels;
  for (std::size_t i = 0; i < batch_.places.size(); ++i) {
    const int place = batch_.places[i];
    const int block = (place >> 8 << 2) | (place >> 5 & 1) << 1 | (place >> 2 & 1);
    if (filled_[block]) continue;
    others_.push_back(i);
    voxels.push_back(voxelAt(batch_.places[i]));
  }
  std::vector<Vec3> places(voxels.size());
  ask(voxels, places);
  for (std::size_t k = 0; k < others_.size(); ++k) images_.places[others_[k]] = places[k];
  for (const std::size_t i : others_) images_.footprints[i] = differences(i);
}

// Outside the solid, where places do not change along rays, these are what the eye sees there.
Mat3 Leaf::differences(std::size_t voxel) const {
  const int place = batch_.places[voxel];
  const Voxel at = voxelAt(batch_.places[voxel]);
  const std::array<int, 3> strides{64, 8, 1};
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

void Leaf::jacobiansOfOthers() {
  std::vector<Vec3> points;
  for (const std::size_t i : others_) points.push_back(batch_.points[i]);
  std::vector<Mat3> jacobians(points.size());
  route_.jacobian(points, jacobians);
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
  if (jacobians_) images.jacobians.resize(batch.points.size());
  Leaf leaf(batch, route_, mapped_, images);
  if (mapped_ && !route_.source()) {
    leaf.read(jacobians_);
  } else {
    interpolated_ += leaf.interpolate();
    leaf.askOthers();
    blocks_ += kBlocks;
    if (jacobians_) leaf.jacobiansOfInterpolated();
  }
  if (jacobians_) leaf.jacobiansOfOthers();
}

}  // namespace polestar::detail
