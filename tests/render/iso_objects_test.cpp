// Shells and field lines on the stage: where they are, and what a picture shows of them.
#include "polestar/render/iso_objects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/shapes.h"
#include "render/test_textures.h"
#include "support/formula_map.h"
#include "support/solids.h"

namespace polestar {
namespace {

/// Of the unit ball about its own center: R is the distance from it.
const BallMap& ball() {
  static const BallMap map = testing::ballMap(testing::starShape(icosphere(4), Vec3(0, 0, 0)));
  return map;
}

TEST(IsoObjects, ShellsAndLinesOfABallAreSpheresAndRadii) {
  const std::vector<StageObject> objects = isoObjects(ball(), icosphere(4), ball().sphere().directions,
                                                      {.shells = {0.8, 0.4}, .lines = 20, .lineWidth = 0.01});
  ASSERT_EQ(objects.size(), 3u);
  EXPECT_FALSE(objects[0].cut) << "the innermost stays whole";
  EXPECT_TRUE(objects[1].cut);
  EXPECT_FALSE(objects[2].cut);
  for (const Vec3& v : objects[0].mesh.vertices) EXPECT_NEAR(v.norm(), 0.4, 5e-3);
  for (const Vec3& v : objects[1].mesh.vertices) EXPECT_NEAR(v.norm(), 0.8, 5e-3);
  EXPECT_FALSE(objects[0].color.isApprox(objects[1].color));
  // Tubes of radius 0.005 diagonals around radii, from the inner shell to the surface.
  const double radius = 0.005 * boundingBox(icosphere(4)).diagonal();
  double least = 10, most = 0;
  for (const Vec3& v : objects[2].mesh.vertices) {
    least = std::min(least, v.norm());
    most = std::max(most, v.norm());
  }
  EXPECT_NEAR(least, 0.4 - radius, 5e-3);
  EXPECT_NEAR(most, 1 + radius, 5e-3);
}

TEST(IsoObjects, ATubeIsClosedAndAsThickAsAsked) {
  std::vector<Vec3> line;
  for (int i = 0; i <= 40; ++i) {
    const double t = 0.05 * i;
    line.emplace_back(std::cos(t), std::sin(t), 0.3 * t);  // a helix
  }
  const double radius = 0.02;
  const TriMesh tube = tubeAround(line, radius);
  EXPECT_TRUE(inspectSurface(tube).valid);
  double length = 0;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) length += (line[i + 1] - line[i]).norm();
  // Eight sides instead of a circle.
  const double across = 8 / 2.0 * std::sin(2 * std::numbers::pi / 8) * radius * radius;
  EXPECT_NEAR(volumeProperties(tube).volume, across * length, 0.1 * across * length);
  EXPECT_GT(volumeProperties(tube).volume, across * length);
  const TriMesh shortest = tubeAround(std::vector<Vec3>{{0, 0, 0}, {0, 0, 1}}, 0.1);
  EXPECT_TRUE(inspectSurface(shortest).valid);
  EXPECT_THROW(tubeAround(std::vector<Vec3>{{0, 0, 0}}, 0.1), Error);
}

// Cut open across the line of sight, a hollow ball shows the inside of its skin around the shell's around the
// innermost one, whole.
TEST(IsoObjects, APictureShowsThemNested) {
  RenderOptions options;
  options.width = options.height = 200;
  options.samples = 4;
  options.shading = Shading::flat;
  options.background = Vec3f(1, 1, 1);
  options.viewDirection = Vec3(0, 1, 0);
  options.cuts = {{Vec3(0, -1, 0), 0}};
  options.hollow = true;
  options.aovs = true;
  options.objects = {
      {transformed(icosphere(4), [](const Vec3& v) { return Vec3(0.3 * v); }), Vec3f(1, 0, 0), 0, false},
      {transformed(icosphere(4), [](const Vec3& v) { return Vec3(0.7 * v); }), Vec3f(0, 1, 0), 0, true}};
  const TriMesh surface = icosphere(4);
  const testing::FormulaMap map = testing::ballMap();
  const auto look = testing::appearanceOf(map, std::make_shared<testing::BallColors>());
  const Rendering rendering = renderSolid(surface, *look, options);
  const auto idAt = [&](double x) {  // across the middle, in radii of the rim
    double reach = 0;
    for (int i = 0; i < 200; ++i) {
      if (rendering.picture.channels[8].values[100 * 200 + static_cast<std::size_t>(i)] != 0)
        reach = std::max(reach, std::abs(i + 0.5 - 100));
    }
    const auto pixel = static_cast<std::size_t>(100 + x * reach);
    return rendering.picture.channels[8].values[100 * 200 + pixel];
  };
  EXPECT_EQ(idAt(0), 10001);
  EXPECT_EQ(idAt(0.2), 10001);
  EXPECT_EQ(idAt(-0.5), 10002);
  EXPECT_EQ(idAt(0.5), 10002);
  EXPECT_EQ(idAt(0.85), 1);
  EXPECT_EQ(rendering.unmappedSamples, 0u);
}

TEST(IsoObjects, RefusesWhatCannotBe) {
  for (const IsoObjectOptions& wrong :
       {IsoObjectOptions{.shells = {1.0}}, IsoObjectOptions{.shells = {0.0}}, IsoObjectOptions{.lines = -1},
        IsoObjectOptions{.lines = 3, .lineWidth = 0}}) {
    try {
      isoObjects(ball(), icosphere(4), ball().sphere().directions, wrong);
      ADD_FAILURE();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage);
    }
  }
  RenderOptions options;
  options.cuts = {{Vec3::UnitX(), 0}};
  options.cutMode = CutMode::explode;
  options.objects = {{icosphere(1), Vec3f(1, 0, 0), 0, true}};
  EXPECT_THROW(options.validate(), Error);
}

}  // namespace
}  // namespace polestar
