#include "polestar/map/detail/foliation_table.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>

#include <tbb/task_arena.h>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

/// Points that share one test against a cell's box.
constexpr std::size_t kGroup = 16;
/// Prisms around a batch of points, a point, beyond which looking them all through does not pay.
constexpr std::size_t kMostPrisms = 16;
/// Half a slope's difference from that of the linear map of a cell, relative to the latter, up to which it is
/// trusted and beyond which it is not at all: the fit saw something else than a smooth map, or the cells are
/// too coarse for one.
constexpr double kFreeExcess = 0.4, kMostExcess = 0.8;
/// A barycentric weight, far above rounding, by which a point may miss its cell.
constexpr double kThin = 1e-6;
/// G at a node, off that of its level by more than this, is noise.
constexpr double kMostOff = 0.25;

// Cells of a prism or, beyond the prisms, the one at the center.
template <class Visit>
bool visitCells(const Foliation& f, std::size_t item, Visit&& visit) {
  const std::size_t prisms = f.layerCount() * f.triangles.size();
  if (item >= prisms) return visit(3 * prisms + (item - prisms));
  return visit(3 * item) || visit(3 * item + 1) || visit(3 * item + 2);
}

}  // namespace

FoliationTable::FoliationTable(GreenChart chart, NodeImages images, RadiusProfile radius,
                               std::optional<NodeBends> bends)
    : chart_(std::move(chart)), images_(std::move(images)), radius_(std::move(radius)) {
  const Foliation& f = chart_.foliation();
  ImageSlopes slopes = slopesOfImages(chart_, images_.ball, radius_);
  slope_ = std::move(slopes.slope);
  bends_.trust = std::move(slopes.trust);
  linear_.assign(f.nodes.size(), 0);
  nodeGreen_.assign(f.nodes.size(), 0.0);
  for (std::size_t id = f.vertexCount; id < f.centerNode(); ++id)
    nodeGreen_[id] = std::max(0.0, 1 / f.nodes[id].norm() + chart_.harmonic()[id]);
  if (bends) {
    // Where no slope could be fitted none is trusted, whatever a file says.
    for (std::size_t id = 0; id < bends_.trust.size(); ++id)
      bends_.trust[id] = std::min(bends_.trust[id], bends->trust[id]);
    for (const std::size_t id : bends->straight) makeLinear(id);
    bends_.straight = std::move(bends->straight);
  } else {
    findBends();
  }
  tree_ = treeOver(f.nodes);
}

void FoliationTable::findBends() {
  markLinear();
  limitSlopes();
  straightenFolds();
  for (std::size_t id = 0; id < linear_.size(); ++id) {
    if (linear_[id]) bends_.straight.push_back(id);
  }
}

AabbTree FoliationTable::treeOver(std::span<const Vec3> positions) const {
  const Foliation& f = chart_.foliation();
  std::vector<Bounds> boxes((f.layerCount() + 1) * f.triangles.size());
  parallelChunks(boxes.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t item = begin; item < end; ++item) {
      visitCells(f, item, [&](std::size_t cell) {
        for (const std::uint32_t node : f.cell(cell)) boxes[item].include(positions[node]);
        return false;
      });
    }
  });
  return AabbTree(boxes);
}

// By the node's level.
double FoliationTable::levelGreen(std::size_t id) const {
  const Foliation& f = chart_.foliation();
  return (1 / f.levels[id / f.vertexCount] - 1) / chart_.green().harmonicRadius();
}

// Next to the surface, where lines do not run yet, the error of G may exceed G.
bool FoliationTable::offLevel(std::size_t id) const {
  const double wanted = levelGreen(id);
  const double found = 1 / chart_.foliation().nodes[id].norm() + chart_.harmonic()[id];
  return !(std::abs(found - wanted) <= kMostOff * wanted);
}

void FoliationTable::markLinear() {
  const Foliation& f = chart_.foliation();
  std::vector<char> listed(f.nodes.size(), 0);
  for (const std::size_t id : images_.linear) listed[id] = 1;
  for (std::size_t id = f.vertexCount; id < f.centerNode(); ++id) {
    if (offLevel(id)) listed[id] = 1;
  }
  if (std::find(listed.begin(), listed.end(), 1) == listed.end()) return;
  for (std::size_t id = 0; id < f.cellCount(); ++id) {
    const auto cell = f.cell(id);
    if (std::none_of(cell.begin(), cell.end(), [&](std::uint32_t node) { return listed[node]; })) continue;
    for (const std::uint32_t node : cell) makeLinear(node);
  }
}

// Such a node stands for its level, whatever the field says there (noise, mostly).
void FoliationTable::makeLinear(std::size_t id) {
  const Foliation& f = chart_.foliation();
  linear_[id] = 1;
  bends_.trust[id] = 0;
  if (id >= f.vertexCount && id < f.centerNode()) nodeGreen_[id] = levelGreen(id);
}

// One cell, ready for many points.
class FoliationTable::CellMap {
 public:
  CellMap(const FoliationTable& table, std::size_t cell)
      : table_(table), node_(table.chart_.foliation().cell(cell)) {
    const Foliation& f = table.chart_.foliation();
    for (int k = 0; k < 4; ++k) corner_[k] = f.nodes[node_[k]];
    Mat3 edges;
    for (int k = 0; k < 3; ++k) edges.col(k) = corner_[k + 1] - corner_[0];
    const Vec3 bc = edges.col(1).cross(edges.col(2));
    const double volume = edges.col(0).dot(bc);
    positive_ = volume > 0;
    if (!positive_) return;
    weightGradient_[1] = bc / volume;
    weightGradient_[2] = edges.col(2).cross(edges.col(0)) / volume;
    weightGradient_[3] = edges.col(0).cross(edges.col(1)) / volume;
    weightGradient_[0] = -(weightGradient_[1] + weightGradient_[2] + weightGradient_[3]);
    const std::size_t layer = f.layerOf(cell);
    bounded_ = layer + 1 < f.levels.size() && f.levels[layer + 1] >= kInnermostBound;
  }

  /// An inverted or flat cell holds no point.
  bool positive() const { return positive_; }

  Vec3 place(const Eigen::Vector4d& weights) const {
    Vec3 x = Vec3::Zero();
    for (int k = 0; k < 4; ++k) x += weights[k] * corner_[k];
    return x;
  }

  Eigen::Vector4d weigh(const Vec3& x) const {
    const Vec3 p = x - corner_[0];
    Eigen::Vector4d w;
    for (int k = 1; k < 4; ++k) w[k] = weightGradient_[k].dot(p);
    w[0] = 1 - w[1] - w[2] - w[3];
    return w;
  }

  /// What does not depend on the point; needed once before evaluate().
  void prepare() {
    linearSlope_.setZero();
    anyLinear_ = false;
    for (int k = 0; k < 4; ++k) {
      image_[k] = table_.images_.ball[node_[k]];
      linearSlope_ += image_[k] * weightGradient_[k].transpose();
      h_[k] = table_.chart_.harmonic()[node_[k]];
      gradient_[k] = table_.chart_.harmonicGradient()[node_[k]];
      green_[k] = table_.nodeGreen_[node_[k]];
      isLinear_[k] = table_.linear_[node_[k]];
      anyLinear_ = anyLinear_ || isLinear_[k];
    }
    // A node without a slope takes that of the linear interpolant, which changes nothing on faces that it is
    // no corner of.
    for (int k = 0; k < 4; ++k) {
      excess_[k].setZero();
      if (const double trust = table_.bends_.trust[node_[k]]; trust > 0)
        excess_[k] = 0.5 * trust * (table_.slope_[node_[k]].cast<double>() - linearSlope_);
    }
    prepared_ = true;
  }
  bool prepared() const { return prepared_; }

  template <bool WithJacobian>
  Value evaluate(const Vec3& x, const Eigen::Vector4d& weights) const;

 private:
  friend class FoliationTable;
  /// Deep inside the bounds on G and G itself differ by a few percent: there they can end.
  static constexpr double kInnermostBound = 0.3;

  Potential potential(const Vec3& x, const Eigen::Vector4d& weights) const;

  const FoliationTable& table_;
  std::array<std::uint32_t, 4> node_;
  std::array<Vec3, 4> corner_, weightGradient_, image_, gradient_;
  std::array<double, 4> h_{}, green_{};
  std::array<Mat3, 4> excess_;
  std::array<char, 4> isLinear_{};
  Mat3 linearSlope_;
  bool positive_ = false, bounded_ = false, prepared_ = false, anyLinear_ = false;
};

void FoliationTable::limitSlopes() {
  std::vector<float> limit(bends_.trust.size(), 1);
  parallelChunks(chart_.foliation().cellCount(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t id = begin; id < end; ++id) {
      CellMap cell(*this, id);
      if (!cell.positive()) continue;
      cell.prepare();
      const Mat3 inverse = cell.linearSlope_.inverse();
      for (int k = 0; k < 4; ++k) {
        const std::uint32_t node = cell.node_[k];
        if (!(bends_.trust[node] > 0)) continue;
        const Mat3 excess = 0.5 * (slope_[node].cast<double>() - cell.linearSlope_);
        const double ratio = (inverse * excess).norm();
        const double trust = std::clamp((kMostExcess - ratio) / (kMostExcess - kFreeExcess), 0.0, 1.0);
        // The smallest of all, whoever writes it.
        std::atomic_ref<float> shared(limit[node]);
        const float wanted = std::isfinite(ratio) ? static_cast<float>(trust) : 0.0F;
        for (float known = shared.load(std::memory_order_relaxed); wanted < known;) {
          if (shared.compare_exchange_weak(known, wanted, std::memory_order_relaxed)) break;
        }
      }
    }
  });
  for (std::size_t id = 0; id < limit.size(); ++id) bends_.trust[id] *= limit[id];
}

// Whether the cell's own map turns over at its middle or near a corner.
bool FoliationTable::folds(std::size_t id) const {
  CellMap cell(*this, id);
  if (!cell.positive()) return false;
  cell.prepare();
  for (int sample = 0; sample < 5; ++sample) {
    Eigen::Vector4d weights = Eigen::Vector4d::Constant(sample < 4 ? 0.05 : 0.25);
    if (sample < 4) weights[sample] = 0.85;
    if (!(cell.evaluate<true>(cell.place(weights), weights).jacobian.determinant() > 0)) return true;
  }
  return false;
}

// Where the field is noise a cell's map can turn over though the linear one does not. Around its nodes it
// becomes linear, then; that bends the cells around, so they are looked at again.
void FoliationTable::straightenFolds() {
  const Foliation& f = chart_.foliation();
  std::vector<char> folded(f.cellCount());
  bool isFirst = true, anyChange = true;
  while (anyChange) {
    parallelChunks(f.cellCount(), 4096, [&](std::size_t begin, std::size_t end) {
      for (std::size_t id = begin; id < end; ++id) {
        const auto cell = f.cell(id);
        const auto linear = std::count_if(cell.begin(), cell.end(), [&](auto node) { return linear_[node]; });
        folded[id] = linear < 4 && (isFirst || linear > 0) && folds(id);
      }
    });
    isFirst = anyChange = false;
    for (std::size_t id = 0; id < folded.size(); ++id) {
      if (!folded[id]) continue;
      for (const std::uint32_t node : f.cell(id)) makeLinear(node);
      anyChange = true;
    }
  }
}

// h with gradients: the sum of weight (h + grad h . (x - node) / 2) is exact for quadratic h.
FoliationTable::Potential FoliationTable::CellMap::potential(const Vec3& x,
                                                             const Eigen::Vector4d& weights) const {
  double h = 0, linear = 0;
  Vec3 gradientOfH = Vec3::Zero(), gradientOfLinear = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    const double atCorner = h_[k] + 0.5 * gradient_[k].dot(x - corner_[k]);
    h += weights[k] * atCorner;
    gradientOfH += atCorner * weightGradient_[k] + 0.5 * weights[k] * gradient_[k];
    linear += weights[k] * green_[k];
    gradientOfLinear += green_[k] * weightGradient_[k];
  }
  const double r = x.norm();
  const Potential smooth{1 / r + h, gradientOfH - x / (r * r * r)};
  // Next to the surface the error of h exceeds G itself; the linear interpolant of G is 0 there and nowhere
  // else.
  if (!bounded_) return smooth;
  for (const double bound : {0.5, 2.0}) {
    if (bound < 1 ? smooth.green < bound * linear : smooth.green > bound * linear) {
      return {bound * linear, bound * gradientOfLinear};
    }
  }
  return smooth;
}

// Ball positions R * direction are nearly linear in x, at the center too; directions alone are not. So the
// direction is that of an interpolant of the images: with slopes at the nodes, the sum of
// weight (image + slope (x - node) / 2) is exact for quadratic maps.
template <bool WithJacobian>
FoliationTable::Value FoliationTable::CellMap::evaluate(const Vec3& x, const Eigen::Vector4d& weights) const {
  const double rho = table_.chart_.green().harmonicRadius();
  const Potential potential = this->potential(x, weights);
  Vec3 ball = Vec3::Zero();
  Mat3 slope = linearSlope_;
  for (int k = 0; k < 4; ++k) {
    const Vec3 addend = excess_[k] * (x - corner_[k]);
    ball += weights[k] * (image_[k] + addend);
    if constexpr (WithJacobian) slope += addend * weightGradient_[k].transpose() + weights[k] * excess_[k];
  }
  const double length = ball.norm();
  Value value;
  value.green = potential.green;
  const double greenRadius = x.squaredNorm() > 0 ? std::min(1.0, 1 / (1 + rho * potential.green)) : 0;
  const double ofGreen = table_.radius_.value(greenRadius);
  value.ballRadius = ofGreen;
  if (length > 0) value.direction = ball / length;

  // Around linear nodes the field and the table disagree; the table is one to one. Around nodes that were
  // not the two agree, so one can pass into the other. Radii are interpolated as such: the norm of the
  // interpolated images would sink between them, in thin layers below the next level.
  double tableShare = 0, linearRadius = 0;
  Vec3 slopeOfRadius = Vec3::Zero(), slopeOfShare = Vec3::Zero();
  if (anyLinear_) {
    for (int k = 0; k < 4; ++k) {
      const double radius = image_[k].norm();
      linearRadius += weights[k] * radius;
      slopeOfRadius += radius * weightGradient_[k];
      if (!isLinear_[k]) continue;
      tableShare += weights[k];
      slopeOfShare += weightGradient_[k];
    }
    tableShare = std::clamp(tableShare, 0.0, 1.0);
    value.ballRadius = (1 - tableShare) * ofGreen + tableShare * linearRadius;
    // G is what the coordinate says, too: one number in two grids.
    if (tableShare > 0) value.green = (1 / table_.radius_.inverse(std::min(1.0, value.ballRadius)) - 1) / rho;
  }
  if constexpr (WithJacobian) {
    const Vec3& u = value.direction;
    Vec3 gradientOfR = -(1 - tableShare) * table_.radius_.derivative(greenRadius) * rho * greenRadius *
                       greenRadius * potential.gradient;
    if (tableShare > 0) {
      gradientOfR += tableShare * slopeOfRadius + (linearRadius - ofGreen) * slopeOfShare;
    }
    value.jacobian = u * gradientOfR.transpose() +
                     value.ballRadius / length * (Mat3::Identity() - u * u.transpose()) * slope;
  }
  return value;
}

// False where x is outside of the cell's box by more than any weight above -kThin allows.
bool FoliationTable::mayHold(std::size_t id, const Vec3& x) const {
  Bounds box;
  for (const std::uint32_t node : chart_.foliation().cell(id)) box.include(chart_.foliation().nodes[node]);
  const double margin = 6 * kThin * (box.max - box.min).maxCoeff();
  return box.squaredDistance(x) <= margin * margin;
}

std::optional<FoliationTable::Location> FoliationTable::locate(const Vec3& x, std::size_t hint,
                                                               double slack) const {
  Location trial;
  std::optional<Location> best;
  double bestInside = -slack;
  const auto look = [&](std::size_t id) {
    if (slack < kThin && !mayHold(id, x)) return false;
    const CellMap cell(*this, id);
    if (!cell.positive()) return false;
    trial.cell = id;
    trial.weights = cell.weigh(x);
    const double inside = trial.weights.minCoeff();
    if (inside < bestInside) return false;
    bestInside = inside;
    best = trial;
    return inside >= 0;
  };
  const Foliation& f = chart_.foliation();
  if (hint < f.cellCount() && look(hint)) return best;
  tree_.visitWithin(x, 1e-24, [&](std::size_t item) { return visitCells(f, item, look); });
  return best;
}

std::optional<FoliationTable::Preimage> FoliationTable::linearInverse(const Vec3& y) const {
  std::call_once(imageTree_->once, [&] {
    // A thread that waits for the build must not begin another call of this in the meantime.
    tbb::this_task_arena::isolate([&] { imageTree_->tree = treeOver(images_.ball); });
  });
  const Foliation& f = chart_.foliation();
  std::optional<Preimage> best;
  double bestInside = -1e-6;
  imageTree_->tree.visitWithin(y, 1e-18, [&](std::size_t item) {
    return visitCells(f, item, [&](std::size_t id) {
      const auto node = f.cell(id);
      Mat3 edges;
      for (int k = 0; k < 3; ++k) edges.col(k) = images_.ball[node[k + 1]] - images_.ball[node[0]];
      const Vec3 w = edges.fullPivLu().solve(y - images_.ball[node[0]]);
      const double inside = std::min(w.minCoeff(), 1 - w.sum());
      if (!(inside > bestInside)) return false;
      bestInside = inside;
      best = {(1 - w.sum()) * f.nodes[node[0]] + w[0] * f.nodes[node[1]] + w[1] * f.nodes[node[2]] +
                  w[2] * f.nodes[node[3]],
              id};
      return inside >= 0;
    });
  });
  return best;
}

std::optional<Vec3> FoliationTable::inverseNear(const Vec3& y, std::size_t cell) const {
  constexpr int kSteps = 12;
  constexpr double kSlack = 1e-7, kTolerance = 1e-10;
  const Foliation& f = chart_.foliation();
  // Along a level: towards the center cells are needles, and all of them are near each other.
  double squaredEdge = 0;
  const auto corner = f.cell(cell);
  for (int a = 0; a < 4; ++a) {
    for (int b = 0; b < a; ++b) {
      if (corner[a] / f.vertexCount != corner[b] / f.vertexCount) continue;
      squaredEdge = std::max(squaredEdge, (images_.ball[corner[a]] - images_.ball[corner[b]]).squaredNorm());
    }
  }
  std::optional<Vec3> found;
  imageTree_->tree.visitWithin(y, squaredEdge, [&](std::size_t item) {
    return visitCells(f, item, [&](std::size_t id) {
      CellMap map(*this, id);
      if (!map.positive()) return false;
      map.prepare();
      Vec3 at = map.place(Eigen::Vector4d::Constant(0.25));
      for (int step = 0; step < kSteps; ++step) {
        const Eigen::Vector4d weights = map.weigh(at);
        if (!(weights.cwiseAbs().maxCoeff() < 3)) return false;  // on its way elsewhere
        const Value value = map.evaluate<true>(at, weights);
        const Vec3 rest = value.ballRadius * value.direction - y;
        if (rest.norm() < kTolerance) {
          if (weights.minCoeff() >= -kSlack) found = at;
          break;
        }
        at -= value.jacobian.fullPivLu().solve(rest);
      }
      return found.has_value();
    });
  });
  return found;
}

FoliationTable::Value FoliationTable::evaluate(const Vec3& x, const Location& location,
                                               bool withJacobian) const {
  CellMap cell(*this, location.cell);
  cell.prepare();
  return withJacobian ? cell.evaluate<true>(x, location.weights) : cell.evaluate<false>(x, location.weights);
}

void FoliationTable::evaluateNear(std::span<const Vec3> points, std::span<Value> values,
                                  std::span<char> found) const {
  std::fill(found.begin(), found.end(), 0);
  Bounds all;
  std::vector<Bounds> groups((points.size() + kGroup - 1) / kGroup);
  std::vector<std::size_t> open(groups.size());  // points that no cell was found for yet
  for (std::size_t i = 0; i < points.size(); ++i) {
    groups[i / kGroup].include(points[i]);
    ++open[i / kGroup];
  }
  for (const Bounds& group : groups) all.include(group);

  std::vector<std::size_t> items;
  const std::size_t most = kMostPrisms * points.size() + 1000;
  tree_.visitOverlapping(all, [&](std::size_t item) {
    items.push_back(item);
    return items.size() > most;
  });
  if (items.size() > most) return;

  const Foliation& f = chart_.foliation();
  for (const std::size_t item : items) {
    visitCells(f, item, [&](std::size_t id) {
      Bounds box;
      for (const std::uint32_t node : f.cell(id)) box.include(f.nodes[node]);
      std::optional<CellMap> cell;
      for (std::size_t g = 0; g < groups.size(); ++g) {
        if (open[g] == 0 || !groups[g].overlaps(box)) continue;
        if (!cell) cell.emplace(*this, id);
        if (!cell->positive()) return false;
        const std::size_t end = std::min(points.size(), (g + 1) * kGroup);
        for (std::size_t i = g * kGroup; i < end; ++i) {
          if (found[i] || !box.contains(points[i])) continue;
          const Eigen::Vector4d weights = cell->weigh(points[i]);
          if (weights.minCoeff() < 0) continue;
          if (!cell->prepared()) cell->prepare();
          values[i] = cell->evaluate<false>(points[i], weights);
          found[i] = 1;
          --open[g];
        }
      }
      return false;
    });
  }
}

}  // namespace polestar::detail
