// Iso-surfaces and field lines as geometry, against Green's function of the ball and against the solver's
// own.
#include "polestar/map/iso_geometry.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include "polestar/core/error.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/shapes.h"
#include "support/exact_green.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::starShape;

class IsoGeometry : public ::testing::Test {
 protected:
  static const BallMap& star() {
    static const BallMap map = testing::ballMap(starShape(smoothStar(3)));
    return map;
  }
  static const MeshData& dataOf(const PolyData& data, const std::string& name) {
    return *std::find_if(data.pointData.begin(), data.pointData.end(),
                         [&](const MeshData& d) { return d.name == name; });
  }
  static const PolyPart& partOf(const PolyData& data, const std::string& name) {
    return *std::find_if(data.parts.begin(), data.parts.end(),
                         [&](const PolyPart& part) { return part.name == name; });
  }
};

TEST_F(IsoGeometry, LevelsAreNestedClosedSurfacesOfOnePotential) {
  const GreenFunction& green = star().chart().green();
  const Frame& frame = green.shape().frame();
  double volume = 0;
  for (const double level : {0.05, 0.3, 0.6, 0.9, 1.0}) {
    SCOPED_TRACE(level);
    const TriMesh mesh = levelSurface(star(), level);
    EXPECT_TRUE(inspectSurface(mesh).valid);
    EXPECT_GT(volumeProperties(mesh).volume, volume);
    volume = volumeProperties(mesh).volume;
    if (level == 1) continue;
    std::vector<Vec3> inner, unused(mesh.vertices.size());
    for (const Vec3& v : mesh.vertices) inner.push_back(frame.toInner(v));
    std::vector<double> g(inner.size());
    green.evaluate(inner, g, unused);
    for (const double value : g) EXPECT_NEAR(green.ballRadius(value), level, 2e-3);
  }
  EXPECT_EQ(levelSurface(star(), 1).vertices, star().chart().green().shape().surface().mesh().vertices);
}

TEST_F(IsoGeometry, LinesOfAnOffCenterBallFollowItsStreamFunction) {
  // The unit ball about the origin with its pole aside.
  const Vec3 pole(0.4, 0, 0);
  const StarShape shape = starShape(geodesicSphere(14), pole);
  const BallMap map = testing::ballMap(shape);
  const testing::BallGreen exact{pole};
  const std::vector<Vec3> directions = evenDirections(40);
  // Outside the core, where radii are field lines.
  for (const SolidCurve& line : radialLines(map, directions, 0.3, 1e-4)) {
    EXPECT_NEAR(line.solid.back().norm(), 1, 5e-3);
    const double stream = exact.streamFunction(line.solid.front());
    for (const Vec3& x : line.solid) EXPECT_NEAR(exact.streamFunction(x), stream, 2e-2);
  }
}

TEST_F(IsoGeometry, LinesMeetIsoSurfacesAtRightAnglesOutsideTheCore) {
  const GreenFunction& green = star().chart().green();
  const Frame& frame = green.shape().frame();
  std::vector<Vec3> at, along;
  for (const SolidCurve& line : radialLines(star(), evenDirections(60), 0.65, 1e-5)) {
    for (std::size_t i = 0; i + 1 < line.solid.size(); ++i) {
      const double radius = 0.5 * (line.domain[i].norm() + line.domain[i + 1].norm());
      if (radius > 0.97) continue;
      at.push_back(frame.toInner(0.5 * (line.solid[i] + line.solid[i + 1])));
      along.push_back((line.solid[i + 1] - line.solid[i]).normalized());
    }
  }
  std::vector<double> g(at.size());
  std::vector<Vec3> gradient(at.size());
  green.evaluate(at, g, gradient);
  double worst = 1, sum = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double cosine = -along[i].dot(gradient[i].normalized());
    worst = std::min(worst, cosine);
    sum += cosine / static_cast<double>(at.size());
  }
  EXPECT_GT(sum, 0.9995);  // 1.8 degrees
  EXPECT_GT(worst, 0.985);
}

TEST_F(IsoGeometry, PartsAndDataAreWhatWasAskedFor) {
  const IsoOptions options{.levels = {0.5, 1}, .lines = 12, .graticule = 30, .sheets = 3};
  const PolyData data = isoGeometry(star(), options);
  std::vector<std::string> names;
  for (const PolyPart& part : data.parts) names.push_back(part.name);
  EXPECT_EQ(names, (std::vector<std::string>{"level_0.5", "level_1", "graticule_0.5", "graticule_1",
                                             "field_lines", "sheet_0", "sheet_1", "sheet_2"}));
  EXPECT_EQ(partOf(data, "level_0.5").triangles, star().chart().foliation().triangles);
  EXPECT_EQ(partOf(data, "graticule_1").lines.size(), 12u + 5u);
  EXPECT_EQ(partOf(data, "field_lines").lines.size(), 12u);

  const MeshData &radius = dataOf(data, "radius"), &green = dataOf(data, "green"),
                 &ball = dataOf(data, "ball"), &arc = dataOf(data, "arc");
  ASSERT_EQ(ball.values.size(), 3 * data.points.size());
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    EXPECT_NEAR(Eigen::Map<const Vec3>(&ball.values[3 * i]).norm(), radius.values[i], 1e-15);
    EXPECT_TRUE(std::isfinite(green.values[i]));
  }
  for (const std::int32_t v : partOf(data, "level_1").triangles[0]) EXPECT_NEAR(green.values[v], 0, 1e-12);
  for (const auto& line : partOf(data, "field_lines").lines) {
    EXPECT_EQ(arc.values[line.front()], 0);
    for (std::size_t i = 1; i < line.size(); ++i) {
      EXPECT_GT(arc.values[line[i]], arc.values[line[i - 1]]);
      EXPECT_GT(radius.values[line[i]], radius.values[line[i - 1]]);
      EXPECT_LE(green.values[line[i]], green.values[line[i - 1]]);
    }
  }
  // Latitudes are closed curves; all curves of a level lie on its iso-surface.
  const auto& rings = partOf(data, "graticule_0.5").lines;
  EXPECT_LT((data.points[rings.back().front()] - data.points[rings.back().back()]).norm(), 1e-9);
  for (const auto& line : rings) {
    for (const std::int32_t v : line) EXPECT_NEAR(radius.values[v], 0.5, 1e-12);
  }
}

// Sheets meet each other along the ball's axis and end on the surface; no quad of theirs is turned over.
TEST_F(IsoGeometry, SheetsAreWholeHalfDisks) {
  const PolyData data = isoGeometry(star(), {.sheets = 2});
  for (const PolyPart& part : data.parts) {
    std::map<std::pair<std::int32_t, std::int32_t>, int> edges;
    const auto count = [&](std::span<const std::int32_t> corners) {
      for (std::size_t k = 0; k < corners.size(); ++k)
        ++edges[{corners[k], corners[(k + 1) % corners.size()]}];
    };
    for (const Triangle& t : part.triangles) count(t);
    for (const auto& q : part.quads) count(q);
    std::size_t rim = 0;
    for (const auto& [edge, times] : edges) {
      EXPECT_EQ(times, 1) << "neighbours go round the same way";
      rim += !edges.contains({edge.second, edge.first});
    }
    EXPECT_EQ(rim, 48u + 2 * 24u);
  }
}

TEST_F(IsoGeometry, DirectionsAreSpreadEvenly) {
  const std::vector<Vec3> directions = evenDirections(500);
  Vec3 mean = Vec3::Zero();
  double nearest = 10;
  for (const Vec3& a : directions) {
    EXPECT_NEAR(a.norm(), 1, 1e-15);
    mean += a / 500;
    for (const Vec3& b : directions) {
      if (&a != &b) nearest = std::min(nearest, (a - b).norm());
    }
  }
  EXPECT_LT(mean.norm(), 0.01);
  EXPECT_GT(nearest, 0.7 * std::sqrt(4 * 3.1416 / 500));
}

TEST_F(IsoGeometry, OptionsAreChecked) {
  for (const IsoOptions& wrong : {IsoOptions{.levels = {0.0}}, IsoOptions{.levels = {1.1}},
                                  IsoOptions{.lines = -1}, IsoOptions{.levels = {1}, .graticule = 0.5},
                                  IsoOptions{.graticule = 15}, IsoOptions{.levels = {1}, .tolerance = 0}}) {
    try {
      isoGeometry(star(), wrong);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
    }
  }
}

}  // namespace
}  // namespace polestar
