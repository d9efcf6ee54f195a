#include "polestar/vdb/solid_grids.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <variant>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/vdb/detail/grid_parts.h"
#include "polestar/vdb/detail/mesh_to_level_set.h"
#include "polestar/vdb/detail/sampled_file.h"
#include "polestar/vdb/detail/solid_parts.h"
#include "polestar/vdb/detail/vdb_archive.h"
#include "polestar/vdb/detail/vdb_file.h"

namespace polestar {
namespace {

constexpr int kLeafSize = 8;
constexpr int kLeafVoxels = kLeafSize * kLeafSize * kLeafSize;
constexpr double kLargestIndex = 1 << 28;  // well inside int32, bands and neighbours included

// Rough bytes of a file's grids, of their peak: `rest`, `green` and one more scalar in leaves over the inside
// and padding; the band of `surface` and `density`; the columns of the side test and the tree over the
// triangles.
double estimateBytes(double volume, double area, const Vec3& extent, const GridOptions& options,
                     double voxelSize) {
  const double shell = area / (voxelSize * voxelSize), leafRim = 4;
  const double attributeVoxels = volume / std::pow(voxelSize, 3) + shell * (options.padding + leafRim);
  const double bandVoxels = shell * 2 * (options.halfWidth + leafRim);
  const double columns = extent.x() * extent.y() / (voxelSize * voxelSize);
  return 20 * attributeVoxels + 20 * bandVoxels + 24 * columns;
}

openvdb::Vec3s toOpenVdbValue(const Vec3f& value) { return openvdb::Vec3s(value.data()); }
float toOpenVdbValue(float value) { return value; }

// Mask of the voxels with surface < bound, leaves only.
openvdb::MaskTree::Ptr voxelsBelow(const openvdb::FloatTree& surface, float bound) {
  auto mask = std::make_shared<openvdb::MaskTree>();
  auto tile = surface.cbeginValueAll();
  for (tile.setMaxDepth(openvdb::FloatTree::ValueAllCIter::LEAF_DEPTH - 1); tile; ++tile) {
    if (*tile < bound) mask->denseFill(tile.getBoundingBox(), true);
  }
  for (auto leaf = surface.cbeginLeaf(); leaf; ++leaf) {
    const float* values = leaf->buffer().data();
    if (std::none_of(values, values + kLeafVoxels, [&](float value) { return value < bound; })) continue;
    auto* target = mask->touchLeaf(leaf->origin());
    for (openvdb::Index i = 0; i < kLeafVoxels; ++i) {
      if (values[i] < bound) target->setValueOn(i);
    }
  }
  return mask;
}

}  // namespace

void detail::checkSolidSize(const TriMesh& surface, const GridOptions& options) {
  const Vec3 extent = boundingBox(surface).extent();
  const double longest = extent.maxCoeff();
  const double dim = longest / options.voxelSize;
  std::ostringstream message;
  message.precision(6);
  if (!(dim > 4 * (1 - 1e-9))) {
    message << "voxels of " << options.voxelSize << " leave fewer than 4 along a solid of length " << longest
            << ": choose smaller voxels";
    throw Error(Errc::usage, message.str());
  }
  const double volume = std::abs(volumeProperties(surface).volume), area = surfaceArea(surface);
  const double limit =
      options.memoryLimit > 0 ? static_cast<double>(options.memoryLimit) : 0.75 * detail::machineMemory();
  const auto fits = [&](double d) {
    return d < kLargestIndex && estimateBytes(volume, area, extent, options, longest / d) <= limit;
  };
  if (fits(dim)) return;
  double low = 0, high = dim;
  while (high - low > 0.5) {
    const double middle = 0.5 * (low + high);
    (fits(middle) ? low : high) = middle;
  }
  message << dim << " voxels along the longest side would take about "
          << estimateBytes(volume, area, extent, options, options.voxelSize) / 1e9 << " GB of the "
          << limit / 1e9 << " GB allowed: " << static_cast<int>(low) << " would fit";
  throw Error(Errc::usage, message.str());
}

openvdb::FloatTree::Ptr detail::fogOf(const openvdb::FloatTree& levelSet, double voxelSize) {
  const auto slope = static_cast<float>(0.5 / voxelSize);
  const auto ramp = [slope](float distance) { return std::clamp(0.5f - slope * distance, 0.f, 1.f); };
  auto fog = std::make_shared<openvdb::FloatTree>(levelSet);
  auto tile = fog->beginValueAll();
  for (tile.setMaxDepth(openvdb::FloatTree::ValueAllIter::LEAF_DEPTH - 1); tile; ++tile) {
    tile.setValue(ramp(*tile));
    tile.setActiveState(*tile > 0);
  }
  std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
  fog->getNodes(leaves);
  detail::parallelChunks(leaves.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      float* values = leaves[l]->buffer().data();
      std::transform(values, values + kLeafVoxels, values, ramp);
      for (openvdb::Index i = 0; i < kLeafVoxels; ++i) leaves[l]->setActiveState(i, values[i] > 0);
    }
  });
  fog->root().setBackground(0, /*updateChildNodes=*/false);
  openvdb::tools::prune(*fog);
  return fog;
}

void detail::label(openvdb::GridBase& grid, const std::string& name,
                   const openvdb::math::Transform::Ptr& transform, openvdb::GridClass kind) {
  grid.setName(name);
  grid.setTransform(transform);
  grid.setGridClass(kind);
  grid.setCreator(std::string("polestar ") + kVersion);
  grid.setSaveFloatAsHalf(false);
}

void GridOptions::validate() const {
  if (!(voxelSize > 1e-30 && voxelSize < 1e30)) {
    throw Error(Errc::usage,
                "the voxel size must be a positive number of mesh units, between 1e-30 and 1e30");
  }
  if (padding < 0 || padding > 64) throw Error(Errc::usage, "the padding must be 0 to 64 voxels");
  if (halfWidth < 2 || halfWidth > 64)
    throw Error(Errc::usage, "the half-width of the band must be 2 to 64 voxels");
}

double voxelSizeFor(const TriMesh& mesh, int dim) {
  if (dim < 4)
    throw Error(Errc::usage,
                "a grid needs at least 4 voxels along the longest side, not " + std::to_string(dim));
  const double longest = boundingBox(mesh).extent().maxCoeff();
  if (!(longest > 0)) throw Error(Errc::usage, "the mesh has no extent");
  return longest / dim;
}

namespace {

/// The voxels of one leaf, as a sampler gets them.
struct LeafPoints {
  std::array<Vec3, kLeafVoxels> points;
  std::array<float, kLeafVoxels> distances;
  std::array<std::uint16_t, kLeafVoxels> places;
  std::size_t count = 0;
  VoxelBatch batch;
};

}  // namespace

struct SolidGrids::Impl {
  GridOptions options;
  Vec3 origin;  // of voxel (0, 0, 0)'s center
  openvdb::math::Transform::Ptr transform;
  openvdb::FloatGrid::Ptr surface;
  openvdb::MaskTree::Ptr inside, padded;
  std::size_t insideCount = 0, paddedCount = 0;
  std::vector<openvdb::GridBase::Ptr> grids;  // in the order of the file, `surface` first
  std::map<std::string, Metadata> metadata;

  Vec3 toWorld(const Vec3& index) const { return origin + options.voxelSize * index; }
  void findVoxels();
  void gather(const openvdb::MaskTree::LeafNodeType& voxels, LeafPoints& leaf) const;

  void checkNewName(const std::string& name) const {
    if (name.empty() || name.find_first_of(" \t\n") != std::string::npos) {
      throw Error(Errc::usage,
                  "'" + name + "' cannot name a grid: other programs need a name without spaces");
    }
    for (const auto& grid : grids) {
      if (grid->getName() == name) throw Error(Errc::usage, "there is a grid '" + name + "' already");
    }
  }

  openvdb::Vec3SGrid& vectorsOf(const std::string& name) const {
    for (const auto& grid : grids) {
      if (grid->getName() != name) continue;
      if (const auto vectors = openvdb::gridPtrCast<openvdb::Vec3SGrid>(grid)) return *vectors;
    }
    throw Error(Errc::usage, "there is no vector grid '" + name + "'");
  }
};

void SolidGrids::Impl::findVoxels() {
  const float reach = static_cast<float>(options.padding) * static_cast<float>(options.voxelSize);
  inside = voxelsBelow(surface->constTree(), 0);
  padded = voxelsBelow(surface->constTree(), reach);
  insideCount = inside->activeVoxelCount();
  paddedCount = padded->activeVoxelCount();
}

void SolidGrids::Impl::gather(const openvdb::MaskTree::LeafNodeType& voxels, LeafPoints& leaf) const {
  const auto* band = surface->constTree().probeConstLeaf(voxels.origin());
  const float tile = band ? 0 : surface->constTree().getValue(voxels.origin());
  for (auto voxel = voxels.cbeginValueOn(); voxel; ++voxel, ++leaf.count) {
    const openvdb::Coord at = voxel.getCoord();
    leaf.points[leaf.count] = toWorld(Vec3(at.x(), at.y(), at.z()));
    leaf.distances[leaf.count] = band ? band->getValue(voxel.pos()) : tile;
    leaf.places[leaf.count] = static_cast<std::uint16_t>(voxel.pos());
  }
  const openvdb::Coord first = voxels.origin();
  leaf.batch.corner = toWorld(Vec3(first.x(), first.y(), first.z()));
  leaf.batch.first = {first.x(), first.y(), first.z()};
  leaf.batch.voxelSize = options.voxelSize;
  leaf.batch.places = {leaf.places.data(), leaf.count};
  leaf.batch.points = {leaf.points.data(), leaf.count};
  leaf.batch.signedDistance = {leaf.distances.data(), leaf.count};
}

SolidGrids::SolidGrids(const TriMesh& mesh, const GridOptions& options, Context& context)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  detail::checkSolidSize(mesh, options);
  detail::initializeOpenVdb();
  context.progress("voxelizing", 0);
  const double h = options.voxelSize;
  impl_->options = options;
  impl_->options.halfWidth = std::max(options.halfWidth, options.padding);
  impl_->origin = detail::solidOrigin(mesh, h);
  impl_->transform = detail::makeUniformTransform(h, impl_->origin);
  if (h * h * h < 3e-15) {
    context.log(LogLevel::warning,
                "voxels below 1.45e-5 mesh units: the file is right, but Blender aborts on it, as does what "
                "else turns "
                "transforms into matrices with OpenVDB; scale the model up for those");
  }

  TriMesh inIndexSpace = mesh;
  for (Vec3& vertex : inIndexSpace.vertices) vertex = (vertex - impl_->origin) / h;
  const auto surface = detail::meshToLevelSet(inIndexSpace, impl_->options.halfWidth, h, context);
  impl_->surface =
      detail::makeGrid<openvdb::FloatTree>("surface", surface, impl_->transform, openvdb::GRID_LEVEL_SET);
  const auto density = detail::makeGrid<openvdb::FloatTree>("density", detail::fogOf(*surface, h),
                                                            impl_->transform, openvdb::GRID_FOG_VOLUME);
  impl_->grids = {impl_->surface, density};

  impl_->findVoxels();
  context.progress("voxelizing", 1);
}

SolidGrids::SolidGrids(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

std::optional<SolidGrids> SolidGrids::read(const std::filesystem::path& path) {
  using openvdb::gridPtrCast;
  std::map<std::string, openvdb::GridBase::Ptr> named;
  const auto file = detail::readVdb(path);
  for (const auto& grid : file.grids) named.emplace(grid->getName(), grid);
  const auto find = [&](const char* name) { return named.contains(name) ? named[name] : nullptr; };
  const auto surface = gridPtrCast<openvdb::FloatGrid>(find("surface")),
             density = gridPtrCast<openvdb::FloatGrid>(find("density"));
  const auto rest = gridPtrCast<openvdb::Vec3SGrid>(find("rest"));
  if (!surface || !density || !rest) return std::nullopt;

  auto impl = std::make_unique<Impl>();
  const openvdb::math::Transform& transform = surface->transform();
  const double h = transform.voxelSize()[0];
  impl->options.voxelSize = h;
  impl->options.halfWidth = static_cast<int>(std::lround(surface->background() / h));
  impl->origin = Vec3(transform.indexToWorld(openvdb::Vec3d(0)).asPointer());
  impl->transform = detail::makeUniformTransform(h, impl->origin);
  for (const openvdb::GridBase::Ptr& grid : {find("surface"), find("density"), find("rest")}) {
    if (grid->saveFloatAsHalf() || grid->transform() != *impl->transform) return std::nullopt;
  }
  impl->surface = detail::makeGrid<openvdb::FloatTree>("surface", surface->treePtr(), impl->transform,
                                                       openvdb::GRID_LEVEL_SET);
  impl->findVoxels();
  if (rest->activeVoxelCount() != impl->paddedCount || impl->insideCount == 0) return std::nullopt;
  const auto ball =
      detail::makeGrid<openvdb::Vec3STree>("rest", rest->treePtr(), impl->transform, openvdb::GRID_UNKNOWN);
  detail::setRole(*ball, ValueRole::invariant);
  impl->grids = {impl->surface,
                 detail::makeGrid<openvdb::FloatTree>("density", density->treePtr(), impl->transform,
                                                      openvdb::GRID_FOG_VOLUME),
                 ball};
  return SolidGrids(std::move(impl));
}

SolidGrids SolidGrids::sharing(const std::vector<std::string>& attributes) const {
  auto impl = std::make_unique<Impl>(*impl_);
  impl->metadata.clear();
  impl->grids.resize(2);
  for (const std::string& name : attributes) {
    const auto found = std::find_if(impl_->grids.begin() + 2, impl_->grids.end(),
                                    [&](const auto& grid) { return grid->getName() == name; });
    if (found == impl_->grids.end()) throw Error(Errc::usage, "there is no grid '" + name + "'");
    impl->grids.push_back(*found);
  }
  return SolidGrids(std::move(impl));
}

SolidGrids::~SolidGrids() = default;
SolidGrids::SolidGrids(SolidGrids&&) noexcept = default;
SolidGrids& SolidGrids::operator=(SolidGrids&&) noexcept = default;

double SolidGrids::voxelSize() const { return impl_->options.voxelSize; }
std::size_t SolidGrids::insideVoxels() const { return impl_->insideCount; }
std::size_t SolidGrids::activeVoxels() const { return impl_->paddedCount; }
SampledGrids SolidGrids::lookUp() const {
  return SampledGrids(std::make_shared<const SampledGrids::File>(
      SampledGrids::File{{impl_->grids.begin(), impl_->grids.end()}}));
}

Vec3 SolidGrids::indexToWorld(const Vec3& index) const { return impl_->toWorld(index); }

namespace {

/// A tree that is being filled, leaf by leaf.
template <class Tree>
struct Filling {
  typename Tree::Ptr tree;
  std::vector<typename Tree::LeafNodeType*> leaves;

  explicit Filling(const openvdb::MaskTree& voxels)
      : tree(std::make_shared<Tree>(voxels, openvdb::zeroVal<typename Tree::ValueType>(),
                                    openvdb::TopologyCopy())) {
    // The same voxels make the same leaves in the same order.
    tree->getNodes(leaves);
  }

  template <class Value>
  void store(std::size_t leaf, std::span<const std::uint16_t> places, std::span<const Value> values,
             std::span<const std::uint8_t> active) {
    auto& target = *leaves[leaf];
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (active[i]) {
        target.setValueOnly(places[i], toOpenVdbValue(values[i]));
      } else {
        target.setValueOff(places[i]);
      }
    }
  }

  openvdb::GridBase::Ptr finish(const Attribute& attribute,
                                const openvdb::math::Transform::Ptr& transform) const {
    openvdb::tools::pruneInactive(*tree);
    const auto grid = detail::makeGrid<Tree>(attribute.name, tree, transform, openvdb::GRID_UNKNOWN);
    if (attribute.vector) detail::setRole(*grid, attribute.role);
    grid->setSaveFloatAsHalf(attribute.half);
    return grid;
  }
};

using VectorFilling = Filling<openvdb::Vec3STree>;
using ScalarFilling = Filling<openvdb::FloatTree>;

/// Room for one leaf's values of all attributes.
class LeafValues final : public AttributeValues {
 public:
  LeafValues(std::span<const Attribute> attributes, std::size_t points) : points_(points) {
    for (const Attribute& attribute : attributes) {
      first_.push_back((attribute.vector ? vectors_.size() : scalars_.size()));
      if (attribute.vector) {
        vectors_.resize(vectors_.size() + points, Vec3f::Zero());
      } else {
        scalars_.resize(scalars_.size() + points, 0);
      }
    }
    active_.resize(attributes.size() * points, 1);
  }

  std::span<float> scalars(std::size_t a) override { return std::span(scalars_).subspan(first_[a], points_); }
  std::span<Vec3f> vectors(std::size_t a) override { return std::span(vectors_).subspan(first_[a], points_); }
  std::span<std::uint8_t> active(std::size_t a) override {
    return std::span(active_).subspan(a * points_, points_);
  }

 private:
  std::size_t points_;
  std::vector<std::size_t> first_;
  std::vector<float> scalars_;
  std::vector<Vec3f> vectors_;
  std::vector<std::uint8_t> active_;
};

}  // namespace

void SolidGrids::add(std::span<const Attribute> attributes,
                     const std::function<void(const VoxelBatch&, AttributeValues&)>& sample, bool padded,
                     Context& context) {
  std::string stage = "sampling";
  for (std::size_t a = 0; a < attributes.size(); ++a) {
    impl_->checkNewName(attributes[a].name);
    stage += (a == 0 ? " " : a + 1 < attributes.size() ? ", " : " and ") + attributes[a].name;
  }
  const openvdb::MaskTree& voxels = padded ? *impl_->padded : *impl_->inside;
  std::vector<std::variant<ScalarFilling, VectorFilling>> fillings;
  for (const Attribute& attribute : attributes) {
    if (attribute.vector) {
      fillings.emplace_back(std::in_place_type<VectorFilling>, voxels);
    } else {
      fillings.emplace_back(std::in_place_type<ScalarFilling>, voxels);
    }
  }
  std::vector<const openvdb::MaskTree::LeafNodeType*> leaves;
  voxels.getNodes(leaves);

  const auto fill = [&](std::size_t l) {
    LeafPoints leaf;
    impl_->gather(*leaves[l], leaf);
    LeafValues values(attributes, leaf.count);
    sample(leaf.batch, values);
    for (std::size_t a = 0; a < attributes.size(); ++a) {
      if (auto* vectors = std::get_if<VectorFilling>(&fillings[a])) {
        vectors->store<Vec3f>(l, leaf.batch.places, values.vectors(a), values.active(a));
      } else {
        std::get<ScalarFilling>(fillings[a])
            .store<float>(l, leaf.batch.places, values.scalars(a), values.active(a));
      }
    }
  };
  // In portions, since progress is for the thread that drives the loop to report.
  const std::size_t portion = std::max<std::size_t>(leaves.size() / 100, 16);
  for (std::size_t done = 0; done < leaves.size(); done += portion) {
    context.progress(stage, static_cast<double>(done) / static_cast<double>(leaves.size()));
    const std::size_t end = std::min(leaves.size(), done + portion);
    detail::parallelChunks(end - done, 1, context, [&](std::size_t l, std::size_t) { fill(done + l); });
  }
  context.progress(stage, 1);
  for (std::size_t a = 0; a < attributes.size(); ++a) {
    impl_->grids.push_back(std::visit(
        [&](const auto& filling) { return filling.finish(attributes[a], impl_->transform); }, fillings[a]));
  }
}

void SolidGrids::addVector(const std::string& name, ValueRole role,
                           const std::function<void(const VoxelBatch&, std::span<Vec3f>)>& sample,
                           bool padded, Context& context) {
  const Attribute attribute{.name = name, .vector = true, .role = role};
  add(
      {&attribute, 1},
      [&](const VoxelBatch& batch, AttributeValues& values) { sample(batch, values.vectors(0)); }, padded,
      context);
}

void SolidGrids::addScalar(const std::string& name,
                           const std::function<void(const VoxelBatch&, std::span<float>)>& sample,
                           bool padded, Context& context) {
  const Attribute attribute{.name = name};
  add(
      {&attribute, 1},
      [&](const VoxelBatch& batch, AttributeValues& values) { sample(batch, values.scalars(0)); }, padded,
      context);
}

void SolidGrids::setMetadata(const std::string& key, const Metadata& value) { impl_->metadata[key] = value; }

void SolidGrids::visitBricks(const std::string& vectorGrid,
                             const std::function<void(std::size_t, const Brick&)>& visit) const {
  constexpr int count = Brick::kSize * Brick::kSize * Brick::kSize;
  const openvdb::Vec3STree& vectors = impl_->vectorsOf(vectorGrid).constTree();
  const openvdb::FloatTree& surface = impl_->surface->constTree();
  std::vector<const openvdb::Vec3STree::LeafNodeType*> leaves;
  vectors.getNodes(leaves);
  detail::parallelChunks(leaves.size(), 1, [&](std::size_t leafIndex, std::size_t) {
    std::array<Vec3f, count> values;
    std::array<float, count> distances;
    std::array<std::uint8_t, count> active;
    const openvdb::Coord origin = leaves[leafIndex]->origin();
    openvdb::tree::ValueAccessor<const openvdb::Vec3STree> vectorAt(vectors);
    openvdb::tree::ValueAccessor<const openvdb::FloatTree> distanceAt(surface);
    int i = 0;
    for (int x = 0; x < Brick::kSize; ++x) {
      for (int y = 0; y < Brick::kSize; ++y) {
        for (int z = 0; z < Brick::kSize; ++z, ++i) {
          const openvdb::Coord at = origin.offsetBy(x, y, z);
          openvdb::Vec3s value;
          active[i] = vectorAt.probeValue(at, value);
          values[i] = Vec3f(value.x(), value.y(), value.z());
          distances[i] = distanceAt.getValue(at);
        }
      }
    }
    visit(leafIndex, {{origin.x(), origin.y(), origin.z()}, values, distances, active});
  });
}

SolidGrids::Cube SolidGrids::readCube(const std::string& vectorGrid, const std::array<int, 3>& lowest,
                                      int size) const {
  const openvdb::Vec3STree& vectors = impl_->vectorsOf(vectorGrid).constTree();
  openvdb::tree::ValueAccessor<const openvdb::Vec3STree> vectorAt(vectors);
  openvdb::tree::ValueAccessor<const openvdb::FloatTree> distanceAt(impl_->surface->constTree());
  Cube cube;
  cube.lowest = lowest;
  cube.size = size;
  const auto samples = static_cast<std::size_t>(size) * size * size;
  cube.values.reserve(samples);
  cube.signedDistance.reserve(samples);
  cube.active.reserve(samples);
  for (int x = 0; x < size; ++x) {
    for (int y = 0; y < size; ++y) {
      for (int z = 0; z < size; ++z) {
        const openvdb::Coord at(lowest[0] + x, lowest[1] + y, lowest[2] + z);
        openvdb::Vec3s value;
        cube.active.push_back(vectorAt.probeValue(at, value));
        cube.values.emplace_back(value.x(), value.y(), value.z());
        cube.signedDistance.push_back(distanceAt.getValue(at));
      }
    }
  }
  return cube;
}

void SolidGrids::replace(const std::string& vectorGrid, const Cube& cube,
                         std::span<const std::size_t> samples) {
  openvdb::tree::ValueAccessor<openvdb::Vec3STree> at(impl_->vectorsOf(vectorGrid).tree());
  const auto size = static_cast<std::size_t>(cube.size);
  for (const std::size_t i : samples) {
    const openvdb::Coord place(cube.lowest[0] + static_cast<int>(i / (size * size)),
                               cube.lowest[1] + static_cast<int>(i / size % size),
                               cube.lowest[2] + static_cast<int>(i % size));
    const Vec3f& value = cube.values[i];
    at.setValueOnly(place, openvdb::Vec3s(value[0], value[1], value[2]));
  }
}

std::size_t SolidGrids::leafCount(const std::string& vectorGrid) const {
  return impl_->vectorsOf(vectorGrid).constTree().leafCount();
}

void SolidGrids::write(const std::filesystem::path& path) const {
  detail::writeVdb(path, impl_->grids, impl_->metadata);
}

}  // namespace polestar
