#include "polestar/map/ball_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/predicates.h"
#include "polestar/map/detail/core_isotopy.h"
#include "polestar/map/detail/foliation_table.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {

using detail::CoreIsotopy;
using detail::FoliationTable;

namespace {

constexpr std::size_t kChunk = 512;
const Vec3 kNowhere = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

std::vector<Vec3> directionsAtNodes(const Foliation& f, const CoreIsotopy& isotopy,
                                    std::span<const Vec3> omega, std::span<const Vec3> phi) {
  std::vector<Vec3> directions(f.centerNode());
  for (std::size_t level = 0; level < f.levels.size(); ++level) {
    for (std::size_t i = 0; i < f.vertexCount; ++i) {
      directions[f.nodeId(level, i)] = isotopy.direction(f.levels[level], omega[i], phi[i]);
    }
  }
  return directions;
}

std::size_t countLevelFlips(const Foliation& f, const std::vector<Vec3>& directions) {
  std::size_t flips = 0;
  for (std::size_t level = 0; level < f.levels.size(); ++level) {
    flips += countFlips(std::span(directions).subspan(f.nodeId(level, 0), f.vertexCount), f.triangles);
  }
  return flips;
}

}  // namespace

void BallMapOptions::validate() const {
  if (!(coreRadius > 0 && coreRadius < 1))
    throw Error(Errc::usage, "BallMapOptions: coreRadius must lie in (0, 1)");
}

struct BallMap::Data {
  GreenChart chart;
  SphereMap sphere;
  BallMapOptions options;
  RadiusProfile radius;
  std::string coreFallbackReason;
  std::size_t levelFlips;
  FoliationTable table;
  SphereLocator surface;   // the surface seen from the center
  SphereLocator boundary;  // phi

  const Frame& frame() const { return chart.green().shape().frame(); }

  /// Where the ray from the center through x leaves the solid.
  std::optional<SphereLocator::Hit> exit(const Vec3& x) const { return surface.locate(x); }

  /// The table's value, also for points that rounding puts between the cells; nothing outside the solid.
  std::optional<FoliationTable::Value> at(const Vec3& x, std::size_t& hint, bool withJacobian) const {
    if (!x.allFinite()) return std::nullopt;
    std::optional<FoliationTable::Location> found = table.locate(x, hint);
    if (!found) {
      // Inside by the surface, yet in no cell: cells are inverted around here. The nearest one answers.
      const auto hit = exit(x);
      if (!hit || x.squaredNorm() > surface.point(*hit).squaredNorm() * (1 + 1e-12)) return std::nullopt;
      found = table.locate(x, hint, 1e3);
      if (!found) return std::nullopt;
    }
    hint = found->cell;
    return table.evaluate(x, *found, withJacobian);
  }

  /// First guess of the inverse: the triangle of phi around the direction, carried down its column of prisms.
  Vec3 guess(const Vec3& y) const {
    const Foliation& f = chart.foliation();
    const double greenRadius = radius.inverse(y.norm());
    std::size_t layer = 0;
    while (layer + 1 < f.levels.size() && f.levels[layer + 1] > greenRadius) ++layer;
    const auto hit = boundary.locate(y);
    if (!hit) return 0.5 * greenRadius * chart.green().harmonicRadius() * y.normalized();
    const Triangle& t = f.triangles[hit->triangle];
    auto at = [&](std::size_t level) {
      Vec3 p = Vec3::Zero();
      for (int k = 0; k < 3; ++k) p += hit->weights[k] * f.node(level, t[k]);
      return p;
    };
    if (layer + 1 == f.levels.size()) return greenRadius / f.levels.back() * at(layer);
    const double share = (f.levels[layer] - greenRadius) / (f.levels[layer] - f.levels[layer + 1]);
    return (1 - share) * at(layer) + share * at(layer + 1);
  }

  Vec3 invert(const Vec3& y, std::size_t& hint) const;
};

// Newton's method with step halving on the piecewise smooth table.
Vec3 BallMap::Data::invert(const Vec3& y, std::size_t& hint) const {
  constexpr int kIterations = 50, kHalvings = 12;
  constexpr double kTolerance = 1e-13, kAcceptable = 1e-7;
  const double length = y.norm();
  if (!(length <= 1 + 1e-9)) return kNowhere;
  if (length == 0) return Vec3::Zero();

  Vec3 x = guess(y);
  auto value = at(x, hint, true);
  for (int pull = 0; !value && pull < 60; ++pull) {
    x *= 1 - 1e-9 * std::pow(2.0, pull);  // just outside the surface: towards the center
    value = at(x, hint, true);
  }
  if (!value) return kNowhere;
  Vec3 rest = value->ballRadius * value->direction - y;
  for (int i = 0; i < kIterations && rest.norm() > kTolerance; ++i) {
    const Vec3 step = value->jacobian.fullPivLu().solve(rest);
    bool improved = false;
    double share = 1;
    for (int halving = 0; halving < kHalvings && !improved; ++halving, share *= 0.5) {
      const Vec3 trial = x - share * step;
      const auto trialValue = at(trial, hint, true);
      if (!trialValue) continue;
      const Vec3 trialRest = trialValue->ballRadius * trialValue->direction - y;
      if (trialRest.norm() < rest.norm()) {
        x = trial;
        value = trialValue;
        rest = trialRest;
        improved = true;
      }
    }
    if (!improved) break;
  }
  // R reaches 1 a little inside where h is interpolated: accept what lies that close to the boundary.
  const double nearBoundary = 1e-3 * std::max(1.0, radius.derivative(1));
  return rest.norm() < std::max(kAcceptable, length > 0.98 ? nearBoundary : 0.0) ? x : kNowhere;
}

BallMap::BallMap(GreenChart chart, SphereMap sphere, const BallMapOptions& options, RadiusProfile radius) {
  options.validate();
  const TriMesh& mesh = chart.green().shape().mesh();
  const Foliation& f = chart.foliation();
  BallMapOptions used = options;
  if (sphere.kind == SphereMapKind::fieldLine) used.core = CoreMode::paper;  // the identity is a rotation
  std::string reason;
  const std::vector<double> area = vertexAreas(mesh);
  auto build = [&] {
    return directionsAtNodes(f,
                             CoreIsotopy(chart.directions(), sphere.directions, area,
                                         used.core == CoreMode::smooth ? used.coreRadius : 0.0),
                             chart.directions(), sphere.directions);
  };
  std::vector<Vec3> directions = build();
  std::size_t flips = countLevelFlips(f, directions);
  if (used.core == CoreMode::smooth && flips > 0 && sphere.flips == 0) {
    reason = "the smooth core would flip " + std::to_string(flips) +
             " triangles over its levels; the paper's core is used, with a kink at the center";
    used.core = CoreMode::paper;
    directions = build();
    flips = countLevelFlips(f, directions);
  }
  SphereLocator surface(mesh.vertices, mesh.triangles), boundary(sphere.directions, mesh.triangles);
  FoliationTable table(chart, std::move(directions), radius);
  data_ = std::make_shared<const Data>(Data{std::move(chart), std::move(sphere), used, std::move(radius),
                                            std::move(reason), flips, std::move(table), std::move(surface),
                                            std::move(boundary)});
}

void BallMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  detail::parallelChunks(solid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t hint = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto value = data_->at(data_->frame().toInner(solid[i]), hint, false);
      domain[i] = value ? Vec3(value->ballRadius * value->direction) : kNowhere;
    }
  });
}

void BallMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  detail::parallelChunks(domain.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t hint = 0;
    for (std::size_t i = begin; i < end; ++i)
      solid[i] = data_->frame().toWorld(data_->invert(domain[i], hint));
  });
}

void BallMap::jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const {
  detail::parallelChunks(solid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t hint = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const auto value = data_->at(data_->frame().toInner(solid[i]), hint, true);
      if (value) {
        derivative[i] = value->jacobian / data_->frame().unit;
      } else {
        derivative[i].setConstant(std::numeric_limits<double>::quiet_NaN());
      }
    }
  });
}

void BallMap::sample(std::span<const Vec3> solid, std::span<Vec3> domain, std::span<double> green) const {
  const Data& d = *data_;
  detail::parallelChunks(solid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    std::size_t hint = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 x = d.frame().toInner(solid[i]);
      if (const auto value = d.at(x, hint, false)) {
        domain[i] = value->ballRadius * value->direction;
        green[i] = std::max(0.0, value->green) / d.frame().unit;
        continue;
      }
      green[i] = 0;
      domain[i] = kNowhere;
      if (const auto hit = d.exit(x)) {
        const Triangle& t = d.chart.foliation().triangles[hit->triangle];
        Vec3 phi = Vec3::Zero();
        for (int k = 0; k < 3; ++k) phi += hit->weights[k] * d.sphere.directions[t[k]];
        domain[i] = x.norm() / d.surface.point(*hit).norm() * phi.normalized();
      }
    }
  });
}

const GreenChart& BallMap::chart() const { return data_->chart; }
const SphereMap& BallMap::sphere() const { return data_->sphere; }
const RadiusProfile& BallMap::radius() const { return data_->radius; }
const BallMapOptions& BallMap::options() const { return data_->options; }
const std::string& BallMap::coreFallbackReason() const { return data_->coreFallbackReason; }
std::span<const Vec3> BallMap::nodeDirections() const { return data_->table.nodeDirections(); }
std::size_t BallMap::levelFlips() const { return data_->levelFlips; }

}  // namespace polestar
