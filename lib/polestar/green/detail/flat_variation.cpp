#include "polestar/green/detail/flat_variation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "polestar/green/detail/segment_integrals.h"

namespace polestar::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;
// Farther away from a triangle than this times its radius, its pieces need not be looked at one by one.
constexpr double kApart = 2;

// Integral of lineIntegral1 over d from 0: what a path away from the segment collects.
double path(double length, double d) {
  return d > 0 ? 2 * d * std::asinh(length / (2 * d)) + length * std::asinh(2 * d / length) : 0;
}
// The same over a range of signed distances.
double path(double length, double from, double to) {
  if (from > to) std::swap(from, to);
  if (from >= 0) return path(length, to) - path(length, from);
  if (to <= 0) return path(length, -from) - path(length, -to);
  return path(length, -from) + path(length, to);
}

}  // namespace

FlatVariation::FlatVariation(const TriMesh& mesh, std::span<const double> density, const LayerJumps& jumps,
                             const LayerMajorants& majorants)
    : mesh_(mesh), density_(density), majorants_(majorants), jumps_(jumps) {}

Patch FlatVariation::patch(std::size_t t) const {
  const Piece own{mesh_.corner(t, 0), mesh_.corner(t, 1), mesh_.corner(t, 2)};
  const Ball ball = ballAround(own);
  LayerMajorants::Surroundings around = majorants_.around(ball, jumps_.normal[t], kReach * 2 * ball.radius);
  Patch result;
  result.quadratureError_ = around.quadratureError;
  result.bend_ = around.bend;
  const Vec3& normal = jumps_.normal[t];
  auto alongPlane = [&](const Vec3& v) { return Vec3(v - v.dot(normal) * normal); };
  const std::vector<std::uint32_t>& patch = around.patch;
  for (const std::uint32_t s : patch) {
    Patch::Side side{flatTriangle(mesh_, jumps_, s)};
    double least = kInfinity, most = -kInfinity;
    for (int k = 0; k < 3; ++k) {
      least = std::min(least, density_[mesh_.triangles[s][k]]);
      most = std::max(most, density_[mesh_.triangles[s][k]]);
      addEdge(t, s, static_cast<std::size_t>(jumps_.edges.edgeOf(3 * s + k)), patch, result);
    }
    if (s == t) continue;
    side.density = std::max(std::abs(least), std::abs(most));
    side.oneSign = least >= 0 || most <= 0;
    side.tilt = alongPlane(jumps_.normal[s]).norm();
    side.slope = alongPlane(jumps_.slope[s]).norm();
    if (!(side.tilt > 0)) continue;
    result.sides_.push_back(side);
  }
  return result.narrowed(own);
}

// Adds an edge of triangle s to the patch of triangle t: the jump of conormals where it is counted with one
// of the patch's triangles, that of the slopes as far as they are the patch's.
void FlatVariation::addEdge(std::size_t t, std::uint32_t s, std::size_t e,
                            const std::vector<std::uint32_t>& patch, Patch& result) const {
  const LayerJumps::Edge jumps = jumps_.edge(e);
  const Vec3& normal = jumps_.normal[t];
  const Mat3 project = Mat3::Identity() - normal * normal.transpose();
  Patch::Edge edge;
  edge.a = jumps.a;
  edge.b = jumps.b;
  edge.length = jumps.length;
  Mat3 slopeJump = Mat3::Zero();
  for (const std::int32_t side : jumps_.edges.sides(e)) {
    const auto triangle = static_cast<std::uint32_t>(side / 3);
    if (!std::binary_search(patch.begin(), patch.end(), triangle)) continue;
    if (triangle < s) return;  // added there
    slopeJump += jumps_.slope[triangle] * jumps_.conormal[side].transpose();
    if (triangle == jumps_.owner(e)) edge.jump = jumps.density * (project * jumps.jump).norm();
    if (triangle == t) {
      edge.own = true;
      edge.across = jumps_.conormal[side];
    }
  }
  // Along an own edge both conormals are at right angles to it: across it is the only way to see them change.
  edge.slopeJump =
      edge.own ? (project * slopeJump * edge.across).norm() : (project * slopeJump * project).norm();
  if (edge.jump > 0 || edge.slopeJump > 0) result.edges_.push_back(edge);
}

// What the integral of 1/r over an edge collects along a path within the piece, at most: for an own edge
// along the distance from it; for an edge that meets the piece in a corner, at an angle, since the distance
// grows from there.
double Patch::alongPaths(const Edge& e, const Piece& piece, double length) {
  if (e.own) {
    double low = kInfinity, high = -kInfinity;
    for (const Vec3& p : piece) {
      const double across = (p - e.a).dot(e.across);
      low = std::min(low, across);
      high = std::max(high, across);
    }
    return path(e.length, low, high);
  }
  double least = kInfinity;
  for (int k = 0; k < 3; ++k) {
    const bool atA = piece[k] == e.a, atB = piece[k] == e.b;
    if (!atA && !atB) continue;
    const Vec3 along = (atA ? e.b - e.a : e.a - e.b) / e.length;
    const Vec3 u = (piece[(k + 1) % 3] - piece[k]).normalized(),
               v = (piece[(k + 2) % 3] - piece[k]).normalized();
    // The direction within the corner's angle that is nearest to the edge: the edge's shadow, if it falls
    // there.
    double cosine = std::max(along.dot(u), along.dot(v));
    const Vec3 normal = u.cross(v).normalized(), shadow = along - along.dot(normal) * normal;
    if (u.cross(shadow).dot(normal) >= 0 && shadow.cross(v).dot(normal) >= 0) cosine = shadow.norm();
    const double sine = cosine > 0 ? std::sqrt(std::max(0.0, 1 - cosine * cosine)) : 1;
    if (sine > 0) least = std::min(least, 2 / sine * path(e.length, 0.5 * sine * length));
  }
  return least;
}

Patch Patch::narrowed(const Piece& piece) const {
  const Ball ball = ballAround(piece);
  Patch result;
  result.quadratureError_ = quadratureError_;
  result.bend_ = bend_;
  for (const Edge& e : edges_) {
    const double d = distanceToSegment(ball.center, e.a, e.b) - ball.radius;
    if (d > kApart * ball.radius) {
      result.bend_ += e.jump * lineIntegral2(e.length, d) + e.slopeJump * lineIntegral1(e.length, d);
    } else {
      result.edges_.push_back(e);
    }
  }
  for (const Side& s : sides_) {
    const double d = distanceTo(s, ball.center) - ball.radius;
    if (d > kApart * ball.radius) {
      result.bend_ +=
          s.tilt * (2 * s.density * areaIntegral3(s.area, d) + s.slope * std::min(2 * kPi, s.area / (d * d)));
    } else {
      result.sides_.push_back(s);
    }
  }
  return result;
}

double Patch::variation(const Piece& piece) const {
  const Ball ball = ballAround(piece);
  const double rho = ball.radius, half = 0.5 * rho * rho;
  const double reach = (1 + 1e-9) * rho;  // what touches the piece must not seem to be a rounding error away
  double length = 0;
  for (int k = 0; k < 3; ++k) length = std::max(length, (piece[(k + 1) % 3] - piece[k]).norm());

  // The pole and the triangles far away, by their second derivatives.
  const double toPole = std::max(0.0, ball.center.norm() - rho);
  double sum = half * (2 / (toPole * toPole * toPole) + bend_);

  for (const Edge& e : edges_) {
    const double d = std::max(0.0, distanceToSegment(ball.center, e.a, e.b) - reach);
    const double once = lineIntegral1(e.length, d);
    double first = rho * once, second = half * once;
    if (d < rho) {
      const double along = alongPaths(e, piece, length);
      first = std::min(first, along);
      second = std::min(second, rho * along);
    }
    if (e.jump > 0) sum += e.jump * std::min(first, half * lineIntegral2(e.length, d));
    if (e.slopeJump > 0) sum += e.slopeJump * second;
  }

  for (const Side& s : sides_) {
    const double d = std::max(0.0, distanceTo(s, ball.center) - reach);
    const double angle = largestSolidAngle(s, piece);
    // A double layer: by its second derivatives or by its size. While the piece lies on one side of it, its
    // potential has one sign, and all but half of it is a constant.
    const double share = s.oneSign && liesOnOneSide(s, piece) ? 0.5 : 1;
    sum += s.tilt * (s.density * std::min(half * 2 * areaIntegral3(s.area, d), share * rho * angle) +
                     s.slope * half * angle);
  }
  return std::isnan(sum) ? kInfinity : sum;
}

}  // namespace polestar::detail
