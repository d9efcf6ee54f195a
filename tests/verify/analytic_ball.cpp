#include "analytic_ball.h"

#include <algorithm>
#include <cmath>

#include "support/exact_green.h"

namespace polestar::testing {

BallFields exactBall(const Vec3& center) {
  const BallGreen ball{center};
  BallFields fields;
  fields.center = center;
  fields.harmonicRadius = ball.harmonicRadius();
  fields.green = [ball](const Vec3& x) { return std::max(0.0, ball.green(x)); };
  fields.rest = [ball, center](const Vec3& x) -> Vec3 {
    const double radius = ballRadius(std::max(0.0, ball.green(x)), ball.harmonicRadius());
    const Vec3 d = x - center;
    if (center.norm() == 0) return radius * d.normalized();
    // The stream function is constant along a line; at the pole it is the cosine of the line's direction
    // and the image's share.
    const Vec3 axis = center.normalized();
    const double cosine = std::clamp(ball.streamFunction(x) - 1 / center.norm(), -1.0, 1.0);
    const Vec3 across = d - axis.dot(d) * axis;
    const double width = across.norm();
    const Vec3 omega = cosine * axis + (width > 0 ? Vec3(std::sqrt(1 - cosine * cosine) / width * across)
                                                  : Vec3(Vec3::Zero()));
    return radius * omega;
  };
  return fields;
}

verify::VoxelSolid voxelize(const BallFields& fields, int dim) {
  verify::VoxelSolid solid;
  const double h = 2.0 / dim;
  const int size = dim + 2;
  solid.size = {size, size, size};
  solid.corner = {-1, -1, -1};
  // Box index i lies at (i - 1/2) h - 1.
  const auto world = [&](int i, int j, int k) {
    return Vec3(Vec3(i - 0.5, j - 0.5, k - 0.5) * h - Vec3::Ones());
  };
  const Vec3 center = (fields.center + Vec3::Ones()) / h + Vec3::Constant(0.5);
  solid.center = {center.x(), center.y(), center.z()};
  solid.harmonicRadius = fields.harmonicRadius / h;
  solid.greenCap = 1;
  for (int i = 0; i < size; ++i) {
    for (int j = 0; j < size; ++j) {
      for (int k = 0; k < size; ++k) {
        const Vec3 x = world(i, j, k);
        const bool inside = fields.surface(x) < 0 && std::min({i, j, k}) > 0 && std::max({i, j, k}) <= dim;
        solid.slot.push_back(inside ? static_cast<std::int32_t>(solid.count()) : -1);
        if (!inside) continue;
        const Vec3 rest = fields.rest(x);
        solid.box.push_back(static_cast<std::uint32_t>(solid.slot.size() - 1));
        solid.rest.push_back(
            {static_cast<float>(rest.x()), static_cast<float>(rest.y()), static_cast<float>(rest.z())});
        solid.green.push_back(static_cast<float>(std::min(fields.green(x) * h, solid.greenCap)));
        solid.surface.push_back(static_cast<float>(fields.surface(x) / h));
      }
    }
  }
  return solid;
}

}  // namespace polestar::testing
