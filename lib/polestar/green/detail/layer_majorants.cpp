#include "polestar/green/detail/layer_majorants.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

constexpr std::uint32_t kLeaf = 4;
// A node counts as one point with a spread when its radius is below this share of its distance.
constexpr double kOpening = 0.2;

// Gauss's rule of five points on [0, 1], exact to degree 9.
constexpr int kGauss = 5;
constexpr std::array<double, kGauss> kGaussPoint{0.046910077030668, 0.230765344947158, 0.5, 0.769234655052842,
                                                 0.953089922969332};
constexpr std::array<double, kGauss> kGaussWeight{0.118463442528095, 0.239314335249683, 0.284444444444444,
                                                  0.239314335249683, 0.118463442528095};

// Degrees up to here are computed, the rest is bounded.
constexpr int kDegree = 5;

// Mean of |x - y|^-k over charges with center c, spread m2 = sum q |y - c|^2, all within `radius` of x's
// distance: Taylor's formula about c, whose linear term vanishes; the second derivatives of r^-k are at most
// k (k + 1)/r^(k+2).
template <int k>
double spreadKernel(double weight, double spread, double distance, double nearest) {
  return weight / std::pow(distance, k) + 0.5 * k * (k + 1) * spread / std::pow(nearest, k + 2);
}

double farthestCorner(const TriMesh& mesh, std::size_t t, const Vec3& from) {
  double squared = 0;
  for (int k = 0; k < 3; ++k) squared = std::max(squared, (mesh.corner(t, k) - from).squaredNorm());
  return std::sqrt(squared);
}

}  // namespace

LayerJumps::LayerJumps(const TriMesh& mesh, std::span<const double> density)
    : edges(mesh.triangles, mesh.vertices.size()), vertices_(mesh.vertices), density_(density) {
  const std::size_t count = mesh.triangles.size();
  normal.resize(count);
  slope.resize(count, Vec3::Zero());
  conormal.resize(3 * count);
  for (std::size_t t = 0; t < count; ++t) {
    const Vec3 areaVector =
        (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
    normal[t] = areaVector.normalized();
    for (int k = 0; k < 3; ++k) {
      const Vec3 across = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).cross(normal[t]);
      conormal[3 * t + k] = across.normalized();
      // The hat function of the opposite corner falls across the edge.
      slope[t] -= density[mesh.triangles[t][(k + 2) % 3]] / areaVector.norm() * across;
    }
  }
}

LayerJumps::Edge LayerJumps::edge(std::size_t e) const {
  const auto& [i, j] = edges.ends(e);
  Edge result;
  result.a = vertices_[i];
  result.b = vertices_[j];
  result.length = (result.b - result.a).norm();
  result.density = std::max(std::abs(density_[i]), std::abs(density_[j]));
  for (const std::int32_t side : edges.sides(e)) result.jump += conormal[side];
  return result;
}

void LayerMajorants::Tilts::add(double w, const Vec3& v) {
  const double length = v.norm();
  if (!(length > 0)) return;
  weight += w * length;
  form += w / length * v * v.transpose();
}

void LayerMajorants::Tilts::add(const Tilts& other) {
  weight += other.weight;
  form += other.form;
}

double LayerMajorants::Tilts::along(const Vec3& normal) const {
  constexpr double kRounding = 1e-14;
  const double trace = form.trace();
  return std::sqrt(weight * (std::max(0.0, trace - normal.dot(form * normal)) + kRounding * trace));
}

void LayerMajorants::Bend::add(const Bend& other) {
  charge.add(other.charge);
  jump.add(other.jump);
  slope.add(other.slope);
}

double LayerMajorants::Bend::at(double distance, const Vec3& normal) const {
  return (2 * charge.along(normal) / distance + jump.along(normal) + slope.along(normal)) /
         (distance * distance);
}

LayerMajorants::LayerMajorants(const TriMesh& mesh, const LayerQuadrature& quadrature,
                               std::span<const double> density, const LayerJumps& jumps)
    : items_(mesh.triangles.size()), order_(mesh.triangles.size()) {
  parallelChunks(items_.size(), 256, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) items_[t] = itemOf(mesh, t, quadrature, density, jumps);
  });
  std::iota(order_.begin(), order_.end(), 0u);
  nodes_.reserve(items_.size());
  build(0, static_cast<std::uint32_t>(items_.size()));
}

LayerMajorants::Item LayerMajorants::itemOf(const TriMesh& mesh, std::size_t t,
                                            const LayerQuadrature& quadrature,
                                            std::span<const double> density, const LayerJumps& jumps) const {
  Item item;
  const NearField::Sphere sphere = quadrature.near().nearSphere(t);
  item.centroid = sphere.center;
  item.nearRadius = sphere.radius;
  const double area = quadrature.area(t), radius = farthestCorner(mesh, t, item.centroid);
  std::array<double, 3> sigma{};
  for (int k = 0; k < 3; ++k) sigma[k] = density[mesh.triangles[t][k]];

  // The density at the points of a product rule, then the charges with opposite sign.
  constexpr std::size_t kCount = kGauss * kGauss + 3;
  std::array<double, kCount> x, y, z, charge;
  std::array<double, kCount> magnitude;
  std::size_t count = 0;
  auto put = [&](const Vec3& p, double q, double absolute) {
    x[count] = p[0];
    y[count] = p[1];
    z[count] = p[2];
    charge[count] = q;
    magnitude[count++] = absolute;
  };
  for (int i = 0; i < kGauss; ++i) {
    for (int j = 0; j < kGauss; ++j) {
      const double s = kGaussPoint[i], v = kGaussPoint[j] * (1 - s);
      const std::array<double, 3> hat{1 - s - v, s, v};
      const double weight = 2 * area * kGaussWeight[i] * kGaussWeight[j] * (1 - s);
      double value = 0, absolute = 0;
      for (int k = 0; k < 3; ++k) {
        value += hat[k] * sigma[k];
        absolute += hat[k] * std::abs(sigma[k]);
      }
      put(hat[0] * mesh.corner(t, 0) + hat[1] * mesh.corner(t, 1) + hat[2] * mesh.corner(t, 2),
          weight * value, weight * absolute);
    }
  }
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += magnitude[i];
  item.radius = radius;
  item.bend.charge.add(sum, jumps.normal[t]);
  item.bend.slope.add(area, jumps.slope[t]);
  for (int k = 0; k < 3; ++k) {
    const auto e = static_cast<std::size_t>(jumps.edges.edgeOf(3 * t + k));
    if (jumps.owner(e) != t) continue;
    const LayerJumps::Edge edge = jumps.edge(e);
    item.bend.jump.add(edge.length * edge.density, edge.jump);
  }

  for (int k = 0; k < 3; ++k) {
    const double q = area / 6 * (sigma[k] + sigma[(k + 1) % 3]);
    put(0.5 * (mesh.corner(t, k) + mesh.corner(t, (k + 1) % 3)), -q, std::abs(q));
  }
  std::array<double, expansionSize(kDegree)> moments{};
  addMultipole(kDegree, {item.centroid, radius}, {x.data(), y.data(), z.data(), count}, charge.data(),
               moments.data());
  // At the distance where the closed form begins to fade, the higher degrees weigh most.
  const double share = radius / (NearField::kBlendFrom * item.nearRadius), cube = radius * radius * radius;
  for (int n = 3; n <= kDegree; ++n) {
    double squared = 0;
    for (int i = n * n; i < (n + 1) * (n + 1); ++i) squared += moments[i] * moments[i];
    item.defect += cube * std::sqrt(squared) * std::pow(share, n - 3);
  }
  double rest = 0;
  for (std::size_t i = 0; i < count; ++i)
    rest += magnitude[i] *
            std::pow((Vec3(x[i], y[i], z[i]) - item.centroid).squaredNorm() / (radius * radius), 3);
  item.defect += cube * rest * std::pow(share, kDegree - 2) / (1 - share);
  // The charges are softened: softening^2/(2 r^3) of difference, and no two points are farther apart than 2.
  item.defect += sum * quadrature.places().squaredSoftening;
  return item;
}

std::uint32_t LayerMajorants::build(std::uint32_t begin, std::uint32_t end) {
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  nodes_.emplace_back();
  Node node;
  node.begin = begin;
  node.end = end;
  Vec3 low = Vec3::Constant(1e300), high = -low;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Item& item = items_[order_[i]];
    low = low.cwiseMin(item.centroid);
    high = high.cwiseMax(item.centroid);
    node.bend.add(item.bend);
    node.defect += item.defect;
    node.defectCenter += item.defect * item.centroid;
    node.nearRadius = std::max(node.nearRadius, item.nearRadius);
  }
  node.middle = 0.5 * (low + high);
  node.defectCenter = node.defect > 0 ? Vec3(node.defectCenter / node.defect) : node.middle;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Item& item = items_[order_[i]];
    node.defectSpread += item.defect * (item.centroid - node.defectCenter).squaredNorm();
    // The center of the defects lies within the same ball.
    node.radius = std::max(node.radius, (item.centroid - node.middle).norm() + item.radius);
  }
  if (end - begin > kLeaf) {
    int axis;
    (high - low).maxCoeff(&axis);
    const std::uint32_t half = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                       return std::pair(items_[a].centroid[axis], a) < std::pair(items_[b].centroid[axis], b);
                     });
    build(begin, half);
    node.right = build(half, end);
  }
  nodes_[index] = node;
  return index;
}

// Goes through the tree: open(node) says whether to look inside.
template <class OpenNode, class TakeNode, class TakeItem>
void LayerMajorants::visit(OpenNode&& open, TakeNode&& takeNode, TakeItem&& takeItem) const {
  std::array<std::uint32_t, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = 0;
  while (depth > 0) {
    const std::uint32_t index = stack[--depth];
    const Node& node = nodes_[index];
    if (!open(node)) {
      takeNode(node);
    } else if (node.right == 0) {
      for (std::uint32_t i = node.begin; i < node.end; ++i) takeItem(order_[i]);
    } else {
      stack[depth++] = node.right;
      stack[depth++] = index + 1;
    }
  }
}

// Largest (1 - weight) / r^4 over the distances from the centroid that the ball has.
double LayerMajorants::defectOf(const Item& item, const Ball& ball) const {
  // In units of the near radius the product has one maximum, at kPeak.
  constexpr double kPeak = 0.950962, kPeakValue = 1.1001;
  const double distance = (ball.center - item.centroid).norm();
  const double low = (distance - ball.radius) / item.nearRadius,
               high = (distance + ball.radius) / item.nearRadius;
  if (high <= NearField::kBlendFrom) return 0;
  const double scale = item.defect / std::pow(item.nearRadius, 4);
  if (low >= 1) return scale / std::pow(low, 4);
  if (low <= kPeak && high >= kPeak) return scale * kPeakValue;
  const double share = low > kPeak ? low : high;  // beyond the peak it falls, before it rises
  const double fade = 1 - (1 - share) / (1 - NearField::kBlendFrom);
  return scale * fade * fade * (3 - 2 * fade) / std::pow(share, 4);
}

double LayerMajorants::quadratureError(const Ball& ball) const {
  double sum = 0;
  visit(
      [&](const Node& node) {
        const double distance = (ball.center - node.middle).norm() - ball.radius;
        return !(node.radius < kOpening * distance && distance - node.radius > node.nearRadius);
      },
      [&](const Node& node) {
        sum += spreadKernel<4>(node.defect, node.defectSpread,
                               (ball.center - node.defectCenter).norm() - ball.radius,
                               (ball.center - node.middle).norm() - ball.radius - node.radius);
      },
      [&](std::uint32_t t) { sum += defectOf(items_[t], ball); });
  return sum;
}

LayerMajorants::Surroundings LayerMajorants::around(const Ball& ball, const Vec3& normal,
                                                    double reach) const {
  Surroundings result;
  visit(
      [&](const Node& node) {
        const double distance = (ball.center - node.middle).norm() - ball.radius;
        return !(node.radius < kOpening * distance &&
                 distance - node.radius > std::max(reach, node.nearRadius));
      },
      [&](const Node& node) {
        const double nearest = (ball.center - node.middle).norm() - ball.radius - node.radius;
        result.quadratureError += spreadKernel<4>(
            node.defect, node.defectSpread, (ball.center - node.defectCenter).norm() - ball.radius, nearest);
        result.bend += node.bend.at(nearest, normal);
      },
      [&](std::uint32_t t) {
        const Item& item = items_[t];
        result.quadratureError += defectOf(item, ball);
        const double nearest = (ball.center - item.centroid).norm() - ball.radius - item.radius;
        if (nearest < reach) {
          result.patch.push_back(t);
        } else {
          result.bend += item.bend.at(nearest, normal);
        }
      });
  std::sort(result.patch.begin(), result.patch.end());
  return result;
}

// Branch and bound: the boxes with the largest bound are cut until none exceeds what a point has by much.
double LayerMajorants::largestQuadratureError(const Cube& cube, double slack, std::size_t boxes) const {
  struct Box {
    double bound;
    Vec3 center;
    double side;
    bool operator<(const Box& other) const { return bound < other.bound; }
  };
  double seen = 0;
  auto bounded = [&](const Vec3& center, double side) {
    seen = std::max(seen, quadratureError({center, 0}));
    return Box{quadratureError({center, std::sqrt(0.75) * side}), center, side};
  };
  std::priority_queue<Box> open;
  open.push(bounded(cube.low + Vec3::Constant(0.5 * cube.side), cube.side));
  for (std::size_t looked = 1; looked < boxes && open.top().bound > slack * seen; looked += 8) {
    const Box box = open.top();
    open.pop();
    for (int octant = 0; octant < 8; ++octant) {
      const Vec3 step(octant & 1 ? 0.25 : -0.25, octant & 2 ? 0.25 : -0.25, octant & 4 ? 0.25 : -0.25);
      open.push(bounded(box.center + box.side * step, 0.5 * box.side));
    }
  }
  return open.top().bound;
}

}  // namespace polestar::detail
