#include "polestar/green/detail/triangle_layer.h"

#include <cmath>

namespace polestar::detail {

Vec3 layerGradient(const FlatTriangle& t, const std::array<double, 3>& density, const Vec3& slope,
                   const Vec3& x) {
  std::array<Vec3, 3> offset;
  std::array<double, 3> r;
  for (int k = 0; k < 3; ++k) {
    offset[k] = t.corner[k] - x;
    r[k] = offset[k].norm();
  }
  const double height = -offset[0].dot(t.normal);
  // Half the solid angle [van Oosterom & Strackee 1983], positive above the triangle.
  const double sine = -offset[0].dot(offset[1].cross(offset[2]));
  const double cosine = r[0] * r[1] * r[2] + r[0] * offset[1].dot(offset[2]) +
                        r[1] * offset[2].dot(offset[0]) + r[2] * offset[0].dot(offset[1]);
  const double solidAngle = 2 * std::atan2(sine, cosine);

  Vec3 gradient = Vec3::Zero(), edges = Vec3::Zero();
  double inverse = -height * solidAngle;  // integral of 1/r over the triangle
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    const Vec3 along = (t.corner[next] - t.corner[k]) / t.length[k];
    const double begin = offset[k].dot(along), end = offset[next].dot(along);
    // Integral of 1/r over the edge, from the side where nothing cancels.
    const double logarithm = begin + end > 0 ? std::log((r[next] + end) / (r[k] + begin))
                                             : std::log((r[k] - begin) / (r[next] - end));
    const double rise = (density[next] - density[k]) / t.length[k];
    const double weighted = (density[k] - begin * rise) * logarithm + rise * (r[next] - r[k]);
    gradient -= weighted * t.conormal[k];
    edges += logarithm * t.conormal[k];
    inverse += offset[k].dot(t.conormal[k]) * logarithm;
  }
  gradient += inverse * slope;
  // The double layer: the density at the foot of x, and what its slope adds.
  const double atFoot = density[0] - slope.dot(offset[0]);
  gradient -= (atFoot * solidAngle - height * slope.dot(edges)) * t.normal;
  return gradient;
}

}  // namespace polestar::detail
