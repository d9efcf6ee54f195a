#include "polestar/map/surface_points.h"

#include <limits>
#include <utility>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {

struct SurfacePoints::Data {
  BallMap map;
  TriMesh surface;  // mesh units
  SphereLocator phi;
};

SurfacePoints::SurfacePoints(const BallMap& map) {
  const TriMesh& surface = map.chart().green().shape().surface().mesh();
  data_ = std::make_shared<const Data>(
      Data{map, surface, SphereLocator(map.sphere().directions, surface.triangles)});
}

void SurfacePoints::at(std::span<const Vec3> directions, std::span<Vec3> solid) const {
  constexpr std::size_t kChunk = 512;
  detail::parallelChunks(directions.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      solid[i].setConstant(std::numeric_limits<double>::quiet_NaN());
      if (!directions[i].allFinite()) continue;
      const auto hit = data_->phi.locate(directions[i]);
      if (!hit) continue;
      const Triangle& t = data_->surface.triangles[hit->triangle];
      solid[i].setZero();
      for (int k = 0; k < 3; ++k) solid[i] += hit->weights[k] * data_->surface.vertices[t[k]];
    }
  });
}

void SurfacePoints::continuedInverse(std::span<const Vec3> ball, std::span<Vec3> solid) const {
  const Vec3& center = data_->map.chart().green().shape().frame().origin;
  data_->map.inverse(ball, solid);
  std::vector<std::size_t> open;
  std::vector<Vec3> directions;
  for (std::size_t i = 0; i < ball.size(); ++i) {
    if (!ball[i].allFinite() || (ball[i].squaredNorm() < 1 && solid[i].allFinite())) continue;
    open.push_back(i);
    directions.push_back(ball[i]);
  }
  std::vector<Vec3> onSurface(open.size());
  at(directions, onSurface);
  for (std::size_t k = 0; k < open.size(); ++k)
    solid[open[k]] = center + directions[k].norm() * (onSurface[k] - center);
}

}  // namespace polestar
