#include "polestar/green/detail/slope_variation.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "polestar/green/detail/segment_integrals.h"

namespace polestar::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kPi = std::numbers::pi;
// Farther away from a piece than this times its radius, its own pieces need not be looked at one by one.
constexpr double kApart = 2;

Vec3 normalOf(const Piece& piece) { return (piece[1] - piece[0]).cross(piece[2] - piece[0]).normalized(); }

}  // namespace

SlopeVariation::SlopeVariation(const TriMesh& mesh, std::span<const double> density, const LayerJumps& jumps,
                               const LayerMajorants& majorants)
    : mesh_(mesh), density_(density), majorants_(majorants), jumps_(jumps) {}

SlopePatch SlopeVariation::patch(const Piece& piece) const {
  const Ball ball = ballAround(piece);
  const LayerMajorants::Charges around = majorants_.chargesAround(ball, kReach * 2 * ball.radius);
  const Vec3 normal = normalOf(piece);
  SlopePatch result;
  result.bend_ = 0.5 * 6 * around.fourth;
  for (const std::uint32_t s : around.patch) {
    for (int k = 0; k < 3; ++k)
      addEdge(normal, s, static_cast<std::size_t>(jumps_.edges.edgeOf(3 * s + k)), around.patch, result);
    const SlopePatch::Side side{flatTriangle(mesh_, jumps_, s), jumps_.slope[s].norm()};
    if (side.slope > 0) result.sides_.push_back(side);
  }
  return result.narrowed(piece);
}

// Adds an edge of triangle s, with those of its triangles that belong to the patch.
void SlopeVariation::addEdge(const Vec3& normal, std::uint32_t s, std::size_t e,
                             const std::vector<std::uint32_t>& patch, SlopePatch& result) const {
  const LayerJumps::Edge whole = jumps_.edge(e);
  Vec3 conormals = Vec3::Zero();
  Mat3 slopeJump = Mat3::Zero();
  for (const std::int32_t side : jumps_.edges.sides(e)) {
    const auto triangle = static_cast<std::uint32_t>(side / 3);
    if (!std::binary_search(patch.begin(), patch.end(), triangle)) continue;
    if (triangle < s) return;  // added there
    const Vec3 &across = jumps_.conormal[side], &up = jumps_.normal[triangle],
               &slope = jumps_.slope[triangle];
    conormals += across;
    slopeJump += across * slope.transpose() - across.dot(slope) * up * up.transpose();
  }
  SlopePatch::Edge edge{whole.a, whole.b, whole.length, whole.density * conormals.norm(),
                        (slopeJump - slopeJump * normal * normal.transpose()).norm()};
  if (edge.jump > 0 || edge.slopeJump > 0) result.edges_.push_back(edge);
}

// What an edge's share of the second derivatives, (pi/r) times the path's step across the edge, collects
// along a straight path within the piece: seen along the edge's line, the path's shadow passes the line's
// point at a distance m and is at most as long as that of the piece.
double SlopePatch::alongPaths(const Edge& e, const Piece& piece) {
  const Vec3 along = (e.b - e.a) / e.length;
  Piece shadow;
  for (int k = 0; k < 3; ++k) {
    const Vec3 offset = piece[k] - e.a;
    shadow[k] = offset - offset.dot(along) * along;
  }
  double longest = 0, nearest = kInfinity, turns = 0;
  bool left = true, right = true;
  std::array<double, 3> turn{};
  for (int k = 0; k < 3; ++k) {
    const Vec3 &a = shadow[k], &b = shadow[(k + 1) % 3];
    const double side = (b - a).norm();
    longest = std::max(longest, side);
    nearest = std::min(nearest, side > 0 ? distanceToSegment(Vec3::Zero(), a, b) : a.norm());
    turn[k] = a.cross(b).dot(along);
    turns = std::max(turns, std::abs(turn[k]));
  }
  constexpr double kRounding = 1e-12;
  for (const double t : turn) {
    left = left && t >= -kRounding * turns;
    right = right && t <= kRounding * turns;
  }
  if (left || right || !(nearest > 0)) return kInfinity;  // the line meets the piece
  return kPi * 2 * std::asinh(longest / (2 * nearest));
}

SlopePatch SlopePatch::narrowed(const Piece& piece) const {
  const Ball ball = ballAround(piece);
  SlopePatch result;
  result.bend_ = bend_;
  for (const Edge& e : edges_) {
    const double d = distanceToSegment(ball.center, e.a, e.b) - ball.radius;
    if (d > kApart * ball.radius) {
      result.bend_ += e.jump * lineIntegral3(e.length, d) + 0.5 * e.slopeJump * lineIntegral2(e.length, d);
    } else {
      result.edges_.push_back(e);
    }
  }
  for (const Side& s : sides_) {
    const double d = distanceTo(s, ball.center) - ball.radius;
    if (d > kApart * ball.radius) {
      result.bend_ += s.slope * areaIntegral3(s.area, d);
    } else {
      result.sides_.push_back(s);
    }
  }
  return result;
}

double SlopePatch::variation(const Piece& piece) const {
  const Ball ball = ballAround(piece);
  const double rho = ball.radius, squared = rho * rho;
  const double reach = (1 + 1e-9) * rho;  // what touches the piece must not seem to be a rounding error away

  // The pole and what is far away, by third derivatives.
  const double toPole = std::max(0.0, ball.center.norm() - rho);
  double sum = squared * (3 / (toPole * toPole * toPole * toPole) + bend_);

  for (const Edge& e : edges_) {
    double d = std::max(0.0, distanceToSegment(ball.center, e.a, e.b) - reach);
    if (d < rho) d = (1 - 1e-9) * distanceBetween(piece, e.a, e.b);
    if (e.jump > 0) {
      double jump = std::min(squared * lineIntegral3(e.length, d), rho * lineIntegral2(e.length, d));
      if (d < rho) jump = std::min(jump, alongPaths(e, piece));
      sum += e.jump * jump;
    }
    if (e.slopeJump > 0) {
      sum += e.slopeJump *
             std::min(rho * lineIntegral1(e.length, d), 0.5 * squared * lineIntegral2(e.length, d));
    }
  }

  for (const Side& s : sides_) {
    const double d = std::max(0.0, distanceTo(s, ball.center) - reach);
    // While the piece lies on one side of a triangle, all but half of its solid angle is a constant.
    const double share = liesOnOneSide(s, piece) ? 0.5 : 1;
    sum += s.slope * std::min(squared * areaIntegral3(s.area, d), share * rho * largestSolidAngle(s, piece));
  }
  return std::isnan(sum) ? kInfinity : sum;
}

}  // namespace polestar::detail
