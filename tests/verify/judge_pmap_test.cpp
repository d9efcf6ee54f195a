// The theorem's conditions, each broken alone.
#include "verify/judge_pmap.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "pmap_maps.h"
#include "polestar/chart/foliation.h"
#include "polestar/mesh/shapes.h"
#include "support/solids.h"

namespace polestar::testing {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::UnorderedElementsAre;
using verify::PmapContents;
using verify::Report;

std::vector<std::string> failures(const Report& report) {
  std::vector<std::string> names;
  for (const verify::Check& check : report.checks) {
    if (!check.passed) names.push_back(check.name);
  }
  return names;
}

TEST(JudgePmap, ConesAndRealMapsHold) {
  for (const PmapContents& map :
       {coneMap(icosphere(2), 5), coneMap(icosphere(0), 1), contentsOf(smallMap())}) {
    const Report report = judgePmap(map);
    EXPECT_THAT(failures(report), IsEmpty()) << toText(report);
    EXPECT_EQ(toJson(report)["verdict"], "holds");
  }
}

TEST(JudgePmap, CellsAreTheLibrarysButFoundAnew) {
  const Foliation& foliation = smallMap().chart().foliation();
  const PmapContents map = contentsOf(smallMap());
  ASSERT_EQ(cellCount(map), foliation.cellCount());
  for (std::size_t id = 0; id < foliation.cellCount(); ++id) {
    const auto ours = foliation.cell(id);
    const auto theirs = cellNodes(map, id);
    EXPECT_EQ(std::set<std::size_t>(ours.begin(), ours.end()),
              std::set<std::size_t>(theirs.begin(), theirs.end()));
  }
}

TEST(JudgePmap, OneCellTurnedOverInTheSolidOrTheBall) {
  for (const bool inBall : {false, true}) {
    PmapContents map = coneMap(icosphere(2), 6);
    auto& nodes = inBall ? map.ball : map.nodes;
    const std::size_t n = map.vertices.size();
    // Beyond its neighbour, and back to its own radius.
    nodes[2 * n + 5] = (length(nodes[2 * n + 5]) / length(nodes[2 * n + 9])) * nodes[2 * n + 9];
    EXPECT_THAT(failures(judgePmap(map)), ElementsAre(inBall ? "cells_ball" : "cells_solid"));
  }
}

TEST(JudgePmap, FlatCellsAreNotPositive) {
  PmapContents map = coneMap(icosphere(1), 3);
  const std::size_t n = map.vertices.size();
  // Level 1 on level 0: prisms without height.
  for (std::size_t i = 0; i < n; ++i) map.nodes[n + i] = map.nodes[i];
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("cells_solid"));
}

TEST(JudgePmap, DoubleCoverHasEveryTetrahedronPositive) {
  // A ball wrapped twice around its axis: a sphere as a surface, every triangle outward, every cell positive.
  PmapContents map = coneMap(icosphere(0), 1);
  map.vertices = {{0, 0, 1}, {0, 0, -1}};
  map.triangles.clear();
  constexpr int kMeridians = 12;
  for (int i = 0; i < kMeridians; ++i) {
    const double azimuth = 4 * std::numbers::pi * i / kMeridians;
    map.vertices.push_back({std::cos(azimuth), std::sin(azimuth), 0});
    const int here = 2 + i, next = 2 + (i + 1) % kMeridians;
    map.triangles.push_back({0, here, next});
    map.triangles.push_back({1, next, here});
  }
  fillLevels(map, 4);
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("surface_degree", "ball_degree"));
}

TEST(JudgePmap, Mirrored) {
  PmapContents map = coneMap(icosphere(1), 3);
  for (auto* points : {&map.vertices, &map.nodes}) {
    for (auto& p : *points) p.x = -p.x;
  }
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("surface_star", "surface_degree", "cells_solid"));
  map = coneMap(icosphere(1), 3);
  for (auto& p : map.ball) p.x = -p.x;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("ball_star", "ball_degree", "cells_ball"));
}

TEST(JudgePmap, BoundaryDetached) {
  PmapContents map = coneMap(icosphere(1), 3);
  map.vertices[7].y += 1e-9;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("boundary_attached"));
  map = coneMap(icosphere(1), 3);
  map.center.z = 1e-9;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("boundary_attached"));
  map = coneMap(icosphere(1), 3);
  map.ball[3] = (1 - 1e-9) * map.ball[3];
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("ball_boundary", "ball_levels", "stated_levels"));
}

TEST(JudgePmap, LevelsOfTheBallAreSpheresThatShrink) {
  PmapContents map = coneMap(icosphere(1), 4);
  const std::size_t n = map.vertices.size();
  map.ball[2 * n + 1] = 1.0001 * map.ball[2 * n + 1];
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("ball_levels", "stated_levels"));
  map = coneMap(icosphere(1), 4);
  map.radii[2] = 0.55;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("stated_levels"));
  map.radiusIsOfGreen = false;
  EXPECT_THAT(failures(judgePmap(map)), IsEmpty());
  map.radii[2] = 0.75;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("ball_radii"));
  // The smallest number refuses, too: squares of such vanish.
  for (const double off : {1e-3, -1e-300, std::numeric_limits<double>::denorm_min()}) {
    map = coneMap(icosphere(1), 4);
    map.ball.back().x = off;
    EXPECT_THAT(failures(judgePmap(map)), ElementsAre("center")) << off;
    map = coneMap(icosphere(1), 4);
    map.nodes.back().z = off;
    EXPECT_THAT(failures(judgePmap(map)), ElementsAre("center")) << off;
  }
}

TEST(JudgePmap, AVertexBeyondAllNumbersIsOffTheSurface) {
  PmapContents map = coneMap(icosphere(1), 4);
  map.unit = 0.5;
  for (auto& p : map.vertices) p = 0.5 * p;
  EXPECT_THAT(failures(judgePmap(map)), IsEmpty());
  map.vertices[7].y = 1.7e308;  // infinite once it is scaled
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("boundary_attached"));
  map = coneMap(icosphere(1), 4);
  map.unit = 1e-310;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("boundary_attached"));
}

TEST(JudgePmap, SurfacesThatAreNone) {
  const PmapContents good = coneMap(icosphere(1), 3);
  PmapContents map = good;
  map.triangles.pop_back();
  EXPECT_THAT(failures(judgePmap(map)), Contains("surface_closed"));
  map = good;
  map.triangles.push_back(map.triangles[0]);
  EXPECT_THAT(failures(judgePmap(map)), Contains("surface_closed"));
  map = good;
  std::swap(map.triangles[4][0], map.triangles[4][1]);
  EXPECT_THAT(failures(judgePmap(map)), Contains("surface_closed"));
  map = good;
  map.triangles[4][0] = map.triangles[4][1];
  EXPECT_THAT(failures(judgePmap(map)), Contains("surface_closed"));
  // Two spheres, and two that share a vertex.
  map = good;
  const auto n = static_cast<std::int32_t>(good.vertices.size());
  map.vertices.insert(map.vertices.end(), good.vertices.begin(), good.vertices.end());
  for (const verify::Triangle& t : good.triangles) map.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
  fillLevels(map, 3);
  EXPECT_THAT(failures(judgePmap(map)),
              UnorderedElementsAre("surface_closed", "surface_degree", "ball_degree"));
  for (verify::Triangle& t : map.triangles) {
    for (auto& v : t) v = v == n ? 0 : v;
  }
  EXPECT_THAT(failures(judgePmap(map)), Contains("surface_closed"));
  // A vertex of no triangle.
  map = good;
  map.vertices.push_back({1, 0, 0});
  fillLevels(map, 3);
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("surface_closed"));
}

TEST(JudgePmap, NumbersThatAreNone) {
  PmapContents map = coneMap(icosphere(1), 3);
  map.notFinite = 1;
  map.firstNotFinite = "ball row 7";
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("finite"));
  map = coneMap(icosphere(1), 3);
  map.unit = -1;
  EXPECT_THAT(failures(judgePmap(map)), ElementsAre("frame"));
}

}  // namespace
}  // namespace polestar::testing
