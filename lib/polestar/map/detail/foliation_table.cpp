#include "polestar/map/detail/foliation_table.h"

#include <Eigen/LU>
#include <algorithm>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {

FoliationTable::FoliationTable(GreenChart chart, std::vector<Vec3> nodeDirections)
    : chart_(std::move(chart)), nodeDirections_(std::move(nodeDirections)) {
  const Foliation& f = chart_.foliation();
  std::vector<Bounds> boxes(f.cellCount());
  parallelChunks(boxes.size(), 4096, [&](std::size_t begin, std::size_t end) {
    for (std::size_t id = begin; id < end; ++id) {
      for (const std::uint32_t node : f.cell(id)) boxes[id].include(f.nodes[node]);
    }
  });
  tree_ = AabbTree(boxes);
}

bool FoliationTable::weigh(const Vec3& x, std::size_t cell, Eigen::Vector4d& weights) const {
  const Foliation& f = chart_.foliation();
  const auto node = f.cell(cell);
  const Vec3 p = x - f.nodes[node[0]], a = f.nodes[node[1]] - f.nodes[node[0]], b = f.nodes[node[2]] - f.nodes[node[0]],
             c = f.nodes[node[3]] - f.nodes[node[0]];
  const Vec3 bc = b.cross(c);
  const double volume = a.dot(bc);
  if (!(volume > 0)) return false;  // an inverted or flat cell holds no point
  weights[1] = p.dot(bc) / volume;
  weights[2] = a.dot(p.cross(c)) / volume;
  weights[3] = a.dot(b.cross(p)) / volume;
  weights[0] = 1 - weights[1] - weights[2] - weights[3];
  return true;
}

std::optional<FoliationTable::Location> FoliationTable::locate(const Vec3& x, std::size_t hint, double slack) const {
  Location trial;
  trial.cell = hint;
  if (hint < chart_.foliation().cellCount() && weigh(x, hint, trial.weights) && trial.inside()) return trial;

  std::optional<Location> best;
  double bestInside = -slack;
  tree_.visitWithin(x, 1e-24, [&](std::size_t cell) {
    trial.cell = cell;
    if (!weigh(x, cell, trial.weights)) return false;
    const double inside = trial.weights.minCoeff();
    if (inside < bestInside) return false;
    bestInside = inside;
    best = trial;
    return inside >= 0;
  });
  return best;
}

FoliationTable::Value FoliationTable::evaluate(const Vec3& x, const Location& location, bool withJacobian) const {
  const Foliation& f = chart_.foliation();
  const auto node = f.cell(location.cell);
  const double rho = chart_.green().harmonicRadius();

  // h with gradients: sum of weight (h + grad h . (x - node) / 2), exact for quadratic h.
  double h = 0;
  Vec3 direction = Vec3::Zero();
  std::array<double, 4> atCorner;
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t id = node[k];
    atCorner[k] = chart_.harmonic()[id] + 0.5 * chart_.harmonicGradient()[id].dot(x - f.nodes[id]);
    h += location.weights[k] * atCorner[k];
    if (id < nodeDirections_.size()) direction += location.weights[k] * nodeDirections_[id];
  }
  const double r = x.norm();
  Value value;
  value.green = 1 / r + h;
  value.ballRadius = std::min(1.0, 1 / (1 + rho * value.green));
  const double length = direction.norm();
  value.direction = length > 0 ? Vec3(direction / length) : Vec3(Vec3::UnitX());
  if (!(r > 0)) value.ballRadius = 0;
  if (!withJacobian) return value;

  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = f.nodes[node[k + 1]] - f.nodes[node[0]];
  const Mat3 inverse = edges.inverse();  // rows: gradients of weights 1 to 3
  Vec3 gradientOfH = Vec3::Zero();
  Mat3 slope = Mat3::Zero();             // of the unnormalized direction
  for (int k = 0; k < 4; ++k) {
    const Vec3 weightGradient = k > 0 ? Vec3(inverse.row(k - 1)) : Vec3(-inverse.colwise().sum());
    gradientOfH += weightGradient * atCorner[k] + 0.5 * location.weights[k] * chart_.harmonicGradient()[node[k]];
    if (node[k] < nodeDirections_.size()) slope += nodeDirections_[node[k]] * weightGradient.transpose();
  }
  const Vec3 gradientOfR =
      -rho * value.ballRadius * value.ballRadius * (gradientOfH - x / (r * r * r));
  const Vec3& u = value.direction;
  value.jacobian = u * gradientOfR.transpose() +
                   value.ballRadius / length * (Mat3::Identity() - u * u.transpose()) * slope;
  return value;
}

}  // namespace polestar::detail
