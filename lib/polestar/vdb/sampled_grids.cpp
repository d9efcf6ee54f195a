#include "polestar/vdb/sampled_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <sstream>
#include <type_traits>

#include <openvdb/openvdb.h>
#include <openvdb/tools/MultiResGrid.h>
#include <openvdb/tools/VolumeToMesh.h>
#include <Eigen/Eigenvalues>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/vdb/detail/grid_parts.h"
#include "polestar/vdb/detail/sampled_file.h"
#include "polestar/vdb/detail/vdb_archive.h"
#include "polestar/vdb/detail/vdb_file.h"

namespace polestar {
namespace {

using openvdb::Coord;

constexpr int kMostTaps = 16;    // of one sample
constexpr int kMostLevels = 10;  // of a pyramid: 1024 voxels become one

Vec3 toEigen(const openvdb::Vec3d& v) { return {v.x(), v.y(), v.z()}; }
openvdb::Vec3d toOpenVdb(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Vec3f asVector(float value) { return Vec3f::Constant(value); }
Vec3f asVector(const openvdb::Vec3s& value) { return {value.x(), value.y(), value.z()}; }
bool isFinite(float value) { return std::isfinite(value); }
bool isFinite(const openvdb::Vec3s& v) { return asVector(v).allFinite(); }

/// Value times weight, and weight.
struct Weighted {
  Vec3f value = Vec3f::Zero();
  float weight = 0;

  void add(const Weighted& other, float share) {
    value += share * other.value;
    weight += share * other.weight;
  }
};

/// The taps of a footprint, index space: their places relative to its middle, and how coarse they read.
struct Taps {
  std::array<Vec3, kMostTaps> offsets;
  int count = 1;
  double level = 0;  ///< of the pyramid, 0 the finest
};

/// Edges as columns, voxels. A uniform parallelepiped has the covariance F F^T / 12: the box with edges along
/// its eigenvectors that has the same one is laid out in taps as wide as its shortest edge.
Taps tapsOf(const Mat3& footprint) {
  Taps taps;
  taps.offsets[0] = Vec3::Zero();
  if (footprint.squaredNorm() <= 1) return taps;
  Eigen::SelfAdjointEigenSolver<Mat3> solver;
  solver.computeDirect(footprint * footprint.transpose());
  const Vec3 edges = solver.eigenvalues().cwiseMax(0).cwiseSqrt();  // ascending
  double width = std::max(1.0, edges[0]);
  const auto along = [&](int k) { return std::max(1, static_cast<int>(std::ceil(edges[k] / width - 0.01))); };
  while (along(1) * along(2) > kMostTaps) width *= 1.1;
  const int first = along(1), second = along(2);
  taps.count = first * second;
  taps.level = std::log2(width);
  for (int i = 0; i < first; ++i) {
    for (int j = 0; j < second; ++j) {
      taps.offsets[i * second + j] = ((i + 0.5) / first - 0.5) * edges[1] * solver.eigenvectors().col(1) +
                                     ((j + 0.5) / second - 0.5) * edges[2] * solver.eigenvectors().col(2);
    }
  }
  return taps;
}

/// The eight voxels around a point and their trilinear weights.
template <class Visit>
void visitCorners(const Vec3& index, Visit&& visit) {
  const Vec3 low(std::floor(index.x()), std::floor(index.y()), std::floor(index.z()));
  const Vec3 f = index - low;
  const Coord base(static_cast<int>(low.x()), static_cast<int>(low.y()), static_cast<int>(low.z()));
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner >> 2, y = corner >> 1 & 1, z = corner & 1;
    const double weight = (x ? f.x() : 1 - f.x()) * (y ? f.y() : 1 - f.y()) * (z ? f.z() : 1 - f.z());
    if (weight > 0) visit(base.offsetBy(x, y, z), static_cast<float>(weight));
  }
}

}  // namespace

struct SampledGrid::Data {
  openvdb::GridBase::ConstPtr grid;
  std::string name;
  ValueRole role = ValueRole::invariant;
  bool vector = false;

  explicit Data(const openvdb::GridBase::ConstPtr& from)
      : grid(from), name(from->getName()), role(detail::roleOf(*from)) {}
  virtual ~Data() = default;
  virtual NotFinite notFinite() const = 0;
  virtual void sample(std::span<const Vec3> world, std::span<const Mat3> footprints, std::span<Vec3f> values,
                      std::span<float> weights) const = 0;

  Vec3 toIndex(const Vec3& world) const { return toEigen(grid->transform().worldToIndex(toOpenVdb(world))); }
};

template <class Tree>
struct SampledGrid::DataOf final : Data {
  using Grid = openvdb::Grid<Tree>;
  using Accessor = openvdb::tree::ValueAccessor<const Tree, false>;  // not registered: the tree never changes
  using WeightAccessor = openvdb::tree::ValueAccessor<const openvdb::FloatTree, false>;

  typename Tree::ConstPtr tree;
  /// Levels 1 and up: values times weights, and weights, 0 where nothing is.
  struct Level {
    typename Tree::ConstPtr values;
    openvdb::FloatTree::ConstPtr weights;
  };
  mutable std::once_flag pyramidMade;
  mutable std::vector<Level> coarse;

  explicit DataOf(const typename Grid::ConstPtr& from) : Data(from), tree(from->treePtr()) {
    vector = std::is_same_v<Tree, openvdb::Vec3STree>;
  }

  /// Of leaves alone, and fast: files are clean nearly always.
  bool leavesAreFinite() const {
    using Leaf = typename Tree::LeafNodeType;
    std::vector<const Leaf*> leaves;
    tree->getNodes(leaves);
    return detail::reduceChunks(
        leaves.size(), 64, true,
        [&](std::size_t begin, std::size_t end) {
          bool finite = true;
          for (std::size_t l = begin; l < end; ++l) {
            const auto* values = leaves[l]->buffer().data();
            for (openvdb::Index i = 0; i < Leaf::SIZE; ++i)
              finite &= isFinite(values[i]) || !leaves[l]->isValueOn(i);
          }
          return finite;
        },
        [](bool a, bool b) { return a && b; });
  }

  NotFinite notFinite() const override {
    NotFinite found;
    if (leavesAreFinite()) {
      auto tile = tree->cbeginValueOn();
      tile.setMaxDepth(Tree::ValueOnCIter::LEAF_DEPTH - 1);
      while (tile && isFinite(*tile)) ++tile;
      if (!tile) return found;
    }
    for (auto on = tree->cbeginValueOn(); on; ++on) {
      if (isFinite(*on)) continue;
      if (found.count++ == 0)
        found.first = toEigen(grid->transform().indexToWorld(on.getBoundingBox().min()));
    }
    return found;
  }

  void makePyramid() const {
    const auto values = Grid::create(typename Tree::ValueType(0.0f));
    const auto weights = openvdb::FloatGrid::create(0);
    Tree& to = values->tree();
    to.topologyUnion(*tree);
    weights->tree().topologyUnion(*tree);
    openvdb::tree::ValueAccessor<Tree> write(to);
    for (auto on = tree->cbeginValueOn(); on; ++on) {
      if (on.isVoxelValue()) {
        write.setValueOnly(on.getCoord(), *on);
      } else {
        to.fill(on.getBoundingBox(), *on, true);
      }
    }
    for (auto on = weights->beginValueOn(); on; ++on) on.setValue(1);

    const Coord extent = grid->evalActiveVoxelDim();
    const int longest = std::max({extent.x(), extent.y(), extent.z(), 2});
    const auto levels = static_cast<std::size_t>(
        std::clamp(1 + static_cast<int>(std::ceil(std::log2(longest))), 2, kMostLevels));
    const openvdb::tools::MultiResGrid<Tree> valueLevels(levels, values);
    const openvdb::tools::MultiResGrid<openvdb::FloatTree> weightLevels(levels, weights);
    for (std::size_t level = 1; level < levels; ++level)
      coarse.push_back({valueLevels.constTreePtr(level), weightLevels.constTreePtr(level)});
  }

  /// Reads all levels; made once for a batch.
  struct Reader {
    const DataOf& data;
    Accessor finest;
    std::vector<std::pair<Accessor, WeightAccessor>> levels;

    explicit Reader(const DataOf& of) : data(of), finest(*of.tree) {}

    Weighted finestAt(const Vec3& index) {
      Weighted sum;
      visitCorners(index, [&](const Coord& at, float weight) {
        typename Tree::ValueType value;
        if (finest.probeValue(at, value)) sum.add({asVector(value), 1}, weight);
      });
      return sum;
    }

    Weighted coarseAt(std::size_t level, const Vec3& index) {
      auto& [values, weights] = levels[level - 1];
      Weighted sum;
      visitCorners(index / static_cast<double>(std::size_t{1} << level), [&](const Coord& at, float weight) {
        sum.add({asVector(values.getValue(at)), weights.getValue(at)}, weight);
      });
      return sum;
    }

    Weighted at(const Vec3& index, double level) {
      if (level <= 0) return finestAt(index);
      if (levels.empty()) {
        std::call_once(data.pyramidMade, [&] { data.makePyramid(); });
        for (const Level& coarse : data.coarse) levels.emplace_back(*coarse.values, *coarse.weights);
      }
      const double clamped = std::min(level, static_cast<double>(levels.size()));
      const auto lower = std::min(static_cast<std::size_t>(clamped), levels.size() - 1);
      const auto share = static_cast<float>(clamped - static_cast<double>(lower));
      Weighted sum;
      sum.add(lower == 0 ? finestAt(index) : coarseAt(lower, index), 1 - share);
      if (share > 0) sum.add(coarseAt(lower + 1, index), share);
      return sum;
    }
  };

  void sample(std::span<const Vec3> world, std::span<const Mat3> footprints, std::span<Vec3f> values,
              std::span<float> weights) const override {
    Reader reader(*this);
    for (std::size_t i = 0; i < world.size(); ++i) {
      Weighted sum;
      if (world[i].allFinite()) {
        const Vec3 index = toIndex(world[i]);
        Taps taps;
        taps.offsets[0] = Vec3::Zero();
        if (!footprints.empty() && footprints[i].allFinite()) {
          Mat3 edges;
          for (int k = 0; k < 3; ++k) edges.col(k) = toIndex(world[i] + footprints[i].col(k)) - index;
          taps = tapsOf(edges);
        }
        for (int t = 0; t < taps.count; ++t)
          sum.add(reader.at(index + taps.offsets[t], taps.level), 1 / static_cast<float>(taps.count));
      }
      values[i] = sum.weight > 0 ? Vec3f(sum.value / sum.weight) : Vec3f(Vec3f::Zero());
      weights[i] = std::clamp(sum.weight, 0.0f, 1.0f);
    }
  }
};

bool SampledGrid::isVector() const { return data_->vector; }
const std::string& SampledGrid::name() const { return data_->name; }
ValueRole SampledGrid::role() const { return data_->role; }
bool SampledGrid::isLevelSet() const { return data_->grid->getGridClass() == openvdb::GRID_LEVEL_SET; }
bool SampledGrid::isFog() const { return data_->grid->getGridClass() == openvdb::GRID_FOG_VOLUME; }
bool SampledGrid::savedAsHalf() const { return data_->grid->saveFloatAsHalf(); }
std::size_t SampledGrid::activeVoxels() const { return data_->grid->activeVoxelCount(); }
SampledGrid::NotFinite SampledGrid::notFinite() const { return data_->notFinite(); }

double SampledGrid::voxelSize() const {
  const openvdb::Vec3d size = data_->grid->voxelSize();
  return std::min({size.x(), size.y(), size.z()});
}

std::optional<Vec3> SampledGrid::voxelEdges() const {
  const openvdb::math::Transform& transform = data_->grid->transform();
  if (!transform.isLinear()) return std::nullopt;
  const openvdb::Vec3d first = transform.indexToWorld(Coord(0, 0, 0));
  Vec3 edges;
  for (int k = 0; k < 3; ++k) {
    Coord next(0, 0, 0);
    next[k] = 1;
    const Vec3 edge = toEigen(transform.indexToWorld(next) - first);
    edges[k] = edge[k];
    if (!(edge[k] > 0) || edge.norm() > edge[k] * (1 + 1e-9)) return std::nullopt;
  }
  return edges;
}

Box SampledGrid::activeBox() const {
  const openvdb::CoordBBox index = data_->grid->evalActiveVoxelBoundingBox();
  Box box;
  if (index.empty()) return box;
  for (int corner = 0; corner < 8; ++corner) {
    const Coord at(corner & 1 ? index.max().x() : index.min().x(),
                   corner & 2 ? index.max().y() : index.min().y(),
                   corner & 4 ? index.max().z() : index.min().z());
    const Vec3 world = toEigen(data_->grid->transform().indexToWorld(at));
    box.min = box.min.cwiseMin(world);
    box.max = box.max.cwiseMax(world);
  }
  return box;
}

void SampledGrid::sample(std::span<const Vec3> world, std::span<const Mat3> footprints,
                         std::span<Vec3f> values, std::span<float> weights) const {
  data_->sample(world, footprints, values, weights);
}

void detail::requireFinite(const SampledGrid& grid) {
  const SampledGrid::NotFinite bad = grid.notFinite();
  if (bad.count == 0) return;
  std::ostringstream message;
  message << "the grid " << grid.name() << " has " << bad.count
          << (bad.count == 1 ? " voxel that is no number, at " : " voxels that are no numbers, the first at ")
          << bad.first.transpose();
  throw Error(Errc::io, message.str());
}

namespace {

openvdb::GridCPtrVec constant(const openvdb::GridPtrVec& grids) { return {grids.begin(), grids.end()}; }

}  // namespace

SampledGrids::SampledGrids(const std::filesystem::path& path)
    : SampledGrids(std::make_shared<const File>(File{constant(detail::readVdb(path).grids)})) {}

SampledGrids::SampledGrids(std::shared_ptr<const File> file) : file_(std::move(file)) {
  for (const auto& grid : file_->grids) {
    using openvdb::gridConstPtrCast;
    if (const auto scalars = gridConstPtrCast<openvdb::FloatGrid>(grid)) {
      grids_.push_back(SampledGrid(std::make_shared<SampledGrid::DataOf<openvdb::FloatTree>>(scalars)));
    } else if (const auto vectors = gridConstPtrCast<openvdb::Vec3SGrid>(grid)) {
      grids_.push_back(SampledGrid(std::make_shared<SampledGrid::DataOf<openvdb::Vec3STree>>(vectors)));
    } else {
      leftOut_.push_back({grid->getName(), grid->type()});
    }
  }
}

const SampledGrid* SampledGrids::find(const std::string& name, bool vector) const {
  for (const SampledGrid& grid : grids_) {
    if (grid.name() == name && grid.isVector() == vector) return &grid;
  }
  return nullptr;
}

std::string SampledGrids::metadata(const std::string& key) const {
  auto grid = file_->named("surface");
  if (!grid && !file_->grids.empty()) grid = file_->grids.front();
  if (!grid) return "";
  const openvdb::Metadata::ConstPtr entry = (*grid)[key];
  return entry ? entry->str() : "";
}

const SampledGrid* SampledGrids::solidGrid() const {
  openvdb::GridBase::ConstPtr solid = detail::findLevelSet(file_->grids);
  if (!solid) solid = detail::findFog(file_->grids);
  const auto found = std::find_if(grids_.begin(), grids_.end(),
                                  [&](const SampledGrid& grid) { return grid.data_->grid == solid; });
  return found == grids_.end() ? nullptr : &*found;
}

namespace {

/// Of a grid in index space: OpenVDB's points are floats, which would lose a body far from the origin.
struct IndexSurface {
  std::vector<openvdb::Vec3s> points;
  std::vector<Triangle> triangles;

  IndexSurface(const openvdb::FloatGrid& grid, double level, double adaptivity) {
    std::vector<openvdb::Vec3I> cornersOfThree;
    std::vector<openvdb::Vec4I> quads;
    openvdb::tools::volumeToMesh(grid, points, cornersOfThree, quads, level, adaptivity);
    triangles.reserve(cornersOfThree.size() + 2 * quads.size());
    for (const openvdb::Vec3I& t : cornersOfThree) add(t[0], t[1], t[2]);
    for (const openvdb::Vec4I& q : quads) {
      // Along the shorter diagonal.
      const auto length = [&](int i, int j) { return (points[q[i]] - points[q[j]]).lengthSqr(); };
      if (length(0, 2) <= length(1, 3)) {
        add(q[0], q[1], q[2]);
        add(q[0], q[2], q[3]);
      } else {
        add(q[0], q[1], q[3]);
        add(q[1], q[2], q[3]);
      }
    }
  }

  void add(openvdb::Index32 a, openvdb::Index32 b, openvdb::Index32 c) {
    triangles.push_back(
        {static_cast<std::int32_t>(a), static_cast<std::int32_t>(b), static_cast<std::int32_t>(c)});
  }
};

}  // namespace

std::optional<TriMesh> SampledGrids::extractSurface(const SurfaceChoice& choice) const {
  const SampledGrid* solid = solidGrid();
  if (!solid) return std::nullopt;
  detail::requireFinite(*solid);
  const auto& grid = *solid->data_->grid;
  const bool levelSet = solid->data_->grid == detail::findLevelSet(file_->grids);
  IndexSurface surface(*openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid.copyGridReplacingTransform(
                           openvdb::math::Transform::createLinearTransform())),
                       choice.level.value_or(levelSet ? 0 : 0.5), choice.adaptivity);
  if (surface.triangles.empty()) return std::nullopt;
  TriMesh mesh;
  mesh.triangles = std::move(surface.triangles);
  mesh.vertices.resize(surface.points.size());
  detail::parallelChunks(mesh.vertices.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      mesh.vertices[i] = toEigen(grid.transform().indexToWorld(openvdb::Vec3d(surface.points[i])));
  });
  if (volumeProperties(mesh).volume < 0) {
    for (Triangle& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  return mesh;
}

struct SliceVolume::Impl {
  int width, height;
  bool hasAlpha;
  openvdb::math::Transform::Ptr transform;
  openvdb::Vec3SGrid::Ptr color = openvdb::Vec3SGrid::create();
  openvdb::FloatGrid::Ptr alpha = openvdb::FloatGrid::create();
  int slices = 0;
};

SliceVolume::SliceVolume(int width, int height, const Vec3& voxelSize, const Vec3& corner, bool hasAlpha)
    : impl_(std::make_unique<Impl>()) {
  detail::initializeOpenVdb();
  impl_->width = width;
  impl_->height = height;
  impl_->hasAlpha = hasAlpha;
  const Vec3 first = corner + 0.5 * voxelSize;
  impl_->transform = std::make_shared<openvdb::math::Transform>(
      std::make_shared<openvdb::math::ScaleTranslateMap>(toOpenVdb(voxelSize), toOpenVdb(first)));
}

SliceVolume::~SliceVolume() = default;

void SliceVolume::addSlice(std::span<const Pixel> pixels) {
  auto color = impl_->color->getAccessor();
  auto alpha = impl_->alpha->getAccessor();
  const int z = impl_->slices++;
  for (int row = 0; row < impl_->height; ++row) {
    for (int x = 0; x < impl_->width; ++x) {
      const Pixel& pixel = pixels[std::size_t{1} * row * impl_->width + x];
      if (!(pixel.alpha > 0)) continue;
      const Coord at(x, impl_->height - 1 - row, z);
      color.setValue(at, openvdb::Vec3s(pixel.color.data()));
      if (impl_->hasAlpha) alpha.setValue(at, pixel.alpha);
    }
  }
}

SampledGrids SliceVolume::finish() {
  openvdb::GridCPtrVec grids{impl_->color};
  impl_->color->setName("Cd");
  impl_->color->setTransform(impl_->transform);
  impl_->alpha->setTransform(impl_->transform);
  if (impl_->hasAlpha) {
    impl_->alpha->setName("density");
    impl_->alpha->setGridClass(openvdb::GRID_FOG_VOLUME);
    grids.push_back(impl_->alpha);
  }
  return SampledGrids(std::make_shared<const SampledGrids::File>(SampledGrids::File{std::move(grids)}));
}

}  // namespace polestar
