#include "polestar/render/render_solid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/render/detail/camera.h"
#include "polestar/render/detail/staging.h"
#include "render/test_textures.h"
#include "support/formula_map.h"

namespace polestar {
namespace {

using testing::appearanceOf;
using testing::BallColors;
using testing::ballMap;
using testing::FormulaMap;
using testing::kNotANumber;
using testing::Plain;
using testing::radialMap;

/// With the coordinates as colors.
Rendering draw(const TriMesh& mesh, const VolumeMap& map, const RenderOptions& options,
               Context& context = Context::quiet()) {
  return renderSolid(mesh, *appearanceOf(map, std::make_shared<BallColors>()), options, context);
}

/// No light, and colors in the surroundings that no point has.
RenderOptions diagram(int size) {
  RenderOptions options;
  options.width = options.height = size;
  options.samples = 16;
  options.shading = Shading::flat;
  options.background = Vec3f(0.2f, 0.3f, 1.9f);
  options.unmapped = Vec3f(1.9f, 0, 0.9f);
  return options;
}

Vec3f colorAt(const Picture& picture, double x, double y) {
  const float* pixel = picture.pixel(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
  return {pixel[0], pixel[1], pixel[2]};
}

double difference(const Picture& a, const Picture& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.rgba.size(); ++i) sum += std::abs(a.rgba[i] - b.rgba[i]);
  return sum / static_cast<double>(a.rgba.size());
}

/// A ball with the unit ball's own coordinates, cut across the line of sight: a disk, seen square on.
TEST(RenderSolid, CutShowsTheCoordinatesOfItsPoints) {
  RenderOptions options = diagram(600);
  options.cuts = {{-options.viewDirection, 0.2}};
  const TriMesh mesh = geodesicSphere(60);
  const Rendering rendering = draw(mesh, ballMap(), options);
  EXPECT_EQ(rendering.unmappedSamples, 0u);
  const Vec3 forward = options.viewDirection.normalized();
  const auto kept = detail::SolidScene({mesh, {{{{-forward, 0.2}}, false, Vec3::Zero()}}}, 1).outline();
  const detail::Camera camera(detail::cameraPose(options), kept);
  int compared = 0;
  for (int y = 10; y < 600; y += 17) {
    for (int x = 10; x < 600; x += 17) {
      const Vec3 direction = camera.direction(x + 0.5, y + 0.5);
      const double t = (-0.2 - forward.dot(camera.position())) / forward.dot(direction);
      const Vec3 point = camera.position() + t * direction;
      if (point.norm() > 0.985) continue;
      EXPECT_LT((colorAt(rendering.picture, x, y) - BallColors::color(point)).norm(), 4e-4f) << x << " " << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 500);
  EXPECT_TRUE(colorAt(rendering.picture, 1, 1).isApprox(options.background));
}

TEST(RenderSolid, SkinShowsTheCoordinatesOfItsPoints) {
  const RenderOptions options = diagram(300);
  const TriMesh mesh = geodesicSphere(60);
  const Rendering rendering = draw(mesh, ballMap(), options);
  EXPECT_EQ(rendering.unmappedSamples, 0u);
  const detail::Camera camera(detail::cameraPose(options), mesh.vertices);
  int compared = 0;
  for (int y = 2; y < 300; y += 3) {
    for (int x = 2; x < 300; x += 3) {
      const Vec3 direction = camera.direction(x + 0.5, y + 0.5);
      const double b = camera.position().dot(direction);
      const double discriminant = b * b - camera.position().squaredNorm() + 1;
      const Vec3f color = colorAt(rendering.picture, x, y);
      EXPECT_TRUE(discriminant > -0.02 || color.isApprox(options.background));
      if (discriminant < 0.05) continue;
      const Vec3 point = camera.position() + (-b - std::sqrt(discriminant)) * direction;
      EXPECT_LT((color - BallColors::color(point)).norm(), 3e-3f) << x << " " << y;
      ++compared;
    }
  }
  EXPECT_GT(compared, 2000);
}

TEST(RenderSolid, OffsetsAreSharesOfTheExtent) {
  // A plane at a share s of the way from center to rim touches the sphere R = s in the picture's middle.
  RenderOptions options = diagram(100);
  for (const double offset : {0.55, 0.3, -0.4}) {
    options.cuts = {{-options.viewDirection, offset}};
    const Picture picture = draw(geodesicSphere(24), ballMap(), options).picture;
    const Vec3 point = -offset * options.viewDirection.normalized();
    EXPECT_LT((colorAt(picture, 50, 50) - BallColors::color(point)).norm(), 0.02f) << offset;
  }
}

TEST(RenderSolid, SharpEdgesAndRimsAreMapped) {
  // A map that is strict about the outside: no sample may be lost to rounding, not even at edges and on the
  // rim of cuts.
  RenderOptions options = diagram(400);
  options.cuts = {{{1, -0.4, 0.2}, 0.1}, {{0, 0, 1}, 0}};
  const auto cubeMap = radialMap([](const Vec3& w) { return 1 / w.cwiseAbs().maxCoeff(); });
  const Rendering rendering = draw(cube(5), cubeMap, options);
  EXPECT_GT(rendering.solidSamples, 500000u);
  EXPECT_EQ(rendering.unmappedSamples, 0u);
}

TEST(RenderSolid, SameBytesForAnyNumberOfThreads) {
  RenderOptions options;
  options.width = 150;
  options.height = 110;
  options.samples = 8;
  options.cuts = {{{1, -0.5, 0}, 0}};
  const TriMesh mesh = smoothStar(4);
  const auto map = radialMap([](const Vec3& w) {
    return 1 + 0.3 * w[2] * (w[0] * w[0] * w[0] - 3 * w[0] * w[1] * w[1]) / 0.32475952641916445;
  });
  Rendering one, two;
  withThreads(1, [&] { one = draw(mesh, map, options); });
  withThreads(2, [&] { two = draw(mesh, map, options); });
  EXPECT_EQ(one.picture.rgba, two.picture.rgba);
  EXPECT_EQ(one.solidSamples, two.solidSamples);
  EXPECT_EQ(one.unmappedSamples, two.unmappedSamples);
}

TEST(RenderSolid, UnmappedPointsAreNeutralAndCounted) {
  RenderOptions options = diagram(120);
  const FormulaMap nowhere([](const Vec3&) { return kNotANumber; }, [](const Vec3&) { return kNotANumber; });
  const Rendering lost = draw(geodesicSphere(8), nowhere, options);
  EXPECT_GT(lost.solidSamples, 0u);
  EXPECT_EQ(lost.unmappedSamples, lost.solidSamples);
  EXPECT_TRUE(colorAt(lost.picture, 60, 60).isApprox(options.unmapped));
  for (const float value : lost.picture.rgba) EXPECT_TRUE(std::isfinite(value));

  // A hole in the map: half of what is seen, as the plane goes through the line of sight.
  const Vec3 side = options.viewDirection.cross(options.up).normalized();
  const FormulaMap half([=](const Vec3& x) { return side.dot(x) > 0 ? kNotANumber : x; },
                        [](const Vec3& b) { return b; });
  options.shading = Shading::studio;
  const Rendering torn = draw(geodesicSphere(8), half, options);
  EXPECT_NEAR(static_cast<double>(torn.unmappedSamples) / torn.solidSamples, 0.5, 0.01);
  for (const float value : torn.picture.rgba) EXPECT_TRUE(std::isfinite(value));
}

TEST(RenderSolid, FarAndTinyMeshesLookTheSame) {
  RenderOptions options;
  options.width = options.height = 120;
  options.samples = 8;
  options.cuts = {{{1, -0.5, 0}, 0.1}};
  const Picture near = draw(geodesicSphere(12), ballMap(), options).picture;
  for (const auto& [scale, offset] : {std::pair{1.0, 1e6}, {1e-7, 0.0}, {1e7, 0.0}}) {
    const Vec3 center = Vec3::Constant(offset);
    const double s = scale;
    const TriMesh mesh = transformed(geodesicSphere(12), [&](const Vec3& v) { return Vec3(center + s * v); });
    const Picture other = draw(mesh, ballMap(scale * (1 + 1e-9), center), options).picture;
    EXPECT_LT(difference(near, other), 2e-4) << "scale " << scale << ", offset " << offset;
  }
}

double brightness(const Picture& picture, double x, double y) {
  double sum = 0;
  for (int dy = -2; dy <= 2; ++dy) {
    for (int dx = -2; dx <= 2; ++dx) sum += colorAt(picture, x + dx, y + dy).mean();
  }
  return sum / 25;
}

TEST(RenderSolid, StudioLightFallsFromAboveAndLeavesAShadow) {
  RenderOptions options;
  options.width = 240;
  options.height = 180;
  options.viewDirection = {0, 1, -0.3};
  const auto map = ballMap();
  const auto grey = appearanceOf(map, std::make_shared<Plain>(0.5f, 1.0f));
  const Picture picture = renderSolid(geodesicSphere(16), *grey, options).picture;
  // Nothing is cut: the key light stands on the left.
  const double lit = brightness(picture, 100, 60), shaded = brightness(picture, 150, 130);
  EXPECT_GT(lit, 1.5 * shaded);
  const double left = brightness(picture, 20, 150), shadow = brightness(picture, 190, 158);
  EXPECT_GT(left, 1.15 * shadow);
  // With a cut that opens to the right, light and shadow change sides; the far right floor is open now.
  options.cuts = {{{1, 0, 0}, 0.95}};
  const Picture turned = renderSolid(geodesicSphere(16), *grey, options).picture;
  EXPECT_GT(brightness(turned, 220, 150), 1.1 * brightness(turned, 45, 158));
  // Far away nothing but the background, dimmed at most by the vignette.
  const double corner = brightness(picture, 5, 5) / options.background.mean();
  EXPECT_GT(corner, 0.75);
  EXPECT_LT(corner, 1.001);
}

TEST(RenderSolid, StopsWhenCancelled) {
  Context context;
  context.onProgress = [&](std::string_view, double) { context.cancel(); };
  RenderOptions options;
  try {
    draw(geodesicSphere(8), ballMap(), options, context);
    FAIL() << "was not cancelled";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::cancelled);
  }
}

TEST(RenderSolid, RefusesImpossibleOptions) {
  const TriMesh mesh = geodesicSphere(4);
  auto code = [&](auto&& change) -> std::optional<Errc> {
    RenderOptions options = diagram(16);
    change(options);
    try {
      draw(mesh, ballMap(), options);
    } catch (const Error& error) {
      return error.code();
    }
    return std::nullopt;
  };
  EXPECT_EQ(code([](RenderOptions&) {}), std::nullopt);
  EXPECT_EQ(code([](RenderOptions& o) { o.width = 0; }), Errc::usage);
  EXPECT_EQ(code([](RenderOptions& o) { o.samples = 0; }), Errc::usage);
  EXPECT_EQ(code([](RenderOptions& o) { o.viewDirection = o.up; }), Errc::usage);
  EXPECT_EQ(code([](RenderOptions& o) { o.viewDirection = kNotANumber; }), Errc::usage);
  EXPECT_EQ(code([](RenderOptions& o) { o.margin = 0.5; }), Errc::usage);
  EXPECT_EQ(code([](RenderOptions& o) { o.cuts = {{Vec3::Zero(), 0}}; }), Errc::usage);
  EXPECT_EQ(code([](RenderOptions& o) { o.cuts = {{Vec3::UnitX(), 1.5}}; }), Errc::usage);
}

TEST(RenderSolid, RefusesWhatLeavesNothing) {
  RenderOptions options = diagram(16);
  EXPECT_THROW(draw(TriMesh(), ballMap(), options), Error);
  // A plane through the lowest vertex: that vertex alone stays.
  options.cuts = {{Vec3::UnitZ(), -1}};
  EXPECT_THROW(draw(geodesicSphere(4), ballMap(), options), Error);
  options.cuts = {{Vec3::UnitZ(), -0.9}};
  EXPECT_NO_THROW(draw(geodesicSphere(4), ballMap(), options));
}

}  // namespace
}  // namespace polestar
