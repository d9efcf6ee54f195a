#pragma once
// Finding the cell of a point, and what the table says there.

#include <memory>
#include <mutex>
#include <optional>
#include <span>

#include "polestar/chart/green_chart.h"
#include "polestar/core/detail/aabb_tree.h"
#include "polestar/map/ball_map.h"
#include "polestar/map/detail/image_slopes.h"

namespace polestar::detail {

/// Inner frame throughout.
class FoliationTable {
 public:
  /// Without `bends` these are found, which is most of the work.
  FoliationTable(GreenChart chart, NodeImages images, RadiusProfile radius, std::optional<NodeBends> bends);

  struct Location {
    std::size_t cell = 0;
    Eigen::Vector4d weights = Eigen::Vector4d::Zero();  ///< barycentric, by corner of the cell
    bool inside() const { return weights.minCoeff() >= 0; }
  };
  /// The cell that contains x, else the one that misses it least; nothing when x is outside all cells by more
  /// than `slack` in barycentric weight. `hint` is tried first: neighbouring queries mostly share their cell.
  std::optional<Location> locate(const Vec3& x, std::size_t hint, double slack = 1e-9) const;

  struct Value {
    double green = 0;       ///< 1/|x| + interpolated h, or that of s(R) around linear nodes; 0 on the surface
    double ballRadius = 0;  ///< s(R) in [0, 1], 1 on the surface alone
    Vec3 direction = Vec3::UnitX();  ///< unit
    Mat3 jacobian = Mat3::Zero();    ///< of ballRadius * direction; only when asked for
  };
  Value evaluate(const Vec3& x, const Location& location, bool withJacobian) const;

  /// Values at points near each other, as the voxels of a leaf are: cells are found once for all of them.
  /// Sets found[i] to 1 and values[i] where a cell holds point i, else found[i] to 0. Points that are not
  /// near each other make it give up early and find none.
  void evaluateNear(std::span<const Vec3> points, std::span<Value> values, std::span<char> found) const;

  struct Preimage {
    Vec3 x;
    std::size_t cell;
  };
  /// Where the piecewise linear map from the cells to their images takes y from; nothing outside all images.
  /// The first call builds a tree over them.
  std::optional<Preimage> linearInverse(const Vec3& y) const;

  /// Where one of the cells around linearInverse()'s takes y from, by the cell's own map: the map is smooth
  /// in cells alone, and steps over their faces can go round in circles. Those are looked at whose images lie
  /// no farther from y than that cell's image is wide: images are well shaped and few are near, whatever the
  /// cells are. Nothing when none does.
  std::optional<Vec3> inverseNear(const Vec3& y, std::size_t cell) const;

  const NodeImages& images() const { return images_; }
  const NodeBends& bends() const { return bends_; }

 private:
  class CellMap;
  struct Potential {
    double green;
    Vec3 gradient;
  };

  struct ImageTree {
    std::once_flag once;
    AabbTree tree;
  };

  AabbTree treeOver(std::span<const Vec3> positions) const;
  double levelGreen(std::size_t node) const;
  bool offLevel(std::size_t node) const;
  bool folds(std::size_t cell) const;
  bool mayHold(std::size_t cell, const Vec3& x) const;
  void makeLinear(std::size_t node);
  void findBends();
  void markLinear();
  void limitSlopes();
  void straightenFolds();

  GreenChart chart_;
  NodeImages images_;
  RadiusProfile radius_;
  std::vector<Eigen::Matrix3f> slope_;  ///< see ImageSlopes
  NodeBends bends_;
  std::vector<char> linear_;       ///< 1 for bends_.straight
  std::vector<double> nodeGreen_;  ///< G at every node, 0 on the surface; the center's is not used
  AabbTree tree_;                  ///< over prisms, then over the cells at the center
  std::unique_ptr<ImageTree> imageTree_ = std::make_unique<ImageTree>();  ///< the same of their images
};

}  // namespace polestar::detail
