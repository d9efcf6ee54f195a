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

/// What keeps the triangles from being a closed, connected, oriented surface of genus 0 whose vertices are
/// all used, each in one fan; empty when nothing does.
std::string surfaceDefect(const PmapContents& map) {
  // Every side, directed, with its triangle; twins have the ends exchanged.
  struct Side {
    std::int32_t from, to;
    std::size_t triangle;
  };
  std::vector<Side> sides;
  for (std::size_t t = 0; t < map.triangles.size(); ++t) {
    const Triangle& v = map.triangles[t];
    for (int k = 0; k < 3; ++k) {
      if (v[k] == v[(k + 1) % 3]) return "triangle " + std::to_string(t) + " has a vertex twice";
      sides.push_back({v[k], v[(k + 1) % 3], t});
    }
  }
  const auto before = [](const Side& a, const Side& b) {
    return a.from != b.from ? a.from < b.from : a.to < b.to;
  };
  std::sort(sides.begin(), sides.end(), before);
  const auto named = [](const Side& s) {
    return "side " + std::to_string(s.from) + "-" + std::to_string(s.to) + " of triangle " +
           std::to_string(s.triangle);
  };
  // A fan around a vertex: from each outgoing side, through its triangle, to the next. Triangles that share a
  // side have one root; so have the corners that share one.
  std::vector<std::size_t> root(sides.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  std::size_t corners = 0, vertices = 0, joins = 0;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    if (i > 0 && !before(sides[i - 1], sides[i])) return named(sides[i]) + " occurs twice in this direction";
    const Side twin{sides[i].to, sides[i].from, 0};
    const auto found = std::lower_bound(sides.begin(), sides.end(), twin, before);
    if (found == sides.end() || before(twin, *found)) return named(sides[i]) + " has no neighbour";
    vertices += i == 0 || sides[i - 1].from != sides[i].from;
    ++corners;
    // The neighbour's triangle a -> from: its side that leaves `from`.
    const Triangle& v = map.triangles[found->triangle];
    const int k = static_cast<int>(std::find(v.begin(), v.end(), sides[i].from) - v.begin());
    const Side next{sides[i].from, v[(k + 1) % 3], 0};
    const auto at = std::lower_bound(sides.begin(), sides.end(), next, before) - sides.begin();
    const std::size_t a = find(i), b = find(static_cast<std::size_t>(at));
    joins += a != b;
    root[a] = b;
  }
  if (vertices != map.vertices.size()) {
    return std::to_string(map.vertices.size() - vertices) + " vertices belong to no triangle";
  }
  if (corners - joins != vertices) {
    return std::to_string(corners - joins - vertices) + " vertices join surfaces that touch in a point";
  }
  const auto count = static_cast<std::int64_t>(map.triangles.size());
  const std::int64_t euler = static_cast<std::int64_t>(vertices) - 3 * count / 2 + count;
  if (euler != 2) return "its Euler number is " + std::to_string(euler) + ", not 2";
  // Euler number 2 means one piece here only when no other piece has handles.
  std::vector<std::size_t> piece(map.vertices.size());
  std::iota(piece.begin(), piece.end(), std::size_t{0});
  root = std::move(piece);
  std::size_t pieces = vertices;
  for (const Side& side : sides) {
    const std::size_t a = find(static_cast<std::size_t>(side.from)),
                      b = find(static_cast<std::size_t>(side.to));
    pieces -= a != b;
    root[a] = b;
  }
  return pieces == 1 ? "" : "it has " + std::to_string(pieces) + " pieces";
}

/// Triangles of level 0 whose cone does not open outward.
Count badCones(const PmapContents& map, const std::vector<Vec3>& nodes) {
  return countIf(map.triangles.size(), [&](std::size_t i) {
    const Triangle& t = map.triangles[i];
    return signOfDeterminant(nodes[t[0]], nodes[t[1]], nodes[t[2]]) <= 0;
  });
}

/// How many cones of level 0 hold one direction that lies on the rim of none, those that turn inward taken
/// away; 0, too, when no such direction was found.
int conesOverADirection(const PmapContents& map, const std::vector<Vec3>& nodes) {
  for (std::size_t attempt = 0; attempt < 16 && !map.triangles.empty(); ++attempt) {
    const Triangle& t = map.triangles[attempt * map.triangles.size() / 16];
    // Any direction will do, so its rounding does not matter; inside a cone it is rarely on a rim.
    const double share = 0.41 - 0.01 * static_cast<double>(attempt);
    const Vec3 direction = share * nodes[t[0]] + 0.33 * nodes[t[1]] + (0.67 - share) * nodes[t[2]];
    if (!isFinite(direction)) continue;
    bool onRim = false;
    int cones = 0;
    for (const Triangle& other : map.triangles) {
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

Count badCells(const PmapContents& map, const std::vector<Vec3>& nodes) {
  return countIf(cellCount(map), [&](std::size_t id) {
    const auto node = cellNodes(map, id);
    return orientation(nodes[node[0]], nodes[node[1]], nodes[node[2]], nodes[node[3]]) <= 0;
  });
}

std::string firstCell(const PmapContents& map, const std::vector<Vec3>& nodes, const Count& count) {
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

void judgeAttachment(const PmapContents& map, Report& report) {
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
      const double share = off == 0 ? 0 : off / allowed;
      if (!(share <= worst)) worst = share, at = i;
    }
  }
  report.atMost("boundary_attached", worst, 1, false,
                worst <= 1 ? "level 0 of the foliation is the surface, to rounding"
                           : "level 0 of the foliation leaves the surface at vertex " + std::to_string(at) +
                                 ", by " + shortNumber(worst) + " times what rounding can do");
}

void judgeLevels(const PmapContents& map, Report& report) {
  const std::size_t n = map.vertices.size();
  double spread = 0, off = 0, offLevels = 0, previous = std::numeric_limits<double>::infinity();
  std::size_t rising = 0, spreadAt = 0;
  for (std::size_t level = 0; level < map.levels; ++level) {
    double low = std::numeric_limits<double>::infinity(), high = 0;
    for (std::size_t i = level * n; i < (level + 1) * n; ++i) {
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
  const double center = std::max(length(map.nodes.back()), length(map.ball.back()));
  report.atMost("center", center, 0, true,
                center == 0 ? "the center goes to the center" : "the last node is not the center");
}

}  // namespace

std::size_t cellCount(const PmapContents& map) { return (3 * (map.levels - 1) + 1) * map.triangles.size(); }

std::array<std::size_t, 4> cellNodes(const PmapContents& map, std::size_t cell) {
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

Report judgePmap(const PmapContents& map) {
  Report report;
  report.kind = "pmap";
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
    return report;
  }
  const std::string defect = surfaceDefect(map);
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
    const Count cones = badCones(map, p.nodes);
    report.atMost(p.cones, static_cast<double>(cones.bad), 0, true,
                  ofTotal(cones.bad, map.triangles.size(), "boundary triangles turn away in ") + p.name +
                      (cones.bad ? "; the first is " + std::to_string(cones.first) : ""));
    const int degree = conesOverADirection(map, p.nodes);
    report.near(p.degree, degree, 1, 0, true,
                "boundary triangles cover a direction " + std::to_string(degree) + " times in " + p.name);
    const Count cells = badCells(map, p.nodes);
    report.atMost(p.cells, static_cast<double>(cells.bad), 0, true,
                  ofTotal(cells.bad, cellCount(map), "tetrahedra are not positive in ") + p.name +
                      firstCell(map, p.nodes, cells));
  }
  judgeLevels(map, report);
  return report;
}

}  // namespace polestar::verify
