#include "cli/grid_size.h"

#include <algorithm>
#include <cmath>

#include "cli/text.h"

namespace polestar::cli {

void GridSize::addOptions(CLI::App& app, const std::string& whose, int defaultDim) {
  dim_ = defaultDim;
  voxelOption_ = app.add_option("--voxel", voxel_, "Size of a voxel, " + whose + " units")
                     ->check(CLI::PositiveNumber.description(""))
                     ->type_name("S");
  dimOption_ = app.add_option("--dim", dim_, "Voxels along " + whose + " longest side")
                   ->check(CLI::Range(4, 1 << 20).description(""))
                   ->capture_default_str()
                   ->excludes(voxelOption_)
                   ->type_name("N");
}

bool GridSize::given() const { return voxelOption_->count() > 0 || dimOption_->count() > 0; }

PlannedFile plannedGrids(const std::filesystem::path& path, const std::string& names, const Box& box,
                         double voxel, int padding, double bytesPerVoxel) {
  std::string size;
  double voxels = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const double count = std::ceil(box.extent()[axis] / voxel) + 2 * padding;
    voxels *= count;
    size += (axis ? " x " : "") + shortNumber(count);
  }
  return {path, "grids " + names + " in " + size + " voxels of " + shortNumber(voxel),
          static_cast<std::uint64_t>(std::min(voxels * bytesPerVoxel, 1e18))};
}

}  // namespace polestar::cli
