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

template <int power>
double integerPower(double x) {
  double result = x;
  for (int k = 1; k < power; ++k) result *= x;
  return result;
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

FlatTriangle flatTriangle(const TriMesh& mesh, const LayerJumps& jumps, std::size_t t) {
  FlatTriangle flat;
  for (int k = 0; k < 3; ++k) {
    flat.corner[k] = mesh.corner(t, k);
    flat.conormal[k] = jumps.conormal[3 * t + k];
    flat.length[k] = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).norm();
  }
  flat.normal = jumps.normal[t];
  flat.area = 0.5 * (flat.corner[1] - flat.corner[0]).cross(flat.corner[2] - flat.corner[0]).norm();
  return flat;
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

// Sum of w |x - y|^-power for x in the ball, no y nearer to it than `nearest`: Taylor's formula about the
// center, whose linear term vanishes; the second derivatives of r^-k are at most k (k + 1)/r^(k+2).
template <int power>
double LayerMajorants::Cluster::at(const Ball& ball, double nearest) const {
  return weight / integerPower<power>((ball.center - center).norm() - ball.radius) +
         0.5 * power * (power + 1) * spread / integerPower<power + 2>(nearest);
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
  for (std::size_t i = 0; i < count; ++i) {
    sum += magnitude[i];
    item.charge.center += magnitude[i] * Vec3(x[i], y[i], z[i]);
  }
  item.charge.weight = sum;
  item.charge.center = sum > 0 ? Vec3(item.charge.center / sum) : item.centroid;
  for (std::size_t i = 0; i < count; ++i)
    item.charge.spread += magnitude[i] * (Vec3(x[i], y[i], z[i]) - item.charge.center).squaredNorm();
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
    const double degree = cube * std::sqrt(squared) * std::pow(share, n - 3);
    item.defect += degree;
    item.slopeDefect += (n + 1) * degree;
  }
  double rest = 0;
  for (std::size_t i = 0; i < count; ++i)
    rest += magnitude[i] *
            std::pow((Vec3(x[i], y[i], z[i]) - item.centroid).squaredNorm() / (radius * radius), 3);
  rest *= cube * std::pow(share, kDegree - 2) / (1 - share);
  item.defect += rest;
  item.slopeDefect += rest * (kDegree + 2 + share / (1 - share));
  // The charges are softened: softening^2/(2 r^3) of difference, 3/r times as much in the gradient, and no
  // two points are farther apart than 2.
  item.defect += sum * quadrature.places().squaredSoftening;
  item.slopeDefect += 3 * sum * quadrature.places().squaredSoftening;
  return item;
}

template <class Member>
LayerMajorants::Cluster LayerMajorants::clustered(std::uint32_t begin, std::uint32_t end, const Vec3& middle,
                                                  Member&& member) const {
  Cluster all;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Cluster one = member(items_[order_[i]]);
    all.weight += one.weight;
    all.center += one.weight * one.center;
  }
  all.center = all.weight > 0 ? Vec3(all.center / all.weight) : middle;
  for (std::uint32_t i = begin; i < end; ++i) {
    const Cluster one = member(items_[order_[i]]);
    all.spread += one.spread + one.weight * (one.center - all.center).squaredNorm();
  }
  return all;
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
    node.nearRadius = std::max(node.nearRadius, item.nearRadius);
  }
  node.middle = 0.5 * (low + high);
  node.defect = clustered(begin, end, node.middle, [](const Item& i) {
    return Cluster{i.defect, 0, i.centroid};
  });
  node.slopeDefect = clustered(begin, end, node.middle, [](const Item& i) {
    return Cluster{i.slopeDefect, 0, i.centroid};
  });
  node.charge = clustered(begin, end, node.middle, [](const Item& i) { return i.charge; });
  for (std::uint32_t i = begin; i < end; ++i) {
    const Item& item = items_[order_[i]];
    // The centers of the clusters lie within the same ball.
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
  const double scale = item.defect / integerPower<4>(item.nearRadius);
  if (low >= 1) return scale / integerPower<4>(low);
  if (low <= kPeak && high >= kPeak) return scale * kPeakValue;
  const double share = low > kPeak ? low : high;  // beyond the peak it falls, before it rises
  const double fade = 1 - (1 - share) / (1 - NearField::kBlendFrom);
  return scale * fade * fade * (3 - 2 * fade) / integerPower<4>(share);
}

// Largest (1 - weight) slopeDefect/r^5 + |weight'| defect/r^4 over the distances that the ball has: over some
// parts of the blend, each with its own bounds for the factors.
double LayerMajorants::slopeDefectOf(const Item& item, const Ball& ball) const {
  constexpr int kParts = 4;
  constexpr double kBlend = 1 - NearField::kBlendFrom;
  const double distance = (ball.center - item.centroid).norm(), radius = item.nearRadius;
  const double low = (distance - ball.radius) / radius, high = (distance + ball.radius) / radius;
  if (high <= NearField::kBlendFrom) return 0;
  const double slope = item.slopeDefect / integerPower<5>(radius),
               value = item.defect / integerPower<5>(radius);
  double largest = high >= 1 ? slope / integerPower<5>(std::max(1.0, low)) : 0;
  const double from = std::max(low, NearField::kBlendFrom), to = std::min(high, 1.0);
  for (int part = 0; part < kParts && from <= to; ++part) {
    const double begin = from + (to - from) * part / kParts, end = from + (to - from) * (part + 1) / kParts;
    const double f0 = std::max(0.0, 1 - (1 - begin) / kBlend), f1 = std::min(1.0, 1 - (1 - end) / kBlend);
    const double steepest = f0 <= 0.5 && f1 >= 0.5 ? 0.25 : std::max(f0 * (1 - f0), f1 * (1 - f1));
    largest = std::max(largest, f1 * f1 * (3 - 2 * f1) * slope / integerPower<5>(begin) +
                                    6 / kBlend * steepest * value / integerPower<4>(begin));
  }
  return largest;
}

template <class OfNode, class OfItem>
double LayerMajorants::sumOver(const Ball& ball, OfNode&& ofNode, OfItem&& ofItem) const {
  double sum = 0;
  visit(
      [&](const Node& node) {
        const double distance = (ball.center - node.middle).norm() - ball.radius;
        return !(node.radius < kOpening * distance && distance - node.radius > node.nearRadius);
      },
      [&](const Node& node) {
        sum += ofNode(node, (ball.center - node.middle).norm() - ball.radius - node.radius);
      },
      [&](std::uint32_t t) { sum += ofItem(items_[t]); });
  return sum;
}

double LayerMajorants::slopeQuadratureError(const Ball& ball) const {
  return sumOver(
      ball, [&](const Node& node, double distance) { return node.slopeDefect.at<5>(ball, distance); },
      [&](const Item& item) { return slopeDefectOf(item, ball); });
}

LayerMajorants::Reached LayerMajorants::reachedFrom(const Vec3& x, double reach) const {
  Reached result;
  const Ball point{x, 0};
  visit(
      [&](const Node& node) {
        const double distance = (x - node.middle).norm();
        return !(node.radius < kOpening * distance && distance - node.radius > reach * node.nearRadius);
      },
      [&](const Node& node) {
        result.slopeError += node.slopeDefect.at<5>(point, (x - node.middle).norm() - node.radius);
      },
      [&](std::uint32_t t) {
        const Item& item = items_[t];
        const double distance = (x - item.centroid).norm();
        if (distance < reach * item.nearRadius) {
          result.triangles.push_back(t);
        } else {
          result.slopeError += item.slopeDefect / integerPower<5>(distance);
        }
      });
  std::sort(result.triangles.begin(), result.triangles.end());
  return result;
}

double LayerMajorants::quadratureError(const Ball& ball) const {
  return sumOver(
      ball, [&](const Node& node, double distance) { return node.defect.at<4>(ball, distance); },
      [&](const Item& item) { return defectOf(item, ball); });
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
        result.quadratureError += node.defect.at<4>(ball, nearest);
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

LayerMajorants::Charges LayerMajorants::chargesAround(const Ball& ball, double reach) const {
  Charges result;
  visit(
      [&](const Node& node) {
        const double distance = (ball.center - node.middle).norm() - ball.radius;
        return !(node.radius < kOpening * distance && distance - node.radius > reach);
      },
      [&](const Node& node) {
        result.fourth +=
            node.charge.at<4>(ball, (ball.center - node.middle).norm() - ball.radius - node.radius);
      },
      [&](std::uint32_t t) {
        const Item& item = items_[t];
        const double nearest = (ball.center - item.centroid).norm() - ball.radius - item.radius;
        if (nearest < reach) {
          result.patch.push_back(t);
        } else {
          result.fourth += item.charge.at<4>(ball, nearest);
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
