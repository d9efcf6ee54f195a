#include "green/level_topology.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "polestar/core/covering_number.h"

namespace polestar::testing {
namespace {

using Offset = std::array<int, 3>;

/// Edges of the triangulation that lead upwards from a point: from 0 to a corner of the unit cube.
constexpr std::array<Offset, 7> kUpward{
    {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}}};

bool isUpward(const Offset& d) {
  return std::all_of(d.begin(), d.end(), [](int c) { return c == 0 || c == 1; }) && d != Offset{0, 0, 0};
}

Offset minus(const Offset& a, const Offset& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Offset plus(const Offset& a, const Offset& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

/// Corners of the simplices of a dimension, 1 to 3, that have the point as their lowest: chains of edges
/// upwards.
std::vector<std::vector<Offset>> chains(std::size_t dimension) {
  std::vector<std::vector<Offset>> result{{{0, 0, 0}}};
  for (std::size_t step = 0; step < dimension; ++step) {
    std::vector<std::vector<Offset>> longer;
    for (const std::vector<Offset>& chain : result) {
      for (const Offset& next : kUpward) {
        if (!isUpward(minus(next, chain.back()))) continue;
        longer.push_back(chain);
        longer.back().push_back(next);
      }
    }
    result = std::move(longer);
  }
  return result;
}

const std::vector<std::vector<Offset>>& simplices(std::size_t dimension) {
  static const std::array<std::vector<std::vector<Offset>>, 3> kAll{chains(1), chains(2), chains(3)};
  return kAll[dimension - 1];
}

/// Neighbours of a point, and which of them are neighbours of each other: its link, a triangulated sphere.
struct Link {
  std::array<Offset, 14> neighbours;
  std::array<std::array<bool, 14>, 14> joined{};

  Link() {
    for (std::size_t i = 0; i < 7; ++i) {
      neighbours[i] = kUpward[i];
      neighbours[i + 7] = minus({0, 0, 0}, kUpward[i]);
    }
    for (std::size_t a = 0; a < 14; ++a) {
      for (std::size_t b = 0; b < 14; ++b) joined[a][b] = isUpward(minus(neighbours[a], neighbours[b]));
    }
  }

  /// Parts of the link on the neighbours that are marked.
  std::size_t parts(std::array<bool, 14> marked) const {
    std::size_t count = 0;
    for (std::size_t seed = 0; seed < 14; ++seed) {
      if (!marked[seed]) continue;
      ++count;
      std::vector<std::size_t> open{seed};
      marked[seed] = false;
      while (!open.empty()) {
        const std::size_t at = open.back();
        open.pop_back();
        for (std::size_t next = 0; next < 14; ++next) {
          if (!marked[next] || !(joined[at][next] || joined[next][at])) continue;
          marked[next] = false;
          open.push_back(next);
        }
      }
    }
    return count;
  }
};

/// Sets that grow together.
class Parts {
 public:
  explicit Parts(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t a) {
    while (parent_[a] != a) a = parent_[a] = parent_[parent_[a]];
    return a;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[root(a)] = root(b); }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace

Lattice::Lattice(const Vec3& origin, double spacing, const std::array<int, 3>& size)
    : origin_(origin),
      spacing_(spacing),
      size_(size),
      values_(static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]) *
                  static_cast<std::size_t>(size[2]),
              kOutside) {}

Lattice Lattice::aroundOrigin(double radius, int steps) {
  const int reach = steps + 2;  // beyond the ball: a rim that is outside, with neighbours on both sides
  const double spacing = radius / steps;
  return {Vec3::Constant(-reach * spacing), spacing, {2 * reach + 1, 2 * reach + 1, 2 * reach + 1}};
}

std::array<int, 3> Lattice::coordinates(std::size_t index) const {
  const auto nx = static_cast<std::size_t>(size_[0]), ny = static_cast<std::size_t>(size_[1]);
  return {static_cast<int>(index % nx), static_cast<int>(index / nx % ny),
          static_cast<int>(index / (nx * ny))};
}

std::size_t Lattice::indexOf(const std::array<int, 3>& at) const {
  return static_cast<std::size_t>(at[0]) +
         static_cast<std::size_t>(size_[0]) *
             (static_cast<std::size_t>(at[1]) +
              static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(at[2]));
}

bool Lattice::onRim(const std::array<int, 3>& at) const {
  for (int k = 0; k < 3; ++k) {
    if (at[k] == 0 || at[k] == size_[k] - 1) return true;
  }
  return false;
}

bool Lattice::higher(std::size_t a, std::size_t b) const {
  return values_[a] > values_[b] || (values_[a] == values_[b] && a > b);
}

Vec3 Lattice::point(std::size_t index) const {
  const auto [i, j, k] = coordinates(index);
  return origin_ + spacing_ * Vec3(i, j, k);
}

void Lattice::fill(const std::function<bool(const Vec3&)>& inside,
                   const std::function<void(std::span<const Vec3>, std::span<double>)>& values) {
  std::vector<std::size_t> where;
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < size(); ++i) {
    const Vec3 p = point(i);
    if (!inside(p)) continue;
    where.push_back(i);
    points.push_back(p);
  }
  std::vector<double> found(points.size());
  values(points, found);
  std::fill(values_.begin(), values_.end(), kOutside);
  for (std::size_t i = 0; i < where.size(); ++i) values_[where[i]] = found[i];
}

long Lattice::LevelSurface::eulerCharacteristic() const {
  return static_cast<long>(vertices) - static_cast<long>(edges) + static_cast<long>(faces);
}

Lattice::LevelSurface Lattice::levelSurface(double level) const {
  LevelSurface surface;
  // A vertex of the surface is an edge of the lattice: 7 a point.
  Parts parts(7 * size());
  std::vector<bool> isVertex(7 * size(), false);
  const auto vertexOn = [&](std::size_t from, const Offset& direction) {
    const auto which = std::find(kUpward.begin(), kUpward.end(), direction) - kUpward.begin();
    return static_cast<std::uint32_t>(7 * from + static_cast<std::size_t>(which));
  };
  for (std::size_t i = 0; i < size(); ++i) {
    const std::array<int, 3> at = coordinates(i);
    if (onRim(at) && values_[i] >= level) throw std::logic_error("a level set reaches the lattice's rim");
    if (at[0] == size_[0] - 1 || at[1] == size_[1] - 1 || at[2] == size_[2] - 1) continue;
    if (!changes(at, level)) continue;
    for (std::size_t dimension = 1; dimension <= 3; ++dimension) {
      for (const std::vector<Offset>& chain : simplices(dimension)) {
        std::vector<std::size_t> above, below;
        for (const Offset& corner : chain) {
          const std::size_t index = indexOf(plus(at, corner));
          (values_[index] >= level ? above : below).push_back(index);
        }
        if (above.empty() || below.empty()) continue;
        ++(dimension == 1 ? surface.vertices : dimension == 2 ? surface.edges : surface.faces);
        if (dimension > 2) continue;
        // Of a triangle two edges are crossed, and an edge of the surface joins them.
        std::vector<std::uint32_t> crossed;
        for (const std::size_t a : above) {
          for (const std::size_t b : below) {
            crossed.push_back(
                vertexOn(std::min(a, b), minus(coordinates(std::max(a, b)), coordinates(std::min(a, b)))));
          }
        }
        isVertex[crossed.front()] = true;
        parts.join(crossed.front(), crossed.back());
      }
    }
  }
  for (std::uint32_t v = 0; v < isVertex.size(); ++v) surface.components += isVertex[v] && parts.root(v) == v;
  return surface;
}

/// Are some corners of the cube above a point above the level and others below?
bool Lattice::changes(const std::array<int, 3>& at, double level) const {
  const bool above = values_[indexOf(at)] >= level;
  return std::any_of(kUpward.begin(), kUpward.end(), [&](const Offset& corner) {
    return (values_[indexOf(plus(at, corner))] >= level) != above;
  });
}

std::vector<Lattice::CriticalPoint> Lattice::criticalPoints() const {
  static const Link kLink;
  std::vector<CriticalPoint> found;
  for (std::size_t i = 0; i < size(); ++i) {
    const std::array<int, 3> at = coordinates(i);
    if (values_[i] == kOutside || onRim(at)) continue;
    std::array<bool, 14> up{}, down{};
    bool known = true;
    for (std::size_t n = 0; n < 14; ++n) {
      const std::size_t neighbour = indexOf(plus(at, kLink.neighbours[n]));
      known = known && values_[neighbour] != kOutside;
      up[n] = higher(neighbour, i);
      down[n] = !up[n];
    }
    if (!known) continue;
    const CriticalPoint point{i, kLink.parts(down), kLink.parts(up)};
    if (point.lowerParts != 1 || point.upperParts != 1) found.push_back(point);
  }
  return found;
}

int degreeOfField(std::span<const Vec3> field, const std::vector<Triangle>& triangles) {
  return coveringNumber(field, triangles);
}

}  // namespace polestar::testing
