#include "polestar/map/ball_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "polestar/chart/untangle.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/predicates.h"
#include "polestar/map/detail/core_isotopy.h"
#include "polestar/map/detail/direction_map.h"
#include "polestar/map/detail/foliation_table.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {

using detail::CoreIsotopy;
using detail::FoliationTable;

namespace {

constexpr std::size_t kChunk = 512;
const Vec3 kNowhere = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

// A_R(omega) s(R) at the nodes. Where repairs moved a node it keeps being a sample of the map, at its new
// place; unless that turns cells inside out: then it stands for its level and line.
NodeImages imagesOfNodes(const GreenChart& chart, const CoreIsotopy& isotopy, std::span<const Vec3> phi,
                         const RadiusProfile& profile) {
  const Foliation& f = chart.foliation();
  const std::span<const Vec3> omega = chart.directions();
  NodeImages images;
  images.ball.assign(f.nodes.size(), Vec3::Zero());
  const auto ofLine = [&](std::size_t id) {
    const double radius = f.levels[id / f.vertexCount];
    const std::size_t vertex = id % f.vertexCount;
    return Vec3(profile.value(radius) * isotopy.direction(radius, omega[vertex], phi[vertex]));
  };
  for (std::size_t id = 0; id < f.centerNode(); ++id) images.ball[id] = ofLine(id);
  if (chart.movedNodes().empty()) return images;

  const detail::DirectionMap boundaryOf(omega, phi, f.triangles);
  std::vector<char> sampled(f.nodes.size(), 0);
  for (std::size_t m = 0; m < chart.movedNodes().size(); ++m) {
    const double radius = chart.movedCanonical()[m].norm();
    if (!(radius > 0)) continue;
    const Vec3 direction = chart.movedCanonical()[m] / radius;
    const std::optional<Vec3> to = boundaryOf(direction);
    if (!to) continue;
    images.ball[chart.movedNodes()[m]] = profile.value(radius) * isotopy.direction(radius, direction, *to);
    sampled[chart.movedNodes()[m]] = 1;
  }
  for (bool changed = true; changed;) {
    changed = false;
    for (const std::size_t cell : badCells(f, images.ball)) {
      for (const std::uint32_t id : f.cell(cell)) {
        if (!sampled[id]) continue;
        sampled[id] = 0;
        images.ball[id] = ofLine(id);
        changed = true;
      }
    }
  }
  for (const std::size_t id : chart.movedNodes()) {
    if (!sampled[id]) images.linear.push_back(id);
  }
  return images;
}

// Turns over the few cells that the blend of the core leaves inverted, by moving images within their levels
// below the core's outermost. Fails by leaving `images` as they were; where they are many, at once: that is
// not what moving a few images can mend, and it would take minutes to find out.
bool untangleCore(const Foliation& f, double coreRadius, const RadiusProfile& profile,
                  std::vector<Vec3>& images) {
  constexpr int kRings[] = {1, 2, 4};
  // A share of the core's cells, or so many of a small one; where it succeeded there were 25 at most.
  constexpr double kMostShare = 1e-3, kFew = 100;
  const auto outer =
      std::find_if(f.levels.begin(), f.levels.end(), [&](double r) { return r < coreRadius; }) - 1;
  const auto skipped = static_cast<std::ptrdiff_t>(f.vertexCount) * (outer - f.levels.begin());
  Foliation core;
  core.vertexCount = f.vertexCount;
  core.triangles = f.triangles;
  core.levels.assign(outer, f.levels.end());
  core.nodes.assign(images.begin() + skipped, images.end());
  const std::size_t bad = countCells(core).bad();
  const double most = std::max(kFew, kMostShare * static_cast<double>(core.cellCount()));
  if (static_cast<double>(bad) > most) return false;
  if (bad < countCells(f, images).bad()) return false;  // some lie above
  for (const int rings : kRings) {
    for (const std::size_t id : untangle(core, rings, Context::quiet()).movedNodes) {
      Vec3& image = core.nodes[id];
      image = profile.value(core.levels[id / core.vertexCount]) * image.normalized();
    }
    if (countCells(core).bad() > 0) continue;
    std::copy(core.nodes.begin(), core.nodes.end(), images.begin() + skipped);
    return true;
  }
  return false;
}

std::size_t countLevelFlips(const Foliation& f, const std::vector<Vec3>& images) {
  std::size_t flips = 0;
  for (std::size_t level = 0; level < f.levels.size(); ++level) {
    flips += countFlips(std::span(images).subspan(f.nodeId(level, 0), f.vertexCount), f.triangles);
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
  CellCounts imageCells;
  FoliationTable table;
  SphereLocator surface;   // the surface seen from the center
  SphereLocator boundary;  // phi

  static std::shared_ptr<const Data> make(GreenChart chart, SphereMap sphere, const BallMapOptions& options,
                                          RadiusProfile radius, std::string coreFallbackReason,
                                          NodeImages images, std::optional<NodeBends> bends) {
    const TriMesh& mesh = chart.green().shape().mesh();
    const std::size_t flips = countLevelFlips(chart.foliation(), images.ball);
    CellCounts cells = countCells(chart.foliation(), images.ball);
    SphereLocator surface(mesh.vertices, mesh.triangles), boundary(sphere.directions, mesh.triangles);
    FoliationTable table(chart, std::move(images), radius, std::move(bends));
    return std::make_shared<const Data>(Data{std::move(chart), std::move(sphere), options, std::move(radius),
                                             std::move(coreFallbackReason), flips, std::move(cells),
                                             std::move(table), std::move(surface), std::move(boundary)});
  }

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
  struct Preimage {
    Vec3 x;
    double miss;  ///< in the ball
  };
  /// From a start x.
  Preimage improve(Vec3 x, const Vec3& y, std::size_t& hint) const;
};

Vec3 BallMap::Data::invert(const Vec3& y, std::size_t& hint) const {
  constexpr double kAcceptable = 1e-7;
  const double length = y.norm();
  if (!(length <= 1 + 1e-9)) return kNowhere;
  if (length == 0) return Vec3::Zero();
  Preimage best = improve(guess(y), y, hint);
  if (best.miss < kAcceptable) return best.x;
  // The right cell to start in costs a second tree; few points need it.
  if (const auto start = table.linearInverse(y)) {
    const Preimage second = improve(start->x, y, hint);
    if (second.miss < best.miss) best = second;
    if (best.miss < kAcceptable) return best.x;
    if (const std::optional<Vec3> found = table.inverseNear(y, start->cell)) return *found;
  }
  // R reaches 1 a little inside where h is interpolated: accept what lies that close to the boundary.
  const double nearBoundary = 1e-3 * std::max(1.0, radius.derivative(1));
  return length > 0.98 && best.miss < nearBoundary ? best.x : kNowhere;
}

// Newton's method with step halving on the piecewise smooth table.
BallMap::Data::Preimage BallMap::Data::improve(Vec3 x, const Vec3& y, std::size_t& hint) const {
  constexpr int kIterations = 50, kHalvings = 12;
  constexpr double kTolerance = 1e-13;
  auto value = at(x, hint, true);
  for (int pull = 0; !value && pull < 60; ++pull) {
    x *= 1 - 1e-9 * std::pow(2.0, pull);  // just outside the surface: towards the center
    value = at(x, hint, true);
  }
  if (!value) return {kNowhere, HUGE_VAL};
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
  return {x, rest.norm()};
}

BallMap::BallMap(GreenChart chart, SphereMap sphere, const BallMapOptions& options, RadiusProfile radius) {
  options.validate();
  const Foliation& f = chart.foliation();
  BallMapOptions used = options;
  if (sphere.kind == SphereMapKind::fieldLine) used.core = CoreMode::paper;  // the identity is a rotation
  std::string reason;
  const std::vector<double> area = vertexAreas(chart.green().shape().mesh());
  auto build = [&] {
    const CoreIsotopy isotopy(chart.directions(), sphere.directions, area,
                              used.core == CoreMode::smooth ? used.coreRadius : 0.0);
    return imagesOfNodes(chart, isotopy, sphere.directions, radius);
  };
  NodeImages images = build();
  if (used.core == CoreMode::smooth && sphere.flips == 0) {
    // A wider core turns more slowly from level to level.
    std::string found;
    for (const double wider : {options.coreRadius, 1.6 * options.coreRadius, 2.4 * options.coreRadius}) {
      if (wider >= 1) break;
      used.coreRadius = wider;
      images = build();
      std::size_t cells = countCells(f, images.ball).bad();
      if (cells > 0 && untangleCore(f, wider, radius, images.ball)) cells = 0;
      const std::size_t flips = countLevelFlips(f, images.ball);
      if (flips + cells == 0) {
        found.clear();
        break;
      }
      if (found.empty()) {
        found = "the smooth core would flip " + std::to_string(flips) +
                " triangles over its levels and turn " + std::to_string(cells) + " cells inside out";
      }
    }
    if (!found.empty()) {
      reason = found + "; the paper's core is used, with a kink at the center";
      used = options;
      used.core = CoreMode::paper;
      images = build();
    }
  }
  data_ = Data::make(std::move(chart), std::move(sphere), used, std::move(radius), std::move(reason),
                     std::move(images), std::nullopt);
}

BallMap::BallMap(GreenChart chart, SphereMap sphere, const BallMapOptions& options, RadiusProfile radius,
                 NodeImages nodeImages, std::optional<NodeBends> nodeBends)
    : data_(Data::make(std::move(chart), std::move(sphere), options, std::move(radius), "",
                       std::move(nodeImages), std::move(nodeBends))) {}

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
    std::vector<Vec3> inner(end - begin);
    for (std::size_t i = begin; i < end; ++i) inner[i - begin] = d.frame().toInner(solid[i]);
    std::vector<FoliationTable::Value> values(inner.size());
    std::vector<char> found(inner.size());
    d.table.evaluateNear(inner, values, found);
    std::size_t hint = 0;
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3& x = inner[i - begin];
      std::optional<FoliationTable::Value> value;
      if (found[i - begin]) {
        value = values[i - begin];
      } else {
        value = d.at(x, hint, false);
      }
      if (value) {
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
const NodeImages& BallMap::nodeImages() const { return data_->table.images(); }
const NodeBends& BallMap::nodeBends() const { return data_->table.bends(); }
const CellCounts& BallMap::imageCells() const { return data_->imageCells; }
std::size_t BallMap::levelFlips() const { return data_->levelFlips; }

}  // namespace polestar
