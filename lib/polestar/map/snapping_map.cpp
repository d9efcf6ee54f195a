#include "polestar/map/snapping_map.h"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "polestar/core/error.h"

namespace polestar {
namespace {

// Just below the surface, where a Jacobian is asked for that has none on it.
constexpr double kBelow = 1 - 1e-9;

/// What `forward` and `jacobian` ask again: the points that had no answer.
template <class Value>
std::vector<std::size_t> withoutAnswer(std::span<const Value> values) {
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!values[i].allFinite()) found.push_back(i);
  }
  return found;
}

std::vector<Vec3> chosen(std::span<const Vec3> points, const std::vector<std::size_t>& which) {
  std::vector<Vec3> result;
  result.reserve(which.size());
  for (const std::size_t i : which) result.push_back(points[i]);
  return result;
}

/// BallMap::sample's continuation has |y| = |x - c| / |q - c|, q on the surface below x.
double distanceOutside(const Vec3& x, const Vec3& center, const Vec3& continued) {
  if (!continued.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  const double norm = continued.norm();
  return norm > 1 ? (x - center).norm() * (1 - 1 / norm) : 0;
}

}  // namespace

SnappingMap::SnappingMap(BallMap table, std::shared_ptr<const VolumeMap> map, double relativeReach)
    : table_(std::move(table)),
      map_(std::move(map)),
      surface_(table_),
      center_(table_.chart().green().shape().frame().origin),
      solidReach_(relativeReach * boundingBox(table_.chart().green().shape().surface().mesh()).diagonal()),
      ballReach_(relativeReach * std::sqrt(12.0)) {
  if (!(relativeReach >= 0 && std::isfinite(relativeReach)))
    throw Error(Errc::usage, "SnappingMap: the reach must be a finite number from 0");
}

void SnappingMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  map_->forward(solid, domain);
  const std::vector<std::size_t> open = withoutAnswer(std::span<const Vec3>(domain));
  if (open.empty()) return;
  const std::vector<Vec3> points = chosen(solid, open);
  std::vector<Vec3> continued(open.size());
  std::vector<double> green(open.size());
  table_.sample(points, continued, green);
  for (std::size_t k = 0; k < open.size(); ++k) {
    const double outside = distanceOutside(points[k], center_, continued[k]);
    if (!(outside <= solidReach_)) continue;
    domain[open[k]] = continued[k] / std::max(1.0, continued[k].norm());
    if (outside == 0) ++answeredByTable_;
  }
}

void SnappingMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  std::vector<Vec3> pulled(domain.begin(), domain.end());
  std::vector<std::size_t> onSphere;
  for (std::size_t i = 0; i < pulled.size(); ++i) {
    const double norm = pulled[i].norm();
    if (norm >= 1 && norm <= 1 + ballReach_) {
      pulled[i] /= norm;
      onSphere.push_back(i);
    }
  }
  map_->inverse(pulled, solid);
  // The maps come near the surface; its own points are known.
  const std::vector<Vec3> directions = chosen(pulled, onSphere);
  std::vector<Vec3> places(onSphere.size());
  surface_.at(directions, places);
  for (std::size_t k = 0; k < onSphere.size(); ++k) solid[onSphere[k]] = places[k];
}

void SnappingMap::jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const {
  map_->jacobian(solid, derivative);
  const std::vector<std::size_t> open = withoutAnswer(std::span<const Mat3>(derivative));
  if (open.empty()) return;
  std::vector<Vec3> points = chosen(solid, open), continued(open.size());
  std::vector<double> green(open.size());
  table_.sample(points, continued, green);
  for (std::size_t k = 0; k < open.size(); ++k) {
    const double outside = distanceOutside(points[k], center_, continued[k]);
    if (!(outside <= solidReach_)) continue;
    const double scale = kBelow / std::max(1.0, continued[k].norm());
    points[k] = center_ + scale * (points[k] - center_);
  }
  std::vector<Mat3> again(open.size());
  table_.jacobian(points, again);
  for (std::size_t k = 0; k < open.size(); ++k) derivative[open[k]] = again[k];
}

void SnappingMap::outsideSolid(std::span<const Vec3> solid, std::span<double> distance) const {
  std::vector<Vec3> continued(solid.size());
  std::vector<double> green(solid.size());
  table_.sample(solid, continued, green);
  for (std::size_t i = 0; i < solid.size(); ++i)
    distance[i] = distanceOutside(solid[i], center_, continued[i]);
}

void SnappingMap::outsideBall(std::span<const Vec3> domain, std::span<double> distance) {
  for (std::size_t i = 0; i < domain.size(); ++i) {
    const double norm = domain[i].norm();
    distance[i] = domain[i].allFinite() ? (norm > 1 ? norm - 1 : 0) : norm;
  }
}

}  // namespace polestar
