#include "polestar/green/detail/triangle_layer.h"

#include <algorithm>
#include <cmath>

namespace polestar::detail {
namespace {

// What both integrals share, for one evaluation point.
struct EdgeTerms {
  std::array<Vec3, 3> toCorner;    // corner - x
  std::array<double, 3> distance;  // |corner - x|
  std::array<double, 3> start;     // of edge k, measured along it from the foot of x
  std::array<double, 3> end;
  std::array<double, 3> offset;   // signed in-plane distance of edge k's line from the foot of x
  std::array<double, 3> logTerm;  // integral of 1/|x - y| along edge k
  double height;                  // of x over the plane, positive outside
  double solidAngle;              // signed, positive when x is on the inner side
};

EdgeTerms edgeTerms(const LayerTriangle& t, const Vec3& x) {
  EdgeTerms e;
  for (int k = 0; k < 3; ++k) {
    e.toCorner[k] = t.corner[k] - x;
    e.distance[k] = e.toCorner[k].norm();
  }
  e.height = -t.normal.dot(e.toCorner[0]);
  for (int k = 0; k < 3; ++k) {
    const int next = (k + 1) % 3;
    e.start[k] = t.edge[k].dot(e.toCorner[k]);
    e.end[k] = t.edge[k].dot(e.toCorner[next]);
    e.offset[k] = t.outward[k].dot(e.toCorner[k]);
    // log((r1 + s1) / (r0 + s0)), on the side where neither sum cancels.
    double numerator = e.distance[next] + e.end[k], denominator = e.distance[k] + e.start[k];
    if (e.start[k] + e.end[k] < 0) {
      numerator = e.distance[k] - e.start[k];
      denominator = e.distance[next] - e.end[k];
    }
    // 0 only on the edge itself, where the integral is infinite: keep it large and finite.
    const double floor = 1e-16 * t.length[k];
    e.logTerm[k] = std::log(std::max(numerator, floor) / std::max(denominator, floor));
  }
  const auto& w = e.toCorner;
  const auto& r = e.distance;
  double triple = w[0].dot(w[1].cross(w[2]));
  // On the plane, up to rounding, the point counts as inside the solid.
  const double size = std::max({t.length[0], t.length[1], t.length[2]});
  if (std::abs(e.height) < 1e-13 * size) triple = std::abs(triple);
  e.solidAngle = 2 * std::atan2(triple, r[0] * r[1] * r[2] + w[0].dot(w[1]) * r[2] + w[0].dot(w[2]) * r[1] +
                                            w[1].dot(w[2]) * r[0]);
  return e;
}

// Integral of 1/|x - y|, and of (y - foot)/|x - y| within the plane.
struct Moments {
  double constant;
  Vec3 linear;
};
Moments moments(const LayerTriangle& t, const EdgeTerms& e) {
  Moments m{-std::abs(e.height * e.solidAngle), Vec3::Zero()};
  for (int k = 0; k < 3; ++k) {
    const double squaredDistanceToLine = e.offset[k] * e.offset[k] + e.height * e.height;
    m.constant += e.offset[k] * e.logTerm[k];
    m.linear += 0.5 *
                (squaredDistanceToLine * e.logTerm[k] + e.end[k] * e.distance[(k + 1) % 3] -
                 e.start[k] * e.distance[k]) *
                t.outward[k];
  }
  return m;
}

}  // namespace

LayerTriangle::LayerTriangle(const Vec3& a, const Vec3& b, const Vec3& c) : corner{a, b, c} {
  normal = (b - a).cross(c - a);
  twiceArea = normal.norm();
  normal /= twiceArea;
  for (int k = 0; k < 3; ++k) {
    const Vec3 d = corner[(k + 1) % 3] - corner[k];
    length[k] = d.norm();
    edge[k] = d / length[k];
    outward[k] = edge[k].cross(normal);
  }
}

std::array<double, 3> hatPotentials(const LayerTriangle& t, const Vec3& x) {
  const EdgeTerms e = edgeTerms(t, x);
  const Moments m = moments(t, e);
  const Vec3 foot = x - e.height * t.normal;
  std::array<double, 3> result;
  for (int k = 0; k < 3; ++k) {
    // Hat k vanishes on edge k + 1 and falls along its outward normal.
    const int opposite = (k + 1) % 3;
    const double height = t.twiceArea / t.length[opposite];
    const Vec3 slope = t.outward[opposite] / -height;
    const double atFoot = slope.dot(foot - t.corner[opposite]);
    result[k] = atFoot * m.constant + slope.dot(m.linear);
  }
  return result;
}

PotentialAndGradient linearLayer(const LayerTriangle& t, const std::array<double, 3>& sigma, const Vec3& x) {
  const EdgeTerms e = edgeTerms(t, x);
  const Moments m = moments(t, e);
  const Vec3 foot = x - e.height * t.normal;
  Vec3 slope = Vec3::Zero();  // of sigma within the plane
  for (int k = 0; k < 3; ++k) {
    const int opposite = (k + 1) % 3;
    slope -= sigma[k] * t.length[opposite] / t.twiceArea * t.outward[opposite];
  }
  const double sigmaAtFoot = sigma[0] + slope.dot(foot - t.corner[0]);

  // grad = integral of grad sigma / |x - y|, minus sigma times the edge integrals, plus the normal part.
  Vec3 gradient = m.constant * slope;
  Vec3 edgeSum = Vec3::Zero();
  for (int k = 0; k < 3; ++k) {
    const double slopeAlong = (sigma[(k + 1) % 3] - sigma[k]) / t.length[k];
    const double sigmaAtStart = sigma[k] - slopeAlong * e.start[k];
    gradient -=
        (sigmaAtStart * e.logTerm[k] + slopeAlong * (e.distance[(k + 1) % 3] - e.distance[k])) * t.outward[k];
    edgeSum += e.logTerm[k] * t.outward[k];
  }
  gradient += (sigmaAtFoot * e.solidAngle + e.height * slope.dot(edgeSum)) * t.normal;
  return {sigmaAtFoot * m.constant + slope.dot(m.linear), gradient};
}

}  // namespace polestar::detail
