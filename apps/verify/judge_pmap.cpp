#include "judge_pmap.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "exact_sign.h"

namespace polestar::verify {
namespace {

constexpr double kUlp = std::numeric_limits<double>::epsilon();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Of lengths near 1 that were computed in a few steps.
constexpr double kRounding = 1e-12;

std::string place(const Vec3& p) {
  return "(" + shortNumber(p.x) + ", " + shortNumber(p.y) + ", " + shortNumber(p.z) + ")";
}

std::string ofTotal(std::size_t bad, std::size_t all, const std::string& what) {
  return std::to_string(bad) + " of " + std::to_string(all) + " " + what;
}

/// How many of `count` things are bad, and the first of them.
struct Count {
  std::size_t bad = 0, first = SIZE_MAX;
};

template <class IsBad>
Count countIf(std::size_t count, IsBad&& isBad) {
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, count, 4096), Count{},
      [&](const tbb::blocked_range<std::size_t>& range, Count sum) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
          if (!isBad(i)) continue;
          ++sum.bad;
          sum.first = std::min(sum.first, i);
        }
        return sum;
      },
      [](const Count& a, const Count& b) {
        return Count{a.bad + b.bad, std::min(a.first, b.first)};
      });
}

/// Sets that are joined one by one.
class Sets {
 public:
  explicit Sets(std::size_t count) : root_(count), count_(count) {
    std::iota(root_.begin(), root_.end(), std::size_t{0});
  }
  void join(std::size_t a, std::size_t b) {
    a = find(a), b = find(b);
    count_ -= a != b;
    root_[a] = b;
  }
  std::size_t count() const { return count_; }

 private:
  std::size_t find(std::size_t i) {
    while (root_[i] != i) i = root_[i] = root_[root_[i]];
    return i;
  }
  std::vector<std::size_t> root_;
  std::size_t count_;
};

/// The directed sides of all triangles; twins have the ends exchanged.
class Sides {
 public:
  struct Side {
    std::int32_t from, to;
    std::size_t triangle;
  };

  explicit Sides(const std::vector<Triangle>& triangles) {
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      const Triangle& v = triangles[t];
      for (std::size_t k = 0; k < 3; ++k) sides_.push_back({v[k], v[(k + 1) % 3], t});
    }
    std::sort(sides_.begin(), sides_.end(), isBefore);
  }
  std::size_t count() const { return sides_.size(); }
  const Side& operator[](std::size_t i) const { return sides_[i]; }
  /// Its place, or count().
  std::size_t find(std::int32_t from, std::int32_t to) const {
    const Side wanted{from, to, 0};
    const auto found = std::lower_bound(sides_.begin(), sides_.end(), wanted, isBefore);
    const bool isThere = found != sides_.end() && !isBefore(wanted, *found);
    return isThere ? static_cast<std::size_t>(found - sides_.begin()) : sides_.size();
  }
  std::string name(std::size_t i) const {
    return "side " + std::to_string(sides_[i].from) + "-" + std::to_string(sides_[i].to) + " of triangle " +
           std::to_string(sides_[i].triangle);
  }

 private:
  static bool isBefore(const Side& a, const Side& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  }
  std::vector<Side> sides_;
};

/// What keeps the triangles from being a closed, connected, oriented surface of genus 0 whose vertices are
/// all used, each in one fan; empty when nothing does.
std::string surfaceDefect(std::size_t vertices, const std::vector<Triangle>& triangles) {
  const Sides sides(triangles);
  // Fans: the sides that leave a vertex, each joined with the next one around it, over the triangle between.
  Sets fans(sides.count()), pieces(vertices);
  std::size_t used = 0;
  for (std::size_t i = 0; i < sides.count(); ++i) {
    const auto [from, to, triangle] = sides[i];
    if (from == to) return "triangle " + std::to_string(triangle) + " has a vertex twice";
    if (i > 0 && sides[i - 1].from == from && sides[i - 1].to == to) {
      return sides.name(i) + " occurs twice in this direction";
    }
    const std::size_t twin = sides.find(to, from);
    if (twin == sides.count()) return sides.name(i) + " has no neighbour";
    const Triangle& v = triangles[sides[twin].triangle];
    const auto corner = static_cast<std::size_t>(std::find(v.begin(), v.end(), from) - v.begin());
    fans.join(i, sides.find(from, v[(corner + 1) % 3]));
    pieces.join(static_cast<std::size_t>(from), static_cast<std::size_t>(to));
    used += i == 0 || sides[i - 1].from != from;
  }
  if (used != vertices) return std::to_string(vertices - used) + " vertices belong to no triangle";
  if (fans.count() != vertices) {
    return std::to_string(fans.count() - vertices) + " vertices join parts that touch in a point";
  }
  if (pieces.count() != 1) return "it has " + std::to_string(pieces.count()) + " pieces";
  const auto euler =
      static_cast<std::int64_t>(vertices + triangles.size()) - static_cast<std::int64_t>(sides.count() / 2);
  return euler == 2 ? "" : "its Euler number is " + std::to_string(euler) + ", not 2";
}

/// Triangles of level 0 whose cone does not open outward.
Count badCones(const std::vector<Triangle>& triangles, const std::vector<Vec3>& nodes) {
  return countIf(triangles.size(), [&](std::size_t i) {
    const Triangle& t = triangles[i];
    return signOfDeterminant(nodes[t[0]], nodes[t[1]], nodes[t[2]]) <= 0;
  });
}

/// How many cones of level 0 hold one direction that lies on the rim of none, those that turn inward taken
/// away; 0, too, when no such direction was found.
int conesOverADirection(const std::vector<Triangle>& triangles, const std::vector<Vec3>& nodes) {
  for (std::size_t attempt = 0; attempt < 16 && !triangles.empty(); ++attempt) {
    const Triangle& t = triangles[attempt * triangles.size() / 16];
    // Any direction will do, so its rounding does not matter; inside a cone it is rarely on a rim.
    const double share = 0.41 - 0.01 * static_cast<double>(attempt);
    const Vec3 direction = share * nodes[t[0]] + 0.33 * nodes[t[1]] + (0.67 - share) * nodes[t[2]];
    if (!isFinite(direction)) continue;
    bool onRim = false;
    int cones = 0;
    for (const Triangle& other : triangles) {
      const Vec3 &a = nodes[other[0]], &b = nodes[other[1]], &c = nodes[other[2]];
      const int sides[3] = {signOfDeterminant(direction, b, c), signOfDeterminant(a, direction, c),
                            signOfDeterminant(a, b, direction)};
      const auto [least, most] = std::minmax({sides[0], sides[1], sides[2]});
      onRim = onRim || least == 0 || most == 0;
      // All of one sign: the direction is in the cone, or opposite to it when the triangle turns the other
      // way.
      if (least == most && least == signOfDeterminant(a, b, c)) cones += least;
    }
    if (!onRim) return cones;
  }
  return 0;
}

Count badCells(const BallMapContents& map, const std::vector<Vec3>& nodes) {
  return countIf(cellCount(map), [&](std::size_t id) {
    const auto node = cellNodes(map, id);
    return orientation(nodes[node[0]], nodes[node[1]], nodes[node[2]], nodes[node[3]]) <= 0;
  });
}

std::string firstCell(const BallMapContents& map, const std::vector<Vec3>& nodes, const Count& count) {
  if (count.bad == 0) return "";
  const auto node = cellNodes(map, count.first);
  const std::size_t inPrisms = 3 * (map.levels - 1) * map.triangles.size();
  const bool inPrism = count.first < inPrisms;
  return "; the first is under triangle " +
         std::to_string(inPrism ? count.first / 3 % map.triangles.size() : count.first - inPrisms) +
         (inPrism ? ", layer " + std::to_string(count.first / (3 * map.triangles.size()))
                  : ", at the center") +
         ", near " + place(0.25 * (nodes[node[0]] + nodes[node[1]] + nodes[node[2]] + nodes[node[3]]));
}

void judgeAttachment(const BallMapContents& map, Report& report) {
  // In units of what moving and scaling the vertices may round.
  double worst = 0;
  std::size_t at = 0;
  for (std::size_t i = 0; i < map.vertices.size(); ++i) {
    const Vec3 moved = (1 / map.unit) * (map.vertices[i] - map.center);
    for (int k = 0; k < 3; ++k) {
      const double allowed =
          8 * kUlp *
          ((std::abs(map.vertices[i][k]) + std::abs(map.center[k])) / map.unit + std::abs(moved[k]));
      const double off = std::abs(moved[k] - map.nodes[i][k]);
      double share = off == 0 ? 0 : off / allowed;
      if (!(off < kInfinity)) share = kInfinity;  // overflowed, and what is allowed with it
      if (share > worst) worst = share, at = i;
    }
  }
  report.atMost("boundary_attached", worst, 1, false,
                worst <= 1 ? "level 0 of the foliation is the surface, to rounding"
                           : "level 0 of the foliation leaves the surface at vertex " + std::to_string(at) +
                                 ", by " + shortNumber(worst) + " times what rounding can do");
}

void judgeLevels(const BallMapContents& map, Report& report) {
  const std::size_t n = map.vertices.size();
  double spread = 0, off = 0, offLevels = 0, previous = kInfinity;
  std::size_t rising = 0, spreadAt = 0;
  for (std::size_t level = 0; level < map.levels; ++level) {
    double low = kInfinity, high = 0;
    for (std::size_t i = level * n; i < (level + 1) * n; ++i) {
      if (!map.moved.empty() && map.moved[i] && level > 0) continue;
      const double radius = length(map.ball[i]);
      low = std::min(low, radius);
      high = std::max(high, radius);
      if (level == 0) off = std::max(off, std::abs(radius - 1));
    }
    if (high - low > spread) spread = high - low, spreadAt = level;
    const double stated = map.radii[level];
    const bool isBelow =
        high < previous && stated > 0 && (level == 0 ? stated == 1 : stated < map.radii[level - 1]);
    rising += !isBelow;
    if (map.radiusIsOfGreen) offLevels = std::max({offLevels, high - stated, stated - low});
    previous = low;
  }
  report.atMost(
      "ball_boundary", off, kRounding, false,
      "images of the surface's vertices are off the unit sphere by " + shortNumber(off) + " at most");
  report.atMost("ball_levels", spread, kRounding, false,
                "radii within a level differ by " + shortNumber(spread) + " at most, at level " +
                    std::to_string(spreadAt));
  report.atMost("ball_radii", static_cast<double>(rising), 0, false,
                std::to_string(rising) + " levels are not below the one before, from 1 on");
  report.atMost("stated_levels", offLevels, kRounding, false,
                map.radiusIsOfGreen
                    ? "radii are off the stated levels by " + shortNumber(offLevels) + " at most"
                    : "radii are another function of the stated levels");
  // By components: the length of (1e-300, 0, 0) is 0 in doubles.
  double center = 0;
  for (const Vec3* node : {&map.nodes.back(), &map.ball.back()}) {
    for (int k = 0; k < 3; ++k) center = std::max(center, std::abs((*node)[k]));
  }
  report.atMost("center", center, 0, true,
                center == 0 ? "the center goes to the center" : "the last node is not the center");
}

}  // namespace

std::size_t cellCount(const BallMapContents& map) {
  return (3 * (map.levels - 1) + 1) * map.triangles.size();
}

std::array<std::size_t, 4> cellNodes(const BallMapContents& map, std::size_t cell) {
  const std::size_t n = map.vertices.size(), triangles = map.triangles.size();
  const std::size_t prismCells = 3 * (map.levels - 1) * triangles;
  const Triangle& t = map.triangles[cell < prismCells ? cell / 3 % triangles : cell - prismCells];
  if (cell >= prismCells) {
    const std::size_t base = (map.levels - 1) * n;
    return {map.levels * n, base + t[0], base + t[1], base + t[2]};
  }
  // The staircase over the vertices in the order of their ids: outer ends up to one of them, inner ends from
  // it on.
  std::array<std::size_t, 3> v{static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]),
                               static_cast<std::size_t>(t[2])};
  const bool odd = ((v[0] < v[1]) + (v[1] < v[2]) + (v[2] < v[0])) == 1;
  std::sort(v.begin(), v.end());
  const std::size_t outer = cell / (3 * triangles) * n, inner = outer + n, turn = cell % 3;
  std::array<std::size_t, 4> nodes{};
  for (std::size_t k = 0; k < 4; ++k) nodes[k] = k <= turn ? outer + v[k] : inner + v[k - 1];
  // Over a triangle that runs counter-clockwise in this order the middle stair is positive as it stands, the
  // other two are not.
  if ((turn == 1) == odd) std::swap(nodes[2], nodes[3]);
  return nodes;
}

namespace {

void judgeBallMap(const BallMapContents& map, Report& report) {
  report.facts = {{"vertices", map.vertices.size()},
                  {"triangles", map.triangles.size()},
                  {"levels", map.levels},
                  {"cells", cellCount(map)}};
  report.atMost("finite", static_cast<double>(map.notFinite), 0, true,
                map.notFinite == 0 ? "all numbers are finite"
                                   : std::to_string(map.notFinite) +
                                         " numbers are not finite, first in array " + map.firstNotFinite);
  const bool frame = isFinite(map.center) && std::isfinite(map.unit) && map.unit > 0;
  if (map.notFinite > 0 || !frame) {
    if (!frame) report.atMost("frame", 1, 0, true, "center or unit are no finite numbers, unit > 0");
    return;
  }
  const std::string defect = surfaceDefect(map.vertices.size(), map.triangles);
  report.atMost("surface_closed", defect.empty() ? 0 : 1, 0, true,
                defect.empty() ? "the surface is closed, oriented, manifold, connected, of genus 0"
                               : "the surface is not a closed manifold of genus 0: " + defect);
  judgeAttachment(map, report);

  struct Placement {
    const char *cones, *degree, *cells, *name;
    const std::vector<Vec3>& nodes;
  };
  for (const Placement& p :
       {Placement{"surface_star", "surface_degree", "cells_solid", "the solid", map.nodes},
        Placement{"ball_star", "ball_degree", "cells_ball", "the ball", map.ball}}) {
    const Count cones = badCones(map.triangles, p.nodes);
    report.atMost(p.cones, static_cast<double>(cones.bad), 0, true,
                  ofTotal(cones.bad, map.triangles.size(), "boundary triangles turn away in ") + p.name +
                      (cones.bad ? "; the first is " + std::to_string(cones.first) : ""));
    const int degree = conesOverADirection(map.triangles, p.nodes);
    report.near(p.degree, degree, 1, 0, true,
                "boundary triangles cover a direction " + std::to_string(degree) + " times in " + p.name);
    const Count cells = badCells(map, p.nodes);
    report.atMost(p.cells, static_cast<double>(cells.bad), 0, true,
                  ofTotal(cells.bad, cellCount(map), "tetrahedra are not positive in ") + p.name +
                      firstCell(map, p.nodes, cells));
  }
  judgeLevels(map, report);
}

/// Triangles that do not lie in one square between a cell of the domain and a place without one. Vertices are
/// at halves and quarters ... of cells, which doubles hold up to rounding.
Count offTheCells(const Domain& shape, const BallMapContents& map) {
  constexpr double kOff = 1e-9;  // of a cell
  return countIf(map.triangles.size(), [&](std::size_t i) {
    const Triangle& t = map.triangles[i];
    Vec3 corners[3], middle;
    for (int c = 0; c < 3; ++c) {
      corners[c] =
          (1 / shape.side()) * map.vertices[static_cast<std::size_t>(t[static_cast<std::size_t>(c)])];
      middle = middle + (1.0 / 3) * corners[c];
    }
    const Vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    for (int k = 0; k < 3; ++k) {
      const double plane = std::floor(middle[k]) + 0.5;
      bool inPlane = true, inSquare = true;
      std::array<int, 3> below{};
      for (int axis = 0; axis < 3; ++axis) {
        const double at = axis == k ? plane - 0.5 : std::round(middle[axis]);
        if (!(std::abs(at) < 1e6)) return true;
        below[static_cast<std::size_t>(axis)] = static_cast<int>(at);
        for (const Vec3& corner : corners) {
          if (axis == k) inPlane = inPlane && std::abs(corner[k] - plane) <= kOff;
          if (axis != k) inSquare = inSquare && std::abs(corner[axis] - at) <= 0.5 + kOff;
        }
      }
      if (!inPlane || !inSquare) continue;
      std::array<int, 3> above = below;
      ++above[static_cast<std::size_t>(k)];
      return normal[k] > 0 ? !shape.hasCell(below) || shape.hasCell(above)
                           : shape.hasCell(below) || !shape.hasCell(above);
    }
    return true;
  });
}

/// Whether a triangle of the table keeps its orientation for all s in [from, to], its corners at (1 - s)
/// start + s end: the determinant is a cubic polynomial of s, and its Bernstein coefficients enclose it.
bool keepsTurn(const std::array<Vec3, 3>& start, const std::array<Vec3, 3>& end, int depth) {
  constexpr double kRoundoff = 1e-14;  // of determinants of vectors of length 1 or less
  const auto& [a, b, c] = start;
  const auto& [p, q, r] = end;
  const double coefficients[4] = {det(a, b, c), (det(p, b, c) + det(a, q, c) + det(a, b, r)) / 3,
                                  (det(a, q, r) + det(p, b, r) + det(p, q, c)) / 3, det(p, q, r)};
  const auto [least, most] = std::minmax_element(coefficients, coefficients + 4);
  if (*least > kRoundoff) return true;
  if (!(coefficients[0] > 0 && coefficients[3] > 0) || *most <= kRoundoff || depth == 0) return false;
  std::array<Vec3, 3> middle;
  for (std::size_t k = 0; k < 3; ++k) middle[k] = 0.5 * (start[k] + end[k]);
  return keepsTurn(start, middle, depth - 1) && keepsTurn(middle, end, depth - 1);
}

/// A tiling of the sphere whose triangles keep their orientation all the way from the rotation, a
/// homeomorphism, to where the table takes them: the degree stays 1, and a map of degree 1 that turns no
/// triangle over is one to one.
void judgeTable(const BallMotion& m, Report& report) {
  constexpr int kHalvings = 24;
  const std::string defect = surfaceDefect(m.from.size(), m.triangles);
  report.atMost("motion_closed", defect.empty() ? 0 : 1, 0, true,
                defect.empty() ? "the motion's triangles are a closed surface of genus 0"
                               : "the motion's triangles are no closed surface of genus 0: " + defect);
  if (!defect.empty()) return;
  const Count cones = badCones(m.triangles, m.from);
  report.atMost("motion_from", static_cast<double>(cones.bad), 0, true,
                ofTotal(cones.bad, m.triangles.size(), "triangles of the motion turn away from the start"));
  const int degree = conesOverADirection(m.triangles, m.from);
  report.near("motion_degree", degree, 1, 0, true,
              "triangles of the motion cover a direction " + std::to_string(degree) + " times");
  const Count turned = countIf(m.triangles.size(), [&](std::size_t i) {
    std::array<Vec3, 3> start, end;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(m.triangles[i][k]);
      start[k] = {dot(m.rotation[0], m.from[v]), dot(m.rotation[1], m.from[v]),
                  dot(m.rotation[2], m.from[v])};
      end[k] = m.to[v];
    }
    return !keepsTurn(start, end, kHalvings);
  });
  report.atMost("motion_turns", static_cast<double>(turned.bad), 0, false,
                ofTotal(turned.bad, m.triangles.size(),
                        "triangles of the motion may turn over on the way from the "
                        "rotation to the table") +
                    (turned.bad ? "; the first is " + std::to_string(turned.first) : ""));
}

/// Closed, oriented and of genus 0, with every triangle in a square of the cells' boundary, turned outward,
/// and winding around the center once: the boundary itself.
void judgeDomain(const DomainContents& domain, Report& report) {
  const std::string defect = domain.shape.defect();
  report.atMost("domain", defect.empty() ? 0 : 1, 0, true,
                defect.empty() ? "the domain has " + std::to_string(domain.shape.cellCount()) +
                                     " cells, star-shaped about the middle of one"
                               : "the domain is not star-shaped: " + defect);
  Report ofMap;
  judgeBallMap(domain.map, ofMap);
  for (Check& check : ofMap.checks) {
    check.name.insert(0, "domain_");
    report.checks.push_back(std::move(check));
  }
  for (const auto& [name, value] : ofMap.facts) report.facts.emplace_back("domain_" + name, value);
  const Count off = offTheCells(domain.shape, domain.map);
  report.atMost("domain_cells", static_cast<double>(off.bad), 0, false,
                ofTotal(off.bad, domain.map.triangles.size(),
                        "triangles of the domain's surface are no part of "
                        "its cells' boundary") +
                    (off.bad ? "; the first is " + std::to_string(off.first) : ""));

  const BallMotion& m = domain.motion;
  double skew = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j)
      skew = std::max(skew, std::abs(dot(m.rotation[i], m.rotation[j]) - (i == j ? 1 : 0)));
  }
  if (!(det(m.rotation[0], m.rotation[1], m.rotation[2]) > 0)) skew = kInfinity;
  report.atMost("motion_rotation", skew, kRounding, false,
                "the motion's rotation is off one by " + shortNumber(skew));
  const bool core = m.coreRadius >= 0 && m.coreRadius < 1;
  report.atMost("motion_core", core ? 0 : 1, 0, false,
                "the motion's core has the radius " + shortNumber(m.coreRadius));
  if (!m.from.empty()) return judgeTable(m, report);
  const double pull = length(m.pull);
  report.atMost("motion_pull", pull, 1 - 1e-9, false, "the motion's pull is " + shortNumber(pull) + " long");
}

}  // namespace

Report judgePmap(const PmapContents& map) {
  Report report;
  report.kind = "pmap";
  judgeBallMap(map, report);
  if (map.domain) judgeDomain(*map.domain, report);
  return report;
}

}  // namespace polestar::verify
