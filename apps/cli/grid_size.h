#pragma once
// How fine the grids of a solid shall be, and how large that makes them.

#include <string>

#include "cli/dry_run.h"
#include "cli/session.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::cli {

/// --dim and --voxel.
class GridSize {
 public:
  void addOptions(CLI::App& app, const std::string& whose, int defaultDim);

  /// Whether one of the two was given.
  bool given() const;
  double voxelSize(const Box& box) const { return voxel_ > 0 ? voxel_ : box.extent().maxCoeff() / dim_; }

 private:
  int dim_ = 0;
  double voxel_ = 0;  // 0: by dim_
  CLI::Option *voxelOption_ = nullptr, *dimOption_ = nullptr;
};

/// The plan of a .vdb whose grids fill `box` and the padding around; at most `bytesPerVoxel` for a voxel of
/// the whole box.
PlannedFile plannedGrids(const std::filesystem::path& path, const std::string& names, const Box& box,
                         double voxel, int padding, double bytesPerVoxel);

}  // namespace polestar::cli
