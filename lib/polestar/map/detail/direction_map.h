#pragma once
// A: from directions of field lines at the center to boundary parameters, between the vertices.

#include <optional>
#include <span>
#include <vector>

#include "polestar/map/detail/tangent_fit.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar::detail {

/// A(omega_i) = phi_i; on the triangles of omega with slopes at their corners, as the table has them: exact
/// for quadratic A, linear around corners where no slope can be had.
class DirectionMap {
 public:
  DirectionMap(std::span<const Vec3> omega, std::span<const Vec3> phi,
               const std::vector<Triangle>& triangles);

  /// Unit vector; nothing where the triangles of omega leave a gap.
  std::optional<Vec3> operator()(const Vec3& omega) const;

 private:
  SphereLocator locator_;
  std::vector<Triangle> triangles_;
  std::vector<Vec3> omega_, phi_;
  std::vector<std::optional<TangentFit::Slope>> slope_;
};

}  // namespace polestar::detail
