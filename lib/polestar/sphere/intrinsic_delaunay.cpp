// Flips an intrinsic triangulation (edge lengths, no positions) until every edge is Delaunay, then reads off
// cotangents.

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "polestar/sphere/detail/laplacian.h"

namespace polestar::detail {
namespace {

/// Edges whose cotangents sum to less than this are flipped; above it they count as cocircular.
constexpr double kDelaunaySlack = -1e-9;
/// Triangle inequalities hold by at least this share of the mean edge length: just beyond the rounding of
/// lengths. A needle of height h has h^2 to spare, so this touches only those below 1e-6.
constexpr double kMollification = 1e-13;

/// Twice the area of a triangle with these sides, accurate for needles [Kahan].
double doubleArea(double a, double b, double c) {
  if (a < b) std::swap(a, b);
  if (b < c) std::swap(b, c);
  if (a < b) std::swap(a, b);
  return 0.5 * std::sqrt(std::max(0.0, (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c))));
}

/// Half-edge h = 3 t + k runs from corner k of triangle t to the next one. Two half-edges of one triangle may
/// be twins and two vertices may share several edges: intrinsic triangulations need not be simplicial
/// complexes.
class IntrinsicTriangulation {
 public:
  explicit IntrinsicTriangulation(const TriMesh& mesh) {
    const std::size_t halfEdges = 3 * mesh.triangles.size();
    origin_.resize(halfEdges);
    length_.resize(halfEdges);
    for (std::size_t h = 0; h < halfEdges; ++h) {
      origin_[h] = mesh.triangles[h / 3][h % 3];
      length_[h] = (mesh.corner(h / 3, (h + 1) % 3) - mesh.corner(h / 3, h % 3)).norm();
    }
    matchTwins();
    mollify();
  }

  void makeDelaunay() {
    std::vector<std::int32_t> queue;
    std::vector<char> queued(origin_.size(), 0);
    auto push = [&](std::int32_t h) {
      h = std::max(h, twin_[h]);
      if (!queued[h]) queue.push_back(h), queued[h] = 1;
    };
    for (std::int32_t h = static_cast<std::int32_t>(origin_.size()) - 1; h >= 0; --h) push(h);
    // Flipping ends in exact arithmetic; the bound keeps rounding from cycling. What is left then only costs
    // accuracy.
    for (std::size_t flipsLeft = 100 * origin_.size(); !queue.empty() && flipsLeft > 0;) {
      const std::int32_t h = queue.back();
      queue.pop_back();
      queued[h] = 0;
      if (h / 3 == twin_[h] / 3 || cotangent(h) + cotangent(twin_[h]) >= kDelaunaySlack) continue;
      --flipsLeft;
      const auto [t0, t1] = std::pair{h / 3 * 3, twin_[h] / 3 * 3};
      flip(h);
      for (int k = 0; k < 3; ++k) push(t0 + k), push(t1 + k);
    }
  }

  Laplacian laplacian(std::size_t vertices) const {
    std::vector<std::tuple<std::int32_t, std::int32_t, double>> entries;  // row, column, weight
    entries.reserve(origin_.size());
    for (std::int32_t h = 0; h < static_cast<std::int32_t>(origin_.size()); ++h) {
      const std::int32_t i = origin_[h], j = origin_[twin_[h]];
      // Both half-edges of an edge compute the same sum.
      const double weight = 0.5 * (cotangent(std::min(h, twin_[h])) + cotangent(std::max(h, twin_[h])));
      if (i != j && weight > 0) entries.emplace_back(i, j, weight);
    }
    std::sort(entries.begin(), entries.end());
    Laplacian result;
    result.rowStart.assign(vertices + 1, 0);
    std::int32_t lastRow = -1;
    for (const auto& [row, column, weight] : entries) {
      if (row == lastRow && result.column.back() == column) {
        result.weight.back() += weight;
        continue;
      }
      result.column.push_back(column);
      result.weight.push_back(weight);
      ++result.rowStart[row + 1];
      lastRow = row;
    }
    for (std::size_t i = 0; i < vertices; ++i) result.rowStart[i + 1] += result.rowStart[i];
    return result;
  }

 private:
  static std::int32_t next(std::int32_t h) { return h % 3 == 2 ? h - 2 : h + 1; }

  void matchTwins() {
    std::vector<std::tuple<std::int32_t, std::int32_t, std::int32_t>> edges;  // lower, upper end, half-edge
    edges.reserve(origin_.size());
    for (std::int32_t h = 0; h < static_cast<std::int32_t>(origin_.size()); ++h) {
      const auto [low, high] = std::minmax(origin_[h], origin_[next(h)]);
      edges.emplace_back(low, high, h);
    }
    std::sort(edges.begin(), edges.end());
    twin_.resize(origin_.size());
    for (std::size_t e = 0; e + 1 < edges.size(); e += 2) {  // closed and manifold: two half-edges an edge
      twin_[std::get<2>(edges[e])] = std::get<2>(edges[e + 1]);
      twin_[std::get<2>(edges[e + 1])] = std::get<2>(edges[e]);
    }
  }

  void mollify() {
    double total = 0;
    for (const double length : length_) total += length;
    const double slack = kMollification * total / static_cast<double>(length_.size());
    double shortfall = 0;
    for (std::size_t h = 0; h < length_.size(); ++h) {
      const auto i = static_cast<std::int32_t>(h);
      shortfall = std::max(shortfall, slack + length_[h] - length_[next(i)] - length_[next(next(i))]);
    }
    for (double& length : length_) length += shortfall;
  }

  /// Cotangent of the angle opposite to half-edge h.
  double cotangent(std::int32_t h) const {
    const double a = length_[h], b = length_[next(h)], c = length_[next(next(h))];
    // b^2 + c^2 - a^2 without cancelling when b or c is close to a.
    const double dot = b > c ? c * c + (b - a) * (b + a) : b * b + (c - a) * (c + a);
    return dot / (2 * doubleArea(a, b, c));
  }

  /// Replaces edge h = (i, j) between triangles (i, j, k) and (j, i, m) by the edge (m, k).
  void flip(std::int32_t h) {
    const std::int32_t g = twin_[h];
    const std::int32_t jk = next(h), ki = next(jk), im = next(g), mj = next(im);
    const double l = length_[h];
    auto apex = [l](double fromI, double fromJ) {
      return std::pair{(l * l + (fromI - fromJ) * (fromI + fromJ)) / (2 * l),
                       doubleArea(l, fromI, fromJ) / l};
    };
    const auto [kx, ky] = apex(length_[ki], length_[jk]);
    const auto [mx, my] = apex(length_[im], length_[mj]);
    const double diagonal = std::hypot(kx - mx, ky + my);

    struct Side {
      std::int32_t origin, halfEdge, twin;
      double length;
    };
    auto side = [this](std::int32_t e) { return Side{origin_[e], e, twin_[e], length_[e]}; };
    const std::array<Side, 4> old{side(jk), side(ki), side(im), side(mj)};
    const std::int32_t t0 = h / 3 * 3, t1 = g / 3 * 3;
    // New triangles: (m, k, i) = diagonal, ki, im and (k, m, j) = diagonal, mj, jk.
    const std::array<std::int32_t, 4> place{t1 + 2, t0 + 1, t0 + 2, t1 + 1};
    auto moved = [&](std::int32_t e) {
      for (int n = 0; n < 4; ++n)
        if (old[n].halfEdge == e) return place[n];
      return e;
    };
    origin_[t0] = old[3].origin, origin_[t1] = old[1].origin;
    length_[t0] = length_[t1] = diagonal;
    twin_[t0] = t1, twin_[t1] = t0;
    for (int n = 0; n < 4; ++n) {
      origin_[place[n]] = old[n].origin;
      length_[place[n]] = old[n].length;
      twin_[place[n]] = moved(old[n].twin);
      twin_[twin_[place[n]]] = place[n];
    }
  }

  std::vector<std::int32_t> origin_, twin_;
  std::vector<double> length_;
};

}  // namespace

Laplacian intrinsicDelaunayLaplacian(const TriMesh& mesh) {
  IntrinsicTriangulation triangulation(mesh);
  triangulation.makeDelaunay();
  return triangulation.laplacian(mesh.vertices.size());
}

std::vector<double> vertexAreaShares(const TriMesh& mesh) {
  std::vector<double> share(mesh.vertices.size(), 0.0);
  double total = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double third = areaVector(mesh, t).norm() / 6;
    for (const std::int32_t v : mesh.triangles[t]) share[v] += third;
    total += 3 * third;
  }
  for (double& s : share) s /= total;
  return share;
}

}  // namespace polestar::detail
