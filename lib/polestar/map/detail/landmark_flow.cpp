#include "polestar/map/detail/landmark_flow.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "polestar/core/detail/parallel.h"
#include "polestar/map/detail/sphere_spline.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 256;
constexpr double kDegree = std::numbers::pi / 180;
constexpr int kUsualLevel = 5, kFineLevel = 6;  // of the icosphere
/// Edges that should lie between two pairs for the flow to tell them apart.
constexpr double kEdgesBetween = 3;
/// A Moebius part with a pull above 1/sqrt(2) moves directions by more than a right angle, which the straight
/// way back to a rotation may not undo.
constexpr double kLongestPull = 0.65;
/// Of the pairs in one step. The field is that of the step's beginning; over so short ways it changes little.
constexpr double kLongestStep = 5 * kDegree;
/// No step changes the determinant of a triangle by more than this factor: what the field does between its
/// vertices is still what it does at them.
constexpr double kSqueeze = 2;
constexpr double kShortestStep = 1.0 / 64;
constexpr int kMostSteps = 100;
/// Of what is left, in a step that others may follow.
constexpr double kGain = 0.02;

/// Of two unit vectors: the shortest turn from `a` to `b`, axis times angle.
Vec3 turnBetween(const Vec3& a, const Vec3& b) {
  const Vec3 cross = a.cross(b);
  const double sine = cross.norm();
  if (!(sine > 0)) return a.dot(b) > 0 ? Vec3(Vec3::Zero()) : Vec3(std::numbers::pi * a.unitOrthogonal());
  return std::atan2(sine, a.dot(b)) / sine * cross;
}

Vec3 turned(const Vec3& x, const Vec3& turn) {
  const double angle = turn.norm();
  return angle > 0 ? Vec3(Eigen::AngleAxisd(angle, turn / angle) * x) : x;
}

double closest(std::span<const LandmarkPair> pairs) {
  double squared = 4;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      squared = std::min({squared, (pairs[i].from - pairs[j].from).squaredNorm(),
                          (pairs[i].to - pairs[j].to).squaredNorm()});
    }
  }
  return std::sqrt(squared);
}

double edgeLength(const TriMesh& sphere) {
  return std::sqrt(4 / std::sqrt(3.0) * 4 * std::numbers::pi / static_cast<double>(sphere.triangles.size()));
}

double determinant(const Triangle& t, std::span<const Vec3> p) {
  return p[t[0]].dot((p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]));
}

double largestNorm(std::span<const Vec3> vectors) {
  double most = 0;
  for (const Vec3& v : vectors) most = std::max(most, v.norm());
  return most;
}

double rms(std::span<const LandmarkPair> pairs, std::span<const Vec3> remaining) {
  double squares = 0;
  for (std::size_t k = 0; k < pairs.size(); ++k) squares += pairs[k].weight * remaining[k].squaredNorm();
  return std::sqrt(squares / static_cast<double>(pairs.size()));
}

}  // namespace

LandmarkFlow::LandmarkFlow(std::span<const LandmarkPair> pairs, const BallMotion& motion)
    : pairs_(pairs.begin(), pairs.end()) {
  TriMesh sphere = icosphere(kUsualLevel);
  if (closest(pairs) < kEdgesBetween * edgeLength(sphere)) sphere = icosphere(kFineLevel);
  resolution_ = edgeLength(sphere);
  table_.from = std::move(sphere.vertices);
  table_.triangles = std::move(sphere.triangles);
  const double pull = motion.pull().norm();
  const BallMotion start(motion.rotation(), motion.pull() * std::min(1.0, kLongestPull / pull));
  for (const Vec3& u : table_.from) table_.to.push_back(start.ofDirection(u));
  const SphereLocator locator(table_.from, table_.triangles);
  for (const LandmarkPair& pair : pairs_) place_.push_back(*locator.locate(pair.from));
}

Vec3 LandmarkFlow::image(std::size_t k) const {
  const Triangle& t = table_.triangles[place_[k].triangle];
  Vec3 sum = Vec3::Zero();
  for (int c = 0; c < 3; ++c) sum += place_[k].weights[c] * table_.to[t[c]];
  return sum.normalized();
}

std::vector<Vec3> LandmarkFlow::remaining() const {
  std::vector<Vec3> turns;
  for (std::size_t k = 0; k < pairs_.size(); ++k) turns.push_back(turnBetween(image(k), pairs_[k].to));
  return turns;
}

LandmarkFlow::Obstacle LandmarkFlow::obstacleAt(const ShellTable& moved) const {
  for (const Triangle& t : moved.triangles) {
    const double ratio = determinant(t, moved.to) / determinant(t, table_.to);
    if (!(ratio > 1 / kSqueeze && ratio < kSqueeze)) return Obstacle::fold;
  }
  if (countFlips(moved.to, moved.triangles) > 0) return Obstacle::fold;
  return foldedTriangles(moved, coreRotation(moved)).empty() ? Obstacle::none : Obstacle::core;
}

double LandmarkFlow::advance(std::span<const Vec3> field) {
  ShellTable moved = table_;
  for (double share = 1; share >= kShortestStep; share /= 2) {
    parallelChunks(moved.to.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) moved.to[i] = turned(table_.to[i], share * field[i]);
    });
    obstacle_ = obstacleAt(moved);
    if (obstacle_ != Obstacle::none) continue;
    table_.to.swap(moved.to);
    return share;
  }
  return 0;
}

std::string LandmarkFlow::run(double tolerance, bool samples, const Context& context) {
  std::vector<Vec3> left = remaining(), field(table_.to.size());
  for (int step = 0; step < kMostSteps; ++step) {
    context.throwIfCancelled();
    const double farthest = largestNorm(left), before = rms(pairs_, left);
    if (farthest <= tolerance) return {};
    const double share = std::min(1.0, kLongestStep / farthest);
    std::vector<SphereSpline::Demand> demands;
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      demands.push_back({image(k), share * left[k], pairs_[k].weight});
    const SphereSpline spline(demands, resolution_);
    parallelChunks(field.size(), kChunk, context, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) field[i] = spline(table_.to[i]);
    });
    const double advanced = advance(field);
    if (advanced == 0) break;
    left = remaining();
    obstacle_ = Obstacle::none;
    if (!(rms(pairs_, left) < (1 - kGain * share * advanced) * before)) break;
  }
  return samples || largestNorm(left) <= tolerance ? std::string() : reason(left);
}

std::string LandmarkFlow::reason(std::span<const Vec3> left) const {
  std::size_t worst = 0;
  for (std::size_t k = 0; k < left.size(); ++k) {
    if (left[k].squaredNorm() > left[worst].squaredNorm()) worst = k;
  }
  std::ostringstream text;
  text.precision(3);
  text << "pair " << worst + 1 << " is still " << left[worst].norm() / kDegree << " degrees off: ";
  switch (obstacle_) {
    case Obstacle::fold:
      text << "the surface would have to fold, as where pairs pass through one another";
      break;
    case Obstacle::core:
      text << "the core could no longer turn it back into a rotation without a fold";
      break;
    case Obstacle::none:
      text << "it is closer to another pair than " << resolution_ / kDegree
           << " degrees, and they do not move alike";
      break;
  }
  return text.str();
}

}  // namespace polestar::detail
