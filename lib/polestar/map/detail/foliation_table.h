#pragma once
// Finding the cell of a point, and what the table says there.

#include <optional>
#include <span>

#include "polestar/chart/green_chart.h"
#include "polestar/core/detail/aabb_tree.h"
#include "polestar/map/radius_profile.h"

namespace polestar::detail {

/// Inner frame throughout.
class FoliationTable {
 public:
  /// `nodeDirections`: one a node but the center.
  FoliationTable(GreenChart chart, std::vector<Vec3> nodeDirections, RadiusProfile radius);

  struct Location {
    std::size_t cell = 0;
    Eigen::Vector4d weights = Eigen::Vector4d::Zero();  ///< barycentric, by corner of the cell
    bool inside() const { return weights.minCoeff() >= 0; }
  };
  /// The cell that contains x, else the one that misses it least; nothing when x is outside all cells by more
  /// than `slack` in barycentric weight. `hint` is tried first: neighbouring queries mostly share their cell.
  std::optional<Location> locate(const Vec3& x, std::size_t hint, double slack = 1e-9) const;

  struct Value {
    double green;       ///< 1/|x| + interpolated h; 0 on the surface and positive inside
    double ballRadius;  ///< s(R) in [0, 1], 1 on the surface alone
    Vec3 direction;     ///< unit
    Mat3 jacobian;      ///< of ballRadius * direction; only when asked for
  };
  Value evaluate(const Vec3& x, const Location& location, bool withJacobian) const;

  std::span<const Vec3> nodeDirections() const { return nodeDirections_; }

 private:
  struct Potential {
    double green;
    Vec3 gradient;
  };
  Potential potential(const Vec3& x, const Location& location, const Mat3& weightGradients) const;
  bool weigh(const Vec3& x, std::size_t cell, Eigen::Vector4d& weights) const;

  GreenChart chart_;
  std::vector<Vec3> nodeDirections_;
  RadiusProfile radius_;
  std::vector<double> nodeGreen_;  ///< G at every node but the center; 0 on the surface
  AabbTree tree_;
};

}  // namespace polestar::detail
