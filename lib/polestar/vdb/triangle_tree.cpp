#include "polestar/vdb/detail/triangle_tree.h"

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace polestar::detail {
namespace {

constexpr std::size_t kLeafTriangles = 4;
constexpr std::size_t kSerialTriangles = 8192;

std::size_t leafCount(std::size_t triangles) { return (triangles + kLeafTriangles - 1) / kLeafTriangles; }

double squaredDistanceToBox(const Vec3& p, const Box& box) {
  return (box.min - p).cwiseMax(p - box.max).cwiseMax(0).squaredNorm();
}

double squaredDistanceToEdge(const Vec3& fromA, const Vec3& edge, double along) {
  const double length = edge.squaredNorm();
  const double t = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0.0;
  return (fromA - t * edge).squaredNorm();
}

// By the region of the plane in which the foot of the perpendicular lies [Ericson 2005, sec. 5.1.5]; at a
// needle, whose normal means little, the edges decide.
double squaredDistanceToTriangle(const Vec3& p, const std::array<Vec3, 3>& triangle) {
  const Vec3 ab = triangle[1] - triangle[0], ac = triangle[2] - triangle[0], bc = triangle[2] - triangle[1];
  const Vec3 ap = p - triangle[0], bp = p - triangle[1];
  const double abAp = ab.dot(ap), acAp = ac.dot(ap), abBp = ab.dot(bp), acBp = ac.dot(bp);
  const double abCp = abAp - ab.dot(ac), acCp = acAp - ac.squaredNorm();
  const double weightC = abAp * acBp - abBp * acAp;
  const double weightB = abCp * acAp - abAp * acCp;
  const double weightA = abBp * acCp - abCp * acBp;
  const double total = weightA + weightB + weightC;
  if (weightA > 0 && weightB > 0 && weightC > 0) {
    return (ap - (weightB / total) * ab - (weightC / total) * ac).squaredNorm();
  }
  return std::min({squaredDistanceToEdge(ap, ab, abAp), squaredDistanceToEdge(ap, ac, acAp),
                   squaredDistanceToEdge(bp, bc, bc.dot(bp))});
}

}  // namespace

TriangleTree::TriangleTree(const TriMesh& mesh) {
  const std::size_t count = mesh.triangles.size();
  if (count == 0) return;
  std::vector<Vec3> centers(count);
  for (std::size_t t = 0; t < count; ++t)
    centers[t] = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
  std::vector<std::uint32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  boxes_.resize(2 * leafCount(count) - 1);
  triangles_.resize(count);
  build(mesh, centers, order, {0, 0, count});
}

std::array<TriangleTree::Subtree, 2> TriangleTree::children(const Subtree& at) {
  // The first child gets half of the leaves, all full.
  const std::size_t leaves = leafCount(at.end - at.begin) / 2;
  const std::size_t middle = at.begin + leaves * kLeafTriangles;
  return {Subtree{at.node + 1, at.begin, middle}, Subtree{at.node + 2 * leaves, middle, at.end}};
}

void TriangleTree::build(const TriMesh& mesh, const std::vector<Vec3>& centers,
                         std::vector<std::uint32_t>& order, Subtree at) {
  Box& box = boxes_[at.node];
  if (at.end - at.begin <= kLeafTriangles) {
    for (std::size_t i = at.begin; i < at.end; ++i) {
      for (int k = 0; k < 3; ++k) {
        triangles_[i][k] = mesh.corner(order[i], k);
        box.min = box.min.cwiseMin(triangles_[i][k]);
        box.max = box.max.cwiseMax(triangles_[i][k]);
      }
    }
    return;
  }

  // Split where the triangles' centers spread most.
  Box spread;
  for (std::size_t i = at.begin; i < at.end; ++i) {
    spread.min = spread.min.cwiseMin(centers[order[i]]);
    spread.max = spread.max.cwiseMax(centers[order[i]]);
  }
  int axis;
  spread.extent().maxCoeff(&axis);
  const auto [first, second] = children(at);
  const auto begin = order.begin();
  std::nth_element(begin + at.begin, begin + first.end, begin + at.end,
                   [&](std::uint32_t s, std::uint32_t t) { return centers[s][axis] < centers[t][axis]; });
  if (at.end - at.begin > kSerialTriangles) {
    tbb::parallel_invoke([&, child = first] { build(mesh, centers, order, child); },
                         [&, child = second] { build(mesh, centers, order, child); });
  } else {
    build(mesh, centers, order, first);
    build(mesh, centers, order, second);
  }
  box.min = boxes_[first.node].min.cwiseMin(boxes_[second.node].min);
  box.max = boxes_[first.node].max.cwiseMax(boxes_[second.node].max);
}

double TriangleTree::distance(const Vec3& point, double bound) const {
  if (triangles_.empty()) return bound;
  struct Entry {
    Subtree at;
    double squared;  // distance to its box
  };
  std::array<Entry, 64> stack;  // one entry a level, and the triangles' number halves from level to level
  std::size_t size = 0;
  stack[size++] = {{0, 0, triangles_.size()}, squaredDistanceToBox(point, boxes_[0])};
  const double start = bound * bound;
  double nearest = start;
  while (size > 0) {
    const Entry entry = stack[--size];
    if (entry.squared >= nearest) continue;
    if (entry.at.end - entry.at.begin <= kLeafTriangles) {
      for (std::size_t i = entry.at.begin; i < entry.at.end; ++i) {
        nearest = std::min(nearest, squaredDistanceToTriangle(point, triangles_[i]));
      }
      continue;
    }
    const auto [first, second] = children(entry.at);
    Entry near{first, squaredDistanceToBox(point, boxes_[first.node])};
    Entry far{second, squaredDistanceToBox(point, boxes_[second.node])};
    if (far.squared < near.squared) std::swap(near, far);
    stack[size++] = far;
    stack[size++] = near;
  }
  return nearest < start ? std::sqrt(nearest) : bound;
}

}  // namespace polestar::detail
