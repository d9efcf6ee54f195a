#include "polestar/mesh/detail/triangulate.h"

#include <algorithm>
#include <cmath>
#include <queue>

namespace polestar::detail {
namespace {

using Vec2 = Eigen::Vector2d;

double cross(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

/// The corners in the polygon's best-fitting plane (normal by Newell's sum), counter-clockwise.
std::vector<Vec2> flattened(std::span<const std::int32_t> polygon, std::span<const Vec3> vertices) {
  const Vec3 origin = vertices[polygon[0]];
  Vec3 normal = Vec3::Zero();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 a = vertices[polygon[i]] - origin, b = vertices[polygon[(i + 1) % polygon.size()]] - origin;
    normal += a.cross(b);
  }
  const double length = normal.norm();
  normal = length > 0 ? Vec3(normal / length) : Vec3::UnitZ();
  int axis = 0;
  normal.cwiseAbs().minCoeff(&axis);
  const Vec3 u = normal.cross(Vec3::Unit(axis)).normalized(), v = normal.cross(u);
  std::vector<Vec2> plane;
  plane.reserve(polygon.size());
  for (const std::int32_t corner : polygon) {
    const Vec3 d = vertices[corner] - origin;
    plane.emplace_back(d.dot(u), d.dot(v));
  }
  return plane;
}

/// One polygon's shrinking outline.
class EarClipper {
 public:
  EarClipper(std::vector<Vec2> points, std::int64_t& budget) : points_(std::move(points)), budget_(budget) {
    const auto n = static_cast<std::int32_t>(points_.size());
    next_.resize(n);
    previous_.resize(n);
    version_.assign(n, 0);
    for (std::int32_t i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
    }
    for (std::int32_t i = 0; i < n; ++i) {
      if (turn(i) <= 0) reflex_.push_back(i);
    }
    for (std::int32_t i = 0; i < n; ++i) enqueue(i);
  }

  /// Emits local indices (previous, ear, next); false when the budget is spent.
  template <class Emit>
  bool run(Emit&& emit) {
    std::size_t left = points_.size();
    while (left > 3) {
      if (budget_ < 0) return false;
      const std::int32_t ear = best();
      emit(previous_[ear], ear, next_[ear]);
      clip(ear);
      --left;
    }
    std::int32_t last = 0;
    while (next_[last] < 0) ++last;
    emit(previous_[last], last, next_[last]);
    return true;
  }

 private:
  struct Candidate {
    double quality;  ///< negative for what is no ear
    std::int32_t corner, version;
    bool operator<(const Candidate& other) const {
      return quality != other.quality ? quality < other.quality : corner > other.corner;
    }
  };

  double turn(std::int32_t i) const { return cross(points_[previous_[i]], points_[i], points_[next_[i]]); }

  /// An ear turns left and holds no other reflex corner.
  bool isEar(std::int32_t i) {
    if (turn(i) <= 0) return false;
    const std::int32_t p = previous_[i], n = next_[i];
    const Vec2 &a = points_[p], &b = points_[i], &c = points_[n];
    for (const std::int32_t r : reflex_) {
      if (--budget_ < 0) return false;
      if (next_[r] < 0 || r == p || r == i || r == n) continue;
      const Vec2& x = points_[r];
      if (x == a || x == b || x == c) continue;  // outlines that touch themselves name a point twice
      if (cross(a, b, x) >= 0 && cross(b, c, x) >= 0 && cross(c, a, x) >= 0) return false;
    }
    return true;
  }

  /// Smallest angle's sine, squared and scaled; below zero for corners that are no ears, least bad last.
  double quality(std::int32_t i) {
    --budget_;
    const Vec2 &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
    const double twiceArea = turn(i);
    const double longest = std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
    if (longest == 0) return 0;
    const double shape = twiceArea / longest;
    return isEar(i) ? shape : -2 + std::clamp(shape, -1.0, 1.0);
  }

  void enqueue(std::int32_t i) { queue_.push({quality(i), i, version_[i]}); }

  std::int32_t best() {
    for (;;) {
      const Candidate top = queue_.top();
      queue_.pop();
      if (next_[top.corner] < 0 || version_[top.corner] != top.version) continue;
      // A corner that was no ear may have become one when a reflex corner elsewhere was clipped or
      // straightened.
      if (top.quality < 0 && !rechecked_) {
        rechecked_ = true;
        for (std::int32_t i = next_[top.corner]; i != top.corner; i = next_[i]) renew(i);
        renew(top.corner);
        continue;
      }
      return top.corner;
    }
  }

  void renew(std::int32_t i) {
    ++version_[i];
    enqueue(i);
  }

  void clip(std::int32_t ear) {
    const std::int32_t p = previous_[ear], n = next_[ear];
    next_[p] = n;
    previous_[n] = p;
    next_[ear] = -1;
    rechecked_ = false;
    if (reflex_.size() > 32 && ++clipped_ * 2 > static_cast<std::int64_t>(reflex_.size())) {
      std::erase_if(reflex_, [&](std::int32_t r) { return next_[r] < 0 || turn(r) > 0; });
      clipped_ = 0;
    }
    renew(p);
    renew(n);
  }

  std::vector<Vec2> points_;
  std::int64_t& budget_;
  std::vector<std::int32_t> next_, previous_, version_;
  std::vector<std::int32_t> reflex_;
  std::priority_queue<Candidate> queue_;
  std::int64_t clipped_ = 0;
  bool rechecked_ = false;
};

}  // namespace

bool Triangulator::operator()(std::span<const std::int32_t> polygon, std::vector<Triangle>& triangles) {
  if (polygon.size() == 4) {
    cutQuad(polygon, triangles);
    return true;
  }
  return clipEars(polygon, triangles);
}

void Triangulator::cutQuad(std::span<const std::int32_t> q, std::vector<Triangle>& triangles) const {
  const auto normal = [&](int a, int b, int c) {
    const Vec3 n = (vertices_[q[b]] - vertices_[q[a]]).cross(vertices_[q[c]] - vertices_[q[a]]);
    const double length = n.norm();
    return length > 0 ? Vec3(n / length) : Vec3(Vec3::Zero());
  };
  // How well the two halves agree, 1 for a flat convex quad; a dent shows as -1 along the wrong diagonal.
  const double along02 = normal(0, 1, 2).dot(normal(0, 2, 3)), along13 = normal(0, 1, 3).dot(normal(1, 2, 3));
  const double length02 = (vertices_[q[2]] - vertices_[q[0]]).norm(),
               length13 = (vertices_[q[3]] - vertices_[q[1]]).norm();
  // Ties (flat quads, rectangles) are decided by the shorter diagonal, then by vertex numbers, never by
  // rounding.
  constexpr double kTie = 1e-6;
  bool use02 = std::min(q[0], q[2]) < std::min(q[1], q[3]);
  if (std::abs(along02 - along13) > kTie) {
    use02 = along02 > along13;
  } else if (std::abs(length02 - length13) > kTie * (length02 + length13)) {
    use02 = length02 < length13;
  }
  if (use02) {
    triangles.insert(triangles.end(), {{q[0], q[1], q[2]}, {q[0], q[2], q[3]}});
  } else {
    triangles.insert(triangles.end(), {{q[0], q[1], q[3]}, {q[1], q[2], q[3]}});
  }
}

bool Triangulator::clipEars(std::span<const std::int32_t> polygon, std::vector<Triangle>& triangles) {
  EarClipper clipper(flattened(polygon, vertices_), budget_);
  return clipper.run([&](std::int32_t a, std::int32_t b, std::int32_t c) {
    triangles.push_back({polygon[a], polygon[b], polygon[c]});
  });
}

}  // namespace polestar::detail
