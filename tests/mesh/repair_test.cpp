#include "polestar/mesh/repair.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <map>

#include "mesh/bodies.h"
#include "polestar/core/error.h"
#include "polestar/mesh/closed_surface.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;
using namespace polestar::testing;

/// What a repaired body must be: valid, of this size, of the volume of `original`.
void expectBody(const RepairedMesh& repaired, const TriMesh& original, double relativeTolerance = 1e-12) {
  const SurfaceReport report = inspectSurface(repaired.mesh);
  EXPECT_TRUE(report.valid) << report.defect;
  EXPECT_EQ(repaired.mesh.vertices.size(), original.vertices.size());
  EXPECT_EQ(repaired.mesh.triangles.size(), original.triangles.size());
  const double volume = volumeProperties(original).volume;
  EXPECT_NEAR(report.volume, volume, relativeTolerance * std::abs(volume));
  EXPECT_FALSE(repairMesh(repaired.mesh).report.changedAnything())
      << repairMesh(repaired.mesh).report.summary();
}

TEST(Repair, SoundMeshesComeBackUntouched) {
  for (const TriMesh& body : {icosphere(2), cube(3), halfBall(3), torus()}) {
    const RepairedMesh repaired = repairMesh(body);
    EXPECT_EQ(repaired.mesh.vertices, body.vertices);
    EXPECT_EQ(repaired.mesh.triangles, body.triangles);
    EXPECT_FALSE(repaired.report.changedAnything());
    EXPECT_EQ(repaired.report.summary(), "nothing to repair");
  }
}

// Welding

TEST(Repair, SoupOfEqualVerticesIsWelded) {
  const TriMesh body = icosphere(3);
  const RepairedMesh repaired = repairMesh(soup(body), {.weldTolerance = 0});
  expectBody(repaired, body);
  EXPECT_EQ(repaired.report.weldedVertices, 3 * body.triangles.size() - body.vertices.size());
  EXPECT_EQ(repaired.report.unusedVertices, 0u);
  EXPECT_THAT(repaired.report.summary(), HasSubstr("merged 3198 vertices (3840 to 642)"));
}

TEST(Repair, SignsOfZeroDoNotSplitVertices) {
  TriMesh body = icosphere(1), split = soup(body);
  for (std::size_t v = 0; v < split.vertices.size(); v += 2) {
    for (int k = 0; k < 3; ++k) {
      if (split.vertices[v][k] == 0) split.vertices[v][k] = -0.0;
    }
  }
  expectBody(repairMesh(split, {.weldTolerance = 0}), body);
}

/// Thousands of jittered corners: many straddle the cells of any grid, so rounding to cells would leave some
/// apart.
TEST(Repair, NearbyVerticesAreMergedWhereverTheyLie) {
  const TriMesh body = icosphere(4);
  const double diagonal = boundingBox(body).diagonal();
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const TriMesh jittered = soup(body, 0.25e-6 * diagonal, seed);
    const RepairedMesh repaired = repairMesh(jittered);
    expectBody(repaired, body, 1e-5);
    for (const Vec3& v : repaired.mesh.vertices) {
      EXPECT_NE(std::find(jittered.vertices.begin(), jittered.vertices.end(), v), jittered.vertices.end());
    }
    EXPECT_GT(inspectSurface(repairMesh(jittered, {.weldTolerance = 0}).mesh).boundaryEdges, 0u);
    EXPECT_GT(inspectSurface(repairMesh(jittered, {.weldTolerance = 1e-8}).mesh).boundaryEdges, 0u);
  }
}

TEST(Repair, TheToleranceIsADistanceNotACell) {
  // Two open squares side by side with a gap. The box's diagonal is known, so is the gap's share of it.
  const auto withGap = [](double gap) {
    const TriMesh mesh{
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1 + gap, 0, 0}, {2, 0, 0}, {2, 1, 0}, {1 + gap, 1, 0}},
        {{0, 1, 2}, {0, 2, 3}, {4, 5, 6}, {4, 6, 7}}};
    return repairMesh(mesh, {.weldTolerance = 1e-3}).report.weldedVertices;
  };
  const double tolerance = 1e-3 * std::sqrt(5.0);
  EXPECT_EQ(withGap(0.99 * tolerance), 2u);
  EXPECT_EQ(withGap(1.01 * tolerance), 0u);
}

TEST(Repair, ChainsOfNearbyVerticesAreOnePoint) {
  // A fan of triangles whose tips stand in a row, each within the tolerance of the next but not of the last.
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  for (int i = 0; i < 10; ++i) {
    const auto at = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.insert(mesh.vertices.end(),
                         {{1 + 0.9e-3 * i, 0, 0}, {0.5, 0.5, 0.1 * i}, {0.2, 0.1 * i, 0.7}});
    mesh.triangles.push_back({at, at + 1, at + 2});
  }
  const RepairedMesh repaired =
      repairMesh(mesh, {.weldTolerance = 1e-3 / boundingBox(mesh).diagonal(), .orient = false});
  EXPECT_EQ(repaired.report.weldedVertices, 9u);
  EXPECT_EQ(repaired.mesh.vertices[3], Vec3(1, 0, 0));  // the first in the file
}

TEST(Repair, FineDetailOfClosedSurfacesIsNotWelded) {
  // A thin plate, closed: top and bottom are nearer than the tolerance.
  const TriMesh plate = transformed(cube(4), [](const Vec3& v) { return Vec3(v[0], v[1], 1e-8 * v[2]); });
  const RepairedMesh repaired = repairMesh(plate);
  EXPECT_FALSE(repaired.report.changedAnything());
  EXPECT_TRUE(inspectSurface(repaired.mesh).valid);
}

TEST(Repair, CrowdedOpenVerticesDoNotTakeForever) {
  // 60000 open triangles in a spot of the tolerance's size, one far away that makes the box large.
  std::mt19937 random(3);
  std::uniform_real_distribution<double> offset(0, 1e-3);
  TriMesh mesh{{{0, 0, 0}, {1e3, 0, 0}, {0, 1e3, 0}}, {{0, 1, 2}}};
  for (std::int32_t t = 0; t < 60'000; ++t) {
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back({offset(random), offset(random), offset(random)});
    mesh.triangles.push_back({3 * t + 3, 3 * t + 4, 3 * t + 5});
  }
  const RepairedMesh repaired = repairMesh(mesh);
  EXPECT_EQ(repaired.mesh.triangles.size(), 1u);
  EXPECT_EQ(repaired.report.degenerateTriangles, 60'000u);
}

TEST(Repair, UnusedVerticesAreDropped) {
  TriMesh body = icosphere(1);
  const TriMesh original = body;
  body.vertices.insert(body.vertices.begin() + 5, {{9, 9, 9}, {8, 8, 8}});
  for (Triangle& t : body.triangles) {
    for (std::int32_t& v : t) v += v >= 5 ? 2 : 0;
  }
  const RepairedMesh repaired = repairMesh(body);
  EXPECT_EQ(repaired.mesh.vertices, original.vertices);
  EXPECT_EQ(repaired.mesh.triangles, original.triangles);
  EXPECT_EQ(repaired.report.unusedVertices, 2u);
  EXPECT_EQ(repaired.report.weldedVertices, 0u);
}

// Triangles

TEST(Repair, RepeatedVerticesAndDuplicatesAreDropped) {
  const TriMesh original = icosphere(1);
  TriMesh body = original;
  body.triangles.insert(body.triangles.begin() + 3, {0, 0, 5});
  body.triangles.push_back({7, 7, 7});
  const Triangle& t = original.triangles[10];
  body.triangles.push_back({t[1], t[2], t[0]});  // turned around
  body.triangles.push_back({t[0], t[2], t[1]});  // facing the other way
  body.triangles.insert(body.triangles.begin(), original.triangles[20]);
  const RepairedMesh repaired = repairMesh(body);
  expectBody(repaired, original);
  EXPECT_EQ(repaired.report.degenerateTriangles, 2u);
  EXPECT_EQ(repaired.report.duplicateTriangles, 3u);
  EXPECT_EQ(repaired.mesh.triangles[0], original.triangles[20]);  // the first one stays
  EXPECT_THAT(repaired.report.summary(), HasSubstr("dropped 3 duplicate triangles"));
}

TEST(Repair, ZeroAreaTrianglesGiveTheirLongEdgeToTheNeighbour) {
  for (int points = 1; points <= 6; ++points) {
    const TriMesh clean = radialShape(2, [](const Vec3& w) { return 1 + 0.2 * w[0]; });
    const TriMesh damaged = withZeroArea(clean, 17, points);
    ASSERT_TRUE(inspectSurface(damaged).boundaryEdges == 0);
    const RepairedMesh repaired = repairMesh(damaged);
    const SurfaceReport report = inspectSurface(repaired.mesh);
    EXPECT_TRUE(report.valid) << report.defect;
    EXPECT_GE(repaired.report.zeroAreaTriangles, static_cast<std::size_t>(points));
    // Nothing was dropped: each point on the edge now cuts both of its neighbours, and the shape is the same.
    EXPECT_EQ(repaired.mesh.triangles.size(), clean.triangles.size() + 2 * points);
    EXPECT_EQ(repaired.mesh.vertices.size(), clean.vertices.size() + points);
    EXPECT_NEAR(surfaceArea(repaired.mesh), surfaceArea(clean), 1e-12);
    EXPECT_NEAR(report.volume, volumeProperties(clean).volume, 1e-12);
    for (std::size_t t = 0; t < repaired.mesh.triangles.size(); ++t)
      EXPECT_GT(areaVector(repaired.mesh, t).norm(), 1e-6);
  }
}

TEST(Repair, ManyZeroAreaTrianglesWhereverTheMeshLies) {
  for (const Vec3& place : {Vec3(0, 0, 0), Vec3(1e6, -2e6, 5e5)}) {
    for (const double scale : {1e-7, 1.0, 1e9}) {
      TriMesh clean = icosphere(3);
      TriMesh damaged = clean;
      for (std::size_t t = 0; t < clean.triangles.size(); t += 7)
        damaged = withZeroArea(damaged, t, 1 + t % 3);
      damaged = transformed(damaged, [&](const Vec3& v) { return Vec3(scale * (v + place)); });
      const RepairedMesh repaired = repairMesh(damaged);
      const SurfaceReport report = inspectSurface(repaired.mesh);
      EXPECT_TRUE(report.valid) << report.defect;
      EXPECT_GT(repaired.report.zeroAreaTriangles, 100u);
      EXPECT_EQ(repaired.mesh.triangles.size(), damaged.triangles.size());
      EXPECT_NEAR(report.volume, volumeProperties(clean).volume * scale * scale * scale,
                  1e-8 * scale * scale * scale);
    }
  }
}

TEST(Repair, EdgesOfRoundingSizeAreCollapsed) {
  // A vertex doubled one rounding step away, the two joined by two slivers.
  TriMesh body = transformed(icosphere(2), [](const Vec3& v) { return Vec3(v + Vec3(1000, 0, 0)); });
  const TriMesh original = body;
  const std::int32_t v = 30;
  std::vector<std::int32_t> ring;  // around v, in order
  std::map<std::int32_t, std::int32_t> next;
  for (const Triangle& t : body.triangles) {
    for (int k = 0; k < 3; ++k) {
      if (t[k] == v) next[t[(k + 1) % 3]] = t[(k + 2) % 3];
    }
  }
  for (std::int32_t at = next.begin()->first; ring.size() < next.size(); at = next[at]) ring.push_back(at);
  const auto twin = static_cast<std::int32_t>(body.vertices.size());
  body.vertices.push_back(body.vertices[v]);
  body.vertices.back()[0] = std::nextafter(body.vertices[v][0], 1e9);
  for (Triangle& t : body.triangles) {
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
      if (t[k] == v && ((a == ring[0] && b == ring[1]) || (a == ring[1] && b == ring[2]))) {
        t[k] = twin;
        break;
      }
    }
  }
  body.triangles.push_back({v, twin, ring[2]});
  body.triangles.push_back({twin, v, ring[0]});
  ASSERT_EQ(inspectSurface(body).genus, 0) << inspectSurface(body).defect;
  const RepairedMesh repaired = repairMesh(body);
  expectBody(repaired, original, 1e-9);
  EXPECT_EQ(repaired.report.zeroAreaTriangles, 1u);
}

TEST(Repair, AZeroAreaTriangleThatCannotBeMendedStaysAndIsNamed) {
  // Alone, open all around: there is no neighbour to give the long edge to.
  const TriMesh line{{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}}, {{0, 1, 2}}};
  const RepairedMesh repaired = repairMesh(line);
  EXPECT_EQ(repaired.mesh.triangles.size(), 1u);
  EXPECT_EQ(repaired.report.zeroAreaTriangles, 0u);
  EXPECT_THAT(inspectSurface(repaired.mesh).defect, HasSubstr("1 triangle has no area"));
}

TEST(Repair, CraftedFansOfFlatTrianglesEndInTime) {
  // 200000 collinear triangles around one vertex, each with a neighbour: every flip must search the whole
  // fan.
  constexpr std::int32_t kTriangles = 200'000;
  TriMesh mesh{{{0, 0, 0}}, {}};
  for (std::int32_t i = 0; i <= kTriangles; ++i) mesh.vertices.push_back({1.0 + i, 0, 0});
  for (std::int32_t i = 1; i <= kTriangles; ++i) mesh.triangles.push_back({0, i, i + 1});
  const auto start = std::chrono::steady_clock::now();
  repairMesh(mesh);
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

// Orientation

TEST(Repair, EachPartKeepsTheOrientationOfMostOfItsTriangles) {
  // Two spheres side by side, both outward but for a third of their triangles, among which is the first
  // triangle of one sphere only: to follow the first triangles would set the spheres against each other.
  const TriMesh bodies = together(
      icosphere(2), transformed(icosphere(1), [](const Vec3& v) { return Vec3(v / 2 + Vec3(5, 0, 0)); }));
  TriMesh mixed = bodies;
  for (std::size_t t = 0; t < mixed.triangles.size(); t += 3) {
    std::swap(mixed.triangles[t][0], mixed.triangles[t][1]);
  }
  const RepairedMesh repaired = repairMesh(mixed);
  EXPECT_EQ(repaired.report.flippedTriangles, (mixed.triangles.size() + 2) / 3);
  EXPECT_NEAR(volumeProperties(repaired.mesh).volume, volumeProperties(bodies).volume, 1e-12);
}

TEST(Repair, TurnedTrianglesAreTurnedBackAndCounted) {
  const TriMesh body = radialShape(3, [](const Vec3& w) { return 1 + 0.5 * w[2] * w[2]; });
  for (const double share : {0.1, 0.5, 0.9}) {
    TriMesh mixed = body;
    std::mt19937 random(11);
    std::size_t turned = 0;
    for (Triangle& t : mixed.triangles) {
      if (std::uniform_real_distribution<double>()(random) < share) {
        std::swap(t[0], t[2]);
        ++turned;
      }
    }
    const RepairedMesh repaired = repairMesh(mixed);
    expectBody(repaired, body);
    EXPECT_EQ(repaired.report.flippedTriangles, turned);
    EXPECT_FALSE(repaired.report.turnedInsideOut);
    EXPECT_FALSE(repairMesh(mixed, {.orient = false}).report.changedAnything());
  }
}

TEST(Repair, AnInwardSurfaceIsTurnedAsAWhole) {
  const RepairedMesh repaired = repairMesh(insideOut(icosphere(2)));
  expectBody(repaired, icosphere(2));
  EXPECT_TRUE(repaired.report.turnedInsideOut);
  EXPECT_EQ(repaired.report.flippedTriangles, 0u);
  EXPECT_THAT(repaired.report.summary(), HasSubstr("faced inward"));
}

TEST(Repair, ACavityStaysACavity) {
  const TriMesh outer = icosphere(2);
  const TriMesh cavity = insideOut(transformed(icosphere(1), [](const Vec3& v) { return Vec3(0.5 * v); }));
  const RepairedMesh kept = repairMesh(together(cavity, outer));
  EXPECT_FALSE(kept.report.changedAnything());
  const RepairedMesh turned = repairMesh(insideOut(together(cavity, outer)));
  EXPECT_TRUE(turned.report.turnedInsideOut);
  EXPECT_NEAR(inspectSurface(turned.mesh).volume,
              volumeProperties(outer).volume + volumeProperties(cavity).volume, 1e-12);
  EXPECT_EQ(inspectSurface(turned.mesh).components, 2);
}

TEST(Repair, OneSidedSurfacesCannotBeOriented) {
  const SurfaceReport klein = inspectSurface(repairMesh(kleinBottle()).mesh);
  EXPECT_EQ(klein.boundaryEdges, 0u);
  EXPECT_GT(klein.misorientedEdgeCount, 0u);
  EXPECT_THAT(klein.defect, HasSubstr("one-sided"));
  EXPECT_GT(inspectSurface(repairMesh(moebiusStrip(12)).mesh).misorientedEdgeCount, 0u);
}

// All together

TEST(Repair, TheOrderOfTrianglesDoesNotMatterToTheShape) {
  const TriMesh body = icosphere(3);
  TriMesh damaged = soup(body, 0.2e-6 * boundingBox(body).diagonal());
  std::mt19937 random(5);
  for (int trial = 0; trial < 3; ++trial) {
    std::shuffle(damaged.triangles.begin(), damaged.triangles.end(), random);
    for (Triangle& t : damaged.triangles) {
      if (random() % 2) std::swap(t[0], t[1]);
    }
    expectBody(repairMesh(damaged), body, 1e-5);
  }
}

TEST(Repair, ImpossibleInputIsRefused) {
  const auto codeOf = [](const TriMesh& mesh, double tolerance) {
    try {
      repairMesh(mesh, {.weldTolerance = tolerance});
    } catch (const Error& error) {
      return error.code() == Errc::usage;
    }
    return false;
  };
  TriMesh badIndex = icosphere(0), negative = badIndex, notANumber = badIndex;
  badIndex.triangles[3][1] = 12;
  negative.triangles[3][1] = -1;
  notANumber.vertices[3][1] = std::nan("");
  EXPECT_TRUE(codeOf(badIndex, 1e-6));
  EXPECT_TRUE(codeOf(negative, 1e-6));
  EXPECT_TRUE(codeOf(notANumber, 1e-6));
  EXPECT_TRUE(codeOf(icosphere(0), -1));
  EXPECT_TRUE(codeOf(icosphere(0), 0.5));
  EXPECT_TRUE(codeOf(icosphere(0), std::nan("")));
  EXPECT_FALSE(codeOf(icosphere(0), 0.01));
  EXPECT_FALSE(codeOf({}, 1e-6));
}

}  // namespace
}  // namespace polestar
