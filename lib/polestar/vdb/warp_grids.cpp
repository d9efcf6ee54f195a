#include "polestar/vdb/warp_grids.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>
#include <sstream>
#include <type_traits>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Interpolation.h>
#include <openvdb/tools/Prune.h>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/vdb/detail/grid_parts.h"
#include "polestar/vdb/detail/vdb_file.h"

namespace polestar {
namespace {

using openvdb::Coord;

constexpr int kLeafSize = 8;
constexpr std::size_t kLeafVoxels = 512;

/// The voxels of one leaf of the new grids that come from somewhere.
struct Batch {
  Coord origin;
  std::vector<openvdb::Index> voxels;  ///< offsets in the leaf
  std::vector<Vec3> sources;           ///< before the map
  std::vector<Mat3> jacobians;         ///< only when some grid wants them
};

/// One grid on its way; the types are behind it.
class Carrier {
 public:
  virtual ~Carrier() = default;
  virtual bool wantsJacobian() const = 0;
  virtual std::size_t bytesPerVoxel() const = 0;
  virtual void prepare(std::size_t leaves) = 0;
  virtual void fill(std::size_t slot, const Batch& batch, const GridWarp& warp) = 0;
  virtual openvdb::GridBase::Ptr finish(const openvdb::math::Transform::Ptr& transform) = 0;
};

template <class Value>
constexpr bool kIsRealVector = std::is_same_v<Value, openvdb::Vec3s> || std::is_same_v<Value, openvdb::Vec3d>;
/// Interpolated; all else is read from the nearest voxel.
template <class Value>
constexpr bool kIsReal = std::is_floating_point_v<Value> || kIsRealVector<Value>;

template <class Grid>
class CarrierOf final : public Carrier {
  using Tree = typename Grid::TreeType;
  using Leaf = typename Tree::LeafNodeType;
  using Value = typename Grid::ValueType;

 public:
  CarrierOf(typename Grid::ConstPtr grid, ValueRole role)
      : grid_(std::move(grid)), role_(role), everywhere_(grid_->getGridClass() == openvdb::GRID_LEVEL_SET) {}

  bool wantsJacobian() const override {
    return role_ != ValueRole::invariant && role_ != ValueRole::position;
  }
  std::size_t bytesPerVoxel() const override { return sizeof(Value); }
  void prepare(std::size_t leaves) override { leaves_.resize(leaves); }

  void fill(std::size_t slot, const Batch& batch, const GridWarp& warp) override {
    // Not registered with the tree: nothing changes that while we read.
    openvdb::tree::ValueAccessor<const Tree, false> from(grid_->tree());
    std::array<Value, kLeafVoxels> values;
    std::vector<char> active(batch.voxels.size());
    for (std::size_t i = 0; i < batch.voxels.size(); ++i) {
      const Vec3& x = batch.sources[i];
      const openvdb::Vec3d index = grid_->transform().worldToIndex(openvdb::Vec3d(x.x(), x.y(), x.z()));
      active[i] = read(from, index, values[i]) || everywhere_;
    }
    if constexpr (kIsRealVector<Value>) carry(batch, warp, std::span(values).first(active.size()), active);

    if (std::none_of(active.begin(), active.end(), [](char on) { return on != 0; })) return;
    auto leaf = std::make_unique<Leaf>(batch.origin, grid_->background());
    for (std::size_t i = 0; i < batch.voxels.size(); ++i) {
      if (active[i]) leaf->setValueOn(batch.voxels[i], values[i]);
    }
    leaves_[slot] = std::move(leaf);
  }

  openvdb::GridBase::Ptr finish(const openvdb::math::Transform::Ptr& transform) override {
    auto tree = std::make_shared<Tree>(grid_->background());
    for (std::unique_ptr<Leaf>& leaf : leaves_) {
      if (leaf) tree->addLeaf(leaf.release());
    }
    openvdb::tools::prune(*tree);
    auto result = Grid::create(tree);
    for (auto entry = grid_->beginMeta(); entry != grid_->endMeta(); ++entry) {
      // Ours of before tell of another picture, those of the file are made anew.
      if (entry->first.starts_with("polestar:") || entry->first.starts_with("file_")) continue;
      result->insertMeta(entry->first, *entry->second);
    }
    result->setName(grid_->getName());
    result->setTransform(transform);
    if (everywhere_) result->setGridClass(openvdb::GRID_UNKNOWN);
    result->setCreator(std::string("polestar ") + kVersion);
    return result;
  }

 private:
  /// False where no voxel that was read is active.
  template <class Accessor>
  static bool read(const Accessor& from, const openvdb::Vec3d& index, Value& value) {
    if constexpr (kIsReal<Value>) {
      return openvdb::tools::BoxSampler::sample(from, index, value);
    } else {
      const Coord nearest = Coord::round(index);
      value = from.getValue(nearest);
      return from.isValueOn(nearest);
    }
  }

  void carry(const Batch& batch, const GridWarp& warp, std::span<Value> values,
             std::vector<char>& active) const {
    if (role_ == ValueRole::invariant) return;
    std::vector<Vec3> vectors(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      vectors[i] = {values[i].x(), values[i].y(), values[i].z()};
    if (role_ == ValueRole::position) {
      std::vector<Vec3> after(vectors.size());
      warp.target(vectors, after);
      vectors.swap(after);
    } else {
      for (std::size_t i = 0; i < vectors.size(); ++i) {
        const Mat3& jacobian = batch.jacobians[i];
        if (role_ == ValueRole::contravariant) {
          vectors[i] = jacobian * vectors[i];
        } else {
          vectors[i] = jacobian.inverse().transpose() * vectors[i];
          if (role_ == ValueRole::covariantNormalized) vectors[i].normalize();
        }
      }
    }
    using Number = typename Value::value_type;
    for (std::size_t i = 0; i < vectors.size(); ++i) {
      if (!vectors[i].allFinite()) active[i] = 0;
      values[i] = Value(static_cast<Number>(vectors[i].x()), static_cast<Number>(vectors[i].y()),
                        static_cast<Number>(vectors[i].z()));
    }
  }

  typename Grid::ConstPtr grid_;
  const ValueRole role_;
  const bool everywhere_;
  std::vector<std::unique_ptr<Leaf>> leaves_;
};

std::string howVectors(ValueRole role) {
  switch (role) {
    case ValueRole::contravariant:
      return "as vectors by the Jacobian";
    case ValueRole::covariant:
      return "as covectors by its inverse transpose";
    case ValueRole::covariantNormalized:
      return "as covectors by its inverse transpose, normalized";
    case ValueRole::position:
      return "as positions";
    case ValueRole::invariant:
      break;
  }
  return "interpolated";
}

template <class Grid>
std::unique_ptr<Carrier> tryType(const openvdb::GridBase::Ptr& base, WarpedGrid& report) {
  const auto grid = openvdb::gridPtrCast<Grid>(base);
  if (!grid) return nullptr;
  using Value = typename Grid::ValueType;
  ValueRole role = ValueRole::invariant;
  if constexpr (kIsRealVector<Value>) role = detail::roleOf(*grid);
  report.how = kIsReal<Value> ? howVectors(role) : "nearest";
  return std::make_unique<CarrierOf<Grid>>(grid, role);
}

std::unique_ptr<Carrier> carrierFor(const openvdb::GridBase::Ptr& grid, WarpedGrid& report) {
  report.name = grid->getName();
  report.valueType = grid->valueType();
  for (const auto attempt :
       {&tryType<openvdb::FloatGrid>, &tryType<openvdb::DoubleGrid>, &tryType<openvdb::Vec3SGrid>,
        &tryType<openvdb::Vec3DGrid>, &tryType<openvdb::Int32Grid>, &tryType<openvdb::Int64Grid>,
        &tryType<openvdb::BoolGrid>, &tryType<openvdb::Vec3IGrid>}) {
    if (auto carrier = attempt(grid, report)) {
      if (grid->getGridClass() == openvdb::GRID_LEVEL_SET)
        report.note = "a level set is no distance any more: written as class unknown";
      return carrier;
    }
  }
  report.note = "left out: grids of type " + grid->type() + " are not carried";
  return nullptr;
}

}  // namespace

void WarpGridsOptions::validate() const {
  if (!(voxelSize > 1e-30 && voxelSize < 1e30)) {
    throw Error(Errc::usage, "the voxel size must be a positive number, between 1e-30 and 1e30");
  }
  if (!(box.extent().minCoeff() >= 0) || !box.min.allFinite() || !box.max.allFinite())
    throw Error(Errc::usage, "the box of the new grids is empty");
}

struct WarpedGrids::Impl {
  std::vector<WarpedGrid> report;
  std::vector<openvdb::GridBase::Ptr> grids;
  openvdb::math::Transform::Ptr transform;
  std::map<std::string, Metadata> metadata;
  std::size_t inside = 0;

  void run(std::vector<std::unique_ptr<Carrier>>& carriers, const GridWarp& warp,
           const WarpGridsOptions& options, Context& context);
};

void WarpedGrids::Impl::run(std::vector<std::unique_ptr<Carrier>>& carriers, const GridWarp& warp,
                            const WarpGridsOptions& options, Context& context) {
  const double h = options.voxelSize;
  const Vec3 first = options.box.min + Vec3::Constant(0.5 * h);
  transform = detail::makeUniformTransform(h, first);

  // Blocks of voxels, one leaf each, that cover the box.
  std::array<std::size_t, 3> blocks;
  std::size_t count = 1;
  double voxels = 1, bytes = 0;
  for (int k = 0; k < 3; ++k) {
    const double along = std::max(1.0, std::ceil(options.box.extent()[k] / h * (1 - 1e-12)));
    voxels *= along;
    blocks[k] = static_cast<std::size_t>(std::min(std::ceil(along / kLeafSize), 1e6));
    count *= blocks[k];
  }
  for (const auto& carrier : carriers) bytes += voxels * static_cast<double>(carrier->bytesPerVoxel() + 1);
  const double limit =
      options.memoryLimit > 0 ? static_cast<double>(options.memoryLimit) : 0.75 * detail::machineMemory();
  if (bytes > limit) {
    std::ostringstream message;
    message.precision(4);
    message << "voxels of " << h << " would take about " << bytes / 1e9 << " GB of the " << limit / 1e9
            << " GB allowed; voxels of " << h * std::cbrt(bytes / limit) << " would fit";
    throw Error(Errc::usage, message.str());
  }

  const bool jacobians = std::any_of(carriers.begin(), carriers.end(),
                                     [](const auto& carrier) { return carrier->wantsJacobian(); });
  for (const auto& carrier : carriers) carrier->prepare(count);
  std::vector<std::size_t> found(count, 0);
  const auto fillBlock = [&](std::size_t slot) {
    Batch batch;
    const std::size_t z = slot % blocks[2], y = slot / blocks[2] % blocks[1],
                      x = slot / blocks[2] / blocks[1];
    batch.origin = Coord(static_cast<int>(x) * kLeafSize, static_cast<int>(y) * kLeafSize,
                         static_cast<int>(z) * kLeafSize);
    std::array<Vec3, kLeafVoxels> after, before;
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      // A leaf's own order: z fastest.
      const Vec3 offset(static_cast<double>(i >> 6), static_cast<double>(i >> 3 & 7),
                        static_cast<double>(i & 7));
      after[i] = first + h * (Vec3(batch.origin.x(), batch.origin.y(), batch.origin.z()) + offset);
    }
    warp.source(after, before);
    for (std::size_t i = 0; i < kLeafVoxels; ++i) {
      if (!before[i].allFinite()) continue;
      batch.voxels.push_back(static_cast<openvdb::Index>(i));
      batch.sources.push_back(before[i]);
    }
    found[slot] = batch.voxels.size();
    if (batch.voxels.empty()) return;
    if (jacobians) {
      batch.jacobians.resize(batch.sources.size());
      warp.jacobian(batch.sources, batch.jacobians);
    }
    for (const auto& carrier : carriers) carrier->fill(slot, batch, warp);
  };
  // In portions, since progress is for the thread that drives the loop to report.
  const std::size_t portion = std::max<std::size_t>(count / 100, 16);
  for (std::size_t done = 0; done < count; done += portion) {
    context.progress("warping grids", static_cast<double>(done) / static_cast<double>(count));
    detail::parallelChunks(std::min(count - done, portion), 1, context,
                           [&](std::size_t slot, std::size_t) { fillBlock(done + slot); });
  }
  context.progress("warping grids", 1);
  for (const std::size_t voxelsOfBlock : found) inside += voxelsOfBlock;
}

WarpedGrids::WarpedGrids(const std::filesystem::path& path, const GridWarp& warp,
                         const WarpGridsOptions& options, Context& context)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  const openvdb::GridPtrVec old = detail::readVdb(path).grids;
  std::vector<std::unique_ptr<Carrier>> carriers;
  std::vector<std::size_t> rows;
  for (const openvdb::GridBase::Ptr& grid : old) {
    WarpedGrid report;
    if (auto carrier = carrierFor(grid, report)) {
      carriers.push_back(std::move(carrier));
      rows.push_back(impl_->report.size());
    }
    impl_->report.push_back(std::move(report));
  }
  if (carriers.empty()) {
    throw Error(Errc::io, path.string() + " holds no grid of numbers or vectors that could be carried");
  }
  try {
    impl_->run(carriers, warp, options, context);
    for (std::size_t i = 0; i < carriers.size(); ++i) {
      impl_->grids.push_back(carriers[i]->finish(impl_->transform));
      impl_->report[rows[i]].activeVoxels = impl_->grids.back()->activeVoxelCount();
    }
  } catch (const openvdb::Exception& error) {
    throw Error(Errc::io, "cannot carry the grids of " + path.string() + ": " + error.what());
  }
}

WarpedGrids::~WarpedGrids() = default;
WarpedGrids::WarpedGrids(WarpedGrids&&) noexcept = default;
WarpedGrids& WarpedGrids::operator=(WarpedGrids&&) noexcept = default;

const std::vector<WarpedGrid>& WarpedGrids::report() const { return impl_->report; }
std::size_t WarpedGrids::voxelsInside() const { return impl_->inside; }

void WarpedGrids::setMetadata(const std::string& key, const Metadata& value) { impl_->metadata[key] = value; }

void WarpedGrids::write(const std::filesystem::path& path) const {
  detail::writeVdb(path, impl_->grids, impl_->metadata);
}

}  // namespace polestar
