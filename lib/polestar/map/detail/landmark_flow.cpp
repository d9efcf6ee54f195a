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
constexpr double kHalfTurn = 175 * kDegree;
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

}  // namespace

LandmarkFlow::LandmarkFlow(std::span<const LandmarkPair> pairs, const BallMotion& motion, bool fine)
    : pairs_(pairs.begin(), pairs.end()) {
  TriMesh sphere = icosphere(kUsualLevel);
  if (fine && closest(pairs) < kEdgesBetween * edgeLength(sphere)) sphere = icosphere(kFineLevel);
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

// The turn that takes a pair to its target and, by its spin there, its neighbours as close to theirs as that
// can: places that turn about each other go round in arcs, where straight ways would pass through one
// another.
Vec3 LandmarkFlow::wayOf(std::size_t k, std::span<const Vec3> now) const {
  const Vec3& target = pairs_[k].to;
  const Mat3 shortest = Eigen::Quaterniond::FromTwoVectors(now[k], target).toRotationMatrix();
  const double wide = kEdgesBetween * resolution_;
  double along = 0, across = 0;
  for (std::size_t j = 0; j < pairs_.size(); ++j) {
    const double distance = (now[j] - now[k]).squaredNorm() + wide * wide;
    const double weight = pairs_[j].weight / (distance * distance);
    const Vec3 place = shortest * now[j];
    along += weight * (place.dot(pairs_[j].to) - place.dot(target) * pairs_[j].to.dot(target));
    across += weight * target.dot(place.cross(pairs_[j].to));
  }
  double spin = std::atan2(across, along);
  // About half a turn may go either way, but must do so for all pairs alike.
  if (spin < -kHalfTurn) spin += 2 * std::numbers::pi;
  const Eigen::AngleAxisd turn(Mat3(Eigen::AngleAxisd(spin, target) * shortest));
  // Of the two ways round, the one of the spin.
  const bool other = spin * turn.axis().dot(target) < 0;
  const Vec3 velocity = (other ? turn.angle() - 2 * std::numbers::pi : turn.angle()) * turn.axis();
  return velocity - now[k] * now[k].dot(velocity);
}

LandmarkFlow::Remaining LandmarkFlow::remaining() const {
  Remaining left;
  for (std::size_t k = 0; k < pairs_.size(); ++k) left.now.push_back(image(k));
  double squares = 0;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    left.angle.push_back(std::atan2(left.now[k].cross(pairs_[k].to).norm(), left.now[k].dot(pairs_[k].to)));
    left.ahead.push_back(wayOf(k, left.now));
    left.farthest = std::max(left.farthest, left.angle[k]);
    left.longest = std::max(left.longest, left.ahead[k].norm());
    squares += pairs_[k].weight * left.ahead[k].squaredNorm();
  }
  left.rms = std::sqrt(squares / static_cast<double>(pairs_.size()));
  return left;
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
  Remaining left = remaining();
  std::vector<Vec3> field(table_.to.size());
  for (int step = 0; step < kMostSteps && left.farthest > tolerance; ++step) {
    context.throwIfCancelled();
    const double share = std::min(1.0, kLongestStep / left.longest);
    std::vector<SphereSpline::Demand> demands;
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      demands.push_back({left.now[k], share * left.ahead[k], pairs_[k].weight});
    const SphereSpline spline(demands, resolution_);
    parallelChunks(field.size(), kChunk, context, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) field[i] = spline(table_.to[i]);
    });
    const double advanced = advance(field);
    if (advanced == 0) break;
    obstacle_ = Obstacle::none;
    const double before = left.rms;
    left = remaining();
    if (!(left.rms < (1 - kGain * share * advanced) * before)) break;
  }
  return samples || left.farthest <= tolerance ? std::string() : reason(left);
}

std::string LandmarkFlow::reason(const Remaining& left) const {
  const auto worst = std::max_element(left.angle.begin(), left.angle.end()) - left.angle.begin();
  std::ostringstream text;
  text.precision(3);
  text << "pair " << worst + 1 << " is still " << left.angle[worst] / kDegree << " degrees off: ";
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
