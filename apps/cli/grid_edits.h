#pragma once
// What `convert` can change on the grids that pass through it.

#include <optional>
#include <string>
#include <vector>

#include "cli/grid_size.h"
#include "cli/session.h"
#include "polestar/vdb/grid_set.h"

namespace polestar::cli {

class GridEdits {
 public:
  /// Adds --pick, --drop, --rename, --as, --iso, --half-width, --voxel, --dim, --up, --half, --prune and
  /// --compression.
  void addOptions(CLI::App& app);
  /// @throws Error{Errc::usage} for values that cannot be.
  void prepare();

  /// Which of `surface` and `density` were asked for; nothing: what there is.
  bool wants(const std::string& grid) const;
  bool asked() const { return !as_.empty(); }
  std::optional<UpAxis> up() const { return up_; }
  std::optional<double> iso() const { return iso_; }
  int halfWidth() const { return halfWidth_; }
  const GridSize& size() const { return size_; }
  VdbCompression compression() const { return compression_; }

  /// All of them, in the order: pick and drop, --as, voxels, up, rename, half, prune. `sized`: the voxels are
  /// of the size asked for already. What could not be done is a warning.
  /// @throws what GridSet throws.
  void apply(GridSet& grids, bool sized, Session& session) const;

 private:
  void renameAll(GridSet& grids) const;
  double newVoxel(const GridSet& grids) const;

  std::vector<std::string> pick_, drop_, rename_, as_;
  std::optional<double> iso_, prune_;
  std::optional<UpAxis> up_;
  int halfWidth_ = 3;
  bool half_ = false;
  VdbCompression compression_ = VdbCompression::blosc;
  GridSize size_;
};

}  // namespace polestar::cli
