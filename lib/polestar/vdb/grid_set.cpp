#include "polestar/vdb/grid_set.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <openvdb/openvdb.h>
#include <openvdb/tools/Prune.h>

#include "polestar/core/error.h"
#include "polestar/vdb/detail/grid_parts.h"
#include "polestar/vdb/detail/mesh_to_level_set.h"
#include "polestar/vdb/detail/mesh_to_volume.h"
#include "polestar/vdb/detail/resampled_grid.h"
#include "polestar/vdb/detail/sampled_file.h"
#include "polestar/vdb/detail/solid_parts.h"
#include "polestar/vdb/detail/turned_grid.h"
#include "polestar/vdb/detail/vdb_file.h"

namespace polestar {
namespace {

using openvdb::GridBase;

constexpr double kLargestHalf = 65504;
constexpr double kSmallestNormalHalf = 6.2e-5;

using RealGrids = openvdb::RealGridTypes::Append<openvdb::Vec3SGrid, openvdb::Vec3DGrid>;

double largestOf(double value) { return std::abs(value); }
template <class Number>
double largestOf(const openvdb::math::Vec3<Number>& v) {
  return std::max({std::abs(v.x()), std::abs(v.y()), std::abs(v.z())});
}

/// Why halves would spoil a grid; empty where they do not.
std::string harmOfHalves(const GridBase& grid) {
  const std::string name = grid.getName();
  if (name == "rest" || name == "position" || name == "green")
    return "coordinates and G need all digits; saved in full";
  double largest = 0;
  const bool real = grid.apply<RealGrids>([&](const auto& typed) {
    for (auto value = typed.cbeginValueOn(); value; ++value) largest = std::max(largest, largestOf(*value));
  });
  if (!real) return "half floats are for floats and vectors of them; saved as it is";
  if (largest > kLargestHalf) return "values beyond 65504, the largest half float; saved in full";
  if (grid.getGridClass() == openvdb::GRID_LEVEL_SET && grid.voxelSize()[0] < kSmallestNormalHalf)
    return "distances below 6e-5, where half floats lose their digits; saved in full";
  return "";
}

/// The tree of a typed grid, pruned.
template <class Grid>
void pruneTree(Grid& grid, double tolerance) {
  using Value = typename Grid::ValueType;
  if constexpr (std::is_floating_point_v<Value>) {
    if (grid.getGridClass() == openvdb::GRID_LEVEL_SET)
      openvdb::tools::pruneLevelSet(grid.tree());
    else
      openvdb::tools::prune(grid.tree(), static_cast<Value>(tolerance));
  } else if constexpr (std::is_same_v<Value, openvdb::Vec3s> || std::is_same_v<Value, openvdb::Vec3d>) {
    openvdb::tools::prune(grid.tree(), Value(static_cast<typename Value::value_type>(tolerance)));
  } else {
    openvdb::tools::prune(grid.tree());
  }
}

/// Of a grid made from another: what it says of itself, except which kind of grid it is.
void inheritMetadata(const GridBase& from, GridBase& to) {
  for (auto entry = from.beginMeta(); entry != from.endMeta(); ++entry) {
    if (entry->first == GridBase::META_GRID_NAME || entry->first == GridBase::META_GRID_CLASS ||
        entry->first == GridBase::META_GRID_CREATOR || entry->first.starts_with("file_"))
      continue;
    to.insertMeta(entry->first, *entry->second);
  }
}

TriMesh inIndexSpace(TriMesh mesh, const openvdb::math::Transform& transform) {
  for (Vec3& v : mesh.vertices) {
    const openvdb::Vec3d index = transform.worldToIndex(openvdb::Vec3d(v.x(), v.y(), v.z()));
    v = {index.x(), index.y(), index.z()};
  }
  return mesh;
}

}  // namespace

Vec3 turnedUp(const Vec3& v, UpAxis up) { return detail::AxisTurn(up).vector(v); }

void VoxelizeOptions::validate() const {
  GridOptions{.voxelSize = voxelSize, .padding = 0, .halfWidth = halfWidth}.validate();
}

struct GridSet::Impl {
  openvdb::GridPtrVec grids;
  detail::VdbForm form;
  std::map<std::string, Metadata> metadata;

  openvdb::GridCPtrVec constGrids() const { return {grids.begin(), grids.end()}; }

  static GridBase::Ptr resampled(const GridBase::ConstPtr& grid, const openvdb::math::Transform::Ptr& lattice,
                                 Context& context);

  std::string nameList() const {
    std::string list;
    for (const auto& grid : grids) list += (list.empty() ? "" : ", ") + grid->getName();
    return list;
  }
  void requireNames(std::span<const std::string> names) const {
    for (const std::string& name : names) {
      if (std::any_of(grids.begin(), grids.end(), [&](const auto& grid) { return grid->getName() == name; }))
        continue;
      throw Error(Errc::usage, "there is no grid " + name + "; there are " + nameList());
    }
  }
  void erase(const openvdb::GridBase::ConstPtr& gone) {
    std::erase_if(grids, [&](const GridBase::Ptr& grid) { return grid == gone; });
  }
  void insertAfter(const GridBase::ConstPtr& old, const GridBase::Ptr& made) {
    const auto at = std::find(grids.begin(), grids.end(), old);
    grids.insert(at == grids.end() ? at : at + 1, made);
  }
};

GridSet::GridSet(const std::filesystem::path& path) : impl_(std::make_unique<Impl>()) {
  detail::VdbContent content = detail::readVdb(path);
  if (content.grids.empty()) throw Error(Errc::io, path.string() + " holds no grid");
  impl_->grids = std::move(content.grids);
  impl_->form.metadata = std::move(content.metadata);
}

GridSet::GridSet(SampledGrids&& grids) : impl_(std::make_unique<Impl>()) {
  for (const auto& grid : grids.file_->grids) impl_->grids.push_back(std::const_pointer_cast<GridBase>(grid));
}

GridSet::GridSet(const TriMesh& closed, const VoxelizeOptions& options, Context& context)
    : impl_(std::make_unique<Impl>()) {
  options.validate();
  const GridOptions size{.voxelSize = options.voxelSize, .padding = 0, .halfWidth = options.halfWidth};
  if (options.exact) {
    *this = GridSet(SolidGrids(closed, size, context).lookUp());
    return;
  }
  detail::checkSolidSize(closed, size);
  detail::initializeOpenVdb();
  context.progress("voxelizing", 0);
  const auto transform =
      detail::makeUniformTransform(options.voxelSize, detail::solidOrigin(closed, options.voxelSize));
  const auto tree =
      detail::meshToVolume(inIndexSpace(closed, *transform), options.halfWidth, options.voxelSize, context);
  impl_->grids.push_back(
      detail::makeGrid<openvdb::FloatTree>("surface", tree, transform, openvdb::GRID_LEVEL_SET));
  context.progress("voxelizing", 1);
}

GridSet::~GridSet() = default;
GridSet::GridSet(GridSet&&) noexcept = default;
GridSet& GridSet::operator=(GridSet&&) noexcept = default;

std::vector<GridInfo> GridSet::describe() const {
  std::vector<GridInfo> infos;
  for (const auto& grid : impl_->grids) infos.push_back(detail::describeGrid(*grid));
  return infos;
}

SampledGrids GridSet::lookUp() const {
  return SampledGrids(std::make_shared<const SampledGrids::File>(SampledGrids::File{impl_->constGrids()}));
}

void GridSet::pick(std::span<const std::string> names) {
  impl_->requireNames(names);
  std::erase_if(impl_->grids, [&](const GridBase::Ptr& grid) {
    return std::find(names.begin(), names.end(), grid->getName()) == names.end();
  });
}

void GridSet::drop(std::span<const std::string> names) {
  impl_->requireNames(names);
  std::erase_if(impl_->grids, [&](const GridBase::Ptr& grid) {
    return std::find(names.begin(), names.end(), grid->getName()) != names.end();
  });
  if (impl_->grids.empty()) throw Error(Errc::usage, "no grid would be left; drop fewer");
}

void GridSet::rename(const std::string& from, const std::string& to) {
  impl_->requireNames({&from, 1});
  if (to.empty() || to.find_first_of(" \t\n") != std::string::npos) {
    throw Error(Errc::usage, "'" + to + "' cannot name a grid: other programs need a name without spaces");
  }
  for (const auto& grid : impl_->grids) {
    if (grid->getName() == to && from != to)
      throw Error(Errc::usage, "there is a grid " + to + " already; drop or rename it first");
  }
  for (const auto& grid : impl_->grids) {
    if (grid->getName() == from) grid->setName(to);
  }
}

void GridSet::provide(bool surface, bool density, double iso, int halfWidth, Context& context) {
  const auto levelSet = detail::findLevelSet(impl_->constGrids());
  const auto fog = detail::findFog(impl_->constGrids());
  if (!levelSet && !fog) {
    throw Error(Errc::io, "there is neither a level set nor a fog among the grids " + impl_->nameList());
  }
  if (surface && !levelSet) {
    const std::optional<TriMesh> mesh = lookUp().extractSurface({.level = iso});
    if (!mesh) {
      throw Error(Errc::io, "the fog " + fog->getName() + " is nowhere " + std::to_string(iso) +
                                "; choose another value with --iso");
    }
    detail::requireCubes(*fog);
    const auto tree = detail::meshToLevelSet(inIndexSpace(*mesh, fog->transform()), halfWidth,
                                             fog->voxelSize()[0], context);
    const auto made = detail::makeGrid<openvdb::FloatTree>(
        "surface", tree, std::const_pointer_cast<openvdb::FloatGrid>(fog)->transformPtr(),
        openvdb::GRID_LEVEL_SET);
    inheritMetadata(*fog, *made);
    impl_->insertAfter(fog, made);
  }
  if (density && !fog) {
    detail::requireFinite(*lookUp().solidGrid());
    detail::requireCubes(*levelSet);
    const auto made = detail::makeGrid<openvdb::FloatTree>(
        "density", detail::fogOf(levelSet->tree(), levelSet->voxelSize()[0]),
        std::const_pointer_cast<openvdb::FloatGrid>(levelSet)->transformPtr(), openvdb::GRID_FOG_VOLUME);
    if (made->activeVoxelCount() == 0)
      throw Error(Errc::io, "the level set " + levelSet->getName() + " has no inside");
    inheritMetadata(*levelSet, *made);
    impl_->insertAfter(levelSet, made);
  }
  if (!surface && levelSet) impl_->erase(levelSet);
  if (!density && fog) impl_->erase(fog);
}

std::vector<std::string> GridSet::halve() {
  std::vector<std::string> notes;
  for (const auto& grid : impl_->grids) {
    const std::string harm = harmOfHalves(*grid);
    grid->setSaveFloatAsHalf(harm.empty());
    if (!harm.empty()) notes.push_back(grid->getName() + ": " + harm);
  }
  return notes;
}

void GridSet::prune(double tolerance) {
  for (const auto& grid : impl_->grids) {
    grid->apply<detail::ValueGrids>([&](auto& typed) { pruneTree(typed, tolerance); });
  }
}

GridBase::Ptr GridSet::Impl::resampled(const GridBase::ConstPtr& grid,
                                       const openvdb::math::Transform::Ptr& lattice, Context& context) {
  const SampledGrids alone(std::make_shared<const SampledGrids::File>(SampledGrids::File{{grid}}));
  if (grid->getGridClass() == openvdb::GRID_LEVEL_SET && alone.solidGrid()) {
    const double old = grid->voxelSize()[0], h = lattice->voxelSize()[0];
    const auto background = openvdb::gridConstPtrCast<openvdb::FloatGrid>(grid)->background();
    const int halfWidth = std::clamp(static_cast<int>(std::lround(background / old)), 2, 64);
    const std::optional<TriMesh> surface = alone.extractSurface();
    if (!surface) throw Error(Errc::io, "the level set " + grid->getName() + " has no surface");
    detail::checkSolidSize(*surface, {.voxelSize = h, .padding = 0, .halfWidth = halfWidth});
    return openvdb::FloatGrid::create(
        detail::meshToLevelSet(inIndexSpace(*surface, *lattice), halfWidth, h, context));
  }
  return detail::resampledGrid(*grid, alone.grids().empty() ? nullptr : &alone.grids().front(), *lattice,
                               context);
}

std::vector<std::string> GridSet::resample(double voxelSize, Context& context) {
  GridOptions{.voxelSize = voxelSize}.validate();
  const auto levelSet = detail::findLevelSet(impl_->constGrids());
  const GridBase& reference = levelSet ? static_cast<const GridBase&>(*levelSet) : *impl_->grids.front();
  const auto lattice = detail::latticeBeside(reference, voxelSize);
  std::vector<std::string> notes;
  openvdb::GridPtrVec made;
  for (const auto& grid : impl_->grids) {
    const GridBase::Ptr next = Impl::resampled(grid, lattice, context);
    if (!next) {
      notes.push_back(grid->getName() + ": left out, grids of type " + grid->type() + " are not resampled");
      continue;
    }
    inheritMetadata(*grid, *next);
    next->setName(grid->getName());
    next->setTransform(lattice);
    next->setGridClass(grid->getGridClass());
    // The judge saw other voxels.
    next->removeMeta("polestar:certificate");
    made.push_back(next);
  }
  impl_->grids = std::move(made);
  return notes;
}

std::vector<std::string> GridSet::turn(UpAxis up) {
  const detail::AxisTurn turn(up);
  std::vector<std::string> notes;
  openvdb::GridPtrVec made;
  for (const auto& grid : impl_->grids) {
    const GridBase::Ptr turned = detail::turnedGrid(*grid, turn);
    if (turned) {
      made.push_back(turned);
    } else {
      notes.push_back(grid->getName() + ": left out, grids of type " + grid->type() + " are not turned");
    }
  }
  impl_->grids = std::move(made);
  return notes;
}

void GridSet::setMetadata(const std::string& key, const Metadata& value) { impl_->metadata[key] = value; }

void GridSet::write(const std::filesystem::path& path, VdbCompression compression) const {
  detail::VdbForm form = impl_->form;
  form.compression = openvdb::io::COMPRESS_ACTIVE_MASK;
  if (compression == VdbCompression::blosc) form.compression |= openvdb::io::COMPRESS_BLOSC;
  if (compression == VdbCompression::zip) form.compression |= openvdb::io::COMPRESS_ZIP;
  detail::writeVdb(path, impl_->grids, impl_->metadata, form);
}

}  // namespace polestar
