#include "polestar/sphere/sphere_locator.h"

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/predicates.h"

namespace polestar {

struct SphereLocator::Data {
  std::vector<Vec3> directions;
  std::vector<Triangle> triangles;
  std::vector<char> usable;
  detail::AabbTree tree;
};

SphereLocator::SphereLocator(std::span<const Vec3> directions, std::vector<Triangle> triangles)
    : data_(std::make_unique<Data>()) {
  data_->directions.assign(directions.begin(), directions.end());
  data_->triangles = std::move(triangles);
  std::vector<detail::Bounds> boxes;
  boxes.reserve(data_->triangles.size());
  for (const Triangle& t : data_->triangles) {
    const Vec3 a = directions[t[0]].normalized(), b = directions[t[1]].normalized(),
               c = directions[t[2]].normalized();
    data_->usable.push_back(orientDirections(directions[t[0]], directions[t[1]], directions[t[2]]) > 0);
    detail::Bounds box;
    for (const Vec3& p : {a, b, c}) box.include(p);
    // The spherical triangle bulges over the flat one by at most the rest of the radius over its plane.
    const Vec3 normal = (b - a).cross(c - a);
    const double length = normal.norm();
    const double height = length > 0 ? std::abs(normal.dot(a)) / length : 0;
    const Vec3 margin = Vec3::Constant(1 - std::min(1.0, height) + 1e-12);
    box.min -= margin;
    box.max += margin;
    boxes.push_back(box);
  }
  data_->tree = detail::AabbTree(boxes);
}

SphereLocator::~SphereLocator() = default;
SphereLocator::SphereLocator(SphereLocator&&) noexcept = default;
SphereLocator& SphereLocator::operator=(SphereLocator&&) noexcept = default;

std::optional<SphereLocator::Hit> SphereLocator::locate(const Vec3& direction) const {
  constexpr double kTolerance = 1e-9;  // a query on a seam must not fall between two triangles
  const Vec3 u = direction.normalized();
  std::optional<Hit> best;
  double bestInside = -kTolerance;
  data_->tree.visitContaining(u, [&](std::size_t t) {
    if (!data_->usable[t]) return false;
    const Vec3 &a = data_->directions[data_->triangles[t][0]], &b = data_->directions[data_->triangles[t][1]],
               &c = data_->directions[data_->triangles[t][2]];
    Vec3 w(u.dot(b.cross(c)), u.dot(c.cross(a)), u.dot(a.cross(b)));
    const double sum = w.sum();
    if (!(sum > 0)) return false;
    w /= sum;
    const double inside = w.minCoeff();
    if (inside >= bestInside) {
      bestInside = inside;
      best = Hit{t, w};
    }
    return inside >= 0;
  });
  return best;
}

Vec3 SphereLocator::point(const Hit& hit) const {
  const Triangle& t = data_->triangles[hit.triangle];
  return hit.weights[0] * data_->directions[t[0]] + hit.weights[1] * data_->directions[t[1]] +
         hit.weights[2] * data_->directions[t[2]];
}

}  // namespace polestar
