#include "polestar/map/detail/foliation_table.h"

#include <Eigen/LU>
#include <algorithm>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {

FoliationTable::FoliationTable(GreenChart chart, std::vector<Vec3> nodeDirections, RadiusProfile radius)
    : chart_(std::move(chart)), nodeDirections_(std::move(nodeDirections)), radius_(std::move(radius)) {
  const Foliation& f = chart_.foliation();
  nodeGreen_.assign(f.centerNode(), 0.0);
  for (std::size_t id = f.vertexCount; id < nodeGreen_.size(); ++id) {
    nodeGreen_[id] = std::max(0.0, 1 / f.nodes[id].norm() + chart_.harmonic()[id]);
  }
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
  const Vec3 p = x - f.nodes[node[0]], a = f.nodes[node[1]] - f.nodes[node[0]],
             b = f.nodes[node[2]] - f.nodes[node[0]], c = f.nodes[node[3]] - f.nodes[node[0]];
  const Vec3 bc = b.cross(c);
  const double volume = a.dot(bc);
  if (!(volume > 0)) return false;  // an inverted or flat cell holds no point
  weights[1] = p.dot(bc) / volume;
  weights[2] = a.dot(p.cross(c)) / volume;
  weights[3] = a.dot(b.cross(p)) / volume;
  weights[0] = 1 - weights[1] - weights[2] - weights[3];
  return true;
}

std::optional<FoliationTable::Location> FoliationTable::locate(const Vec3& x, std::size_t hint,
                                                               double slack) const {
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

// h with gradients: the sum of weight (h + grad h . (x - node) / 2) is exact for quadratic h.
// `weightGradients`: rows are the gradients of weights 1 to 3.
FoliationTable::Potential FoliationTable::potential(const Vec3& x, const Location& location,
                                                    const Mat3& weightGradients) const {
  const Foliation& f = chart_.foliation();
  const auto node = f.cell(location.cell);
  double h = 0, linear = 0;
  Vec3 gradientOfH = Vec3::Zero(), gradientOfLinear = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t id = node[k];
    const double weight = location.weights[k];
    const Vec3 slope = k > 0 ? Vec3(weightGradients.row(k - 1)) : Vec3(-weightGradients.colwise().sum());
    const double atCorner = chart_.harmonic()[id] + 0.5 * chart_.harmonicGradient()[id].dot(x - f.nodes[id]);
    h += weight * atCorner;
    gradientOfH += slope * atCorner + 0.5 * weight * chart_.harmonicGradient()[id];
    if (id < nodeGreen_.size()) {
      linear += weight * nodeGreen_[id];
      gradientOfLinear += nodeGreen_[id] * slope;
    }
  }
  const double r = x.norm();
  const Potential smooth{1 / r + h, gradientOfH - x / (r * r * r)};

  // Next to the surface the error of h exceeds G itself; the linear interpolant of G is 0 there and nowhere
  // else. Deep inside the two agree to a few percent, so the bounds join continuously where they end.
  constexpr double kInnermostBound = 0.3;
  const std::size_t layer = f.layerOf(location.cell);
  if (layer + 1 >= f.levels.size() || f.levels[layer + 1] < kInnermostBound) return smooth;
  for (const double bound : {0.5, 2.0}) {
    if (bound < 1 ? smooth.green < bound * linear : smooth.green > bound * linear) {
      return {bound * linear, bound * gradientOfLinear};
    }
  }
  return smooth;
}

FoliationTable::Value FoliationTable::evaluate(const Vec3& x, const Location& location,
                                               bool withJacobian) const {
  const Foliation& f = chart_.foliation();
  const auto node = f.cell(location.cell);
  const double rho = chart_.green().harmonicRadius();
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = f.nodes[node[k + 1]] - f.nodes[node[0]];
  const Mat3 weightGradients = edges.inverse();
  const Potential potential = this->potential(x, location, weightGradients);

  // Ball positions R * direction are nearly linear in x, at the center too; directions alone are not. So the
  // direction is that of the piecewise linear map from the foliation's cells to their images in the ball.
  std::array<Vec3, 4> image;
  Vec3 ball = Vec3::Zero();
  for (int k = 0; k < 4; ++k) {
    const std::uint32_t id = node[k];
    image[k] = id < nodeDirections_.size()
                   ? Vec3(radius_.value(f.levels[id / f.vertexCount]) * nodeDirections_[id])
                   : Vec3(Vec3::Zero());
    ball += location.weights[k] * image[k];
  }
  const double length = ball.norm();
  Value value;
  value.green = potential.green;
  const double greenRadius = x.squaredNorm() > 0 ? std::min(1.0, 1 / (1 + rho * potential.green)) : 0;
  value.ballRadius = radius_.value(greenRadius);
  value.direction = length > 0 ? Vec3(ball / length) : Vec3(Vec3::UnitX());
  if (!withJacobian) return value;

  Mat3 slope = Mat3::Zero();  // of the linear image
  for (int k = 0; k < 4; ++k) {
    const Vec3 weightGradient =
        k > 0 ? Vec3(weightGradients.row(k - 1)) : Vec3(-weightGradients.colwise().sum());
    slope += image[k] * weightGradient.transpose();
  }
  const Vec3 gradientOfRadius =
      -radius_.derivative(greenRadius) * rho * greenRadius * greenRadius * potential.gradient;
  const Vec3& u = value.direction;
  value.jacobian = u * gradientOfRadius.transpose() +
                   value.ballRadius / length * (Mat3::Identity() - u * u.transpose()) * slope;
  return value;
}

}  // namespace polestar::detail
