#include "polestar/map/detail/surface_rays.h"

namespace polestar::detail {

// BallMap::sample continues phi(q) along the ray: outside, |y| is |x - c| / |q - c|.
std::vector<RayExit> rayExits(const BallMap& map, std::span<const Vec3> directions) {
  const Frame& frame = map.chart().green().shape().frame();
  const double outside = 2 * frame.unit;
  std::vector<Vec3> points, images(directions.size());
  for (const Vec3& d : directions) points.push_back(frame.origin + outside * d.normalized());
  std::vector<double> green(points.size());
  map.sample(points, images, green);
  std::vector<RayExit> exits;
  for (std::size_t i = 0; i < points.size(); ++i)
    exits.push_back({images[i].normalized(), (points[i] - frame.origin).norm() / images[i].norm()});
  return exits;
}

}  // namespace polestar::detail
