#include "polestar/render/render_solid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/render/detail/camera.h"
#include "polestar/texture/soccer_panel.h"
#include "render/analytic_maps.h"

namespace polestar {
namespace {

using testing::ballMap;
using testing::FormulaMap;
using testing::kNotANumber;
using testing::radialMap;

/// Flat colors in which every part is told from the others, and no light.
RenderOptions diagram(int size) {
  RenderOptions options;
  options.width = options.height = size;
  options.samples = 16;
  options.shading = Shading::flat;
  options.palette.hexagon = options.palette.hexagonRim = options.palette.hexagonCore = Vec3f(1, 1, 1);
  options.palette.pentagon = options.palette.pentagonRim = options.palette.pentagonCore =
      Vec3f(1, 0.5f, 0.5f);
  options.palette.hexagonShade = options.palette.pentagonShade = Vec3f(0.3f, 0.3f, 0.3f);
  options.palette.core = Vec3f(0, 1, 0);
  options.palette.pole = Vec3f(0, 0, 1);
  options.palette.line = Vec3f::Zero();
  options.palette.background = Vec3f(0.2f, 0.3f, 0.9f);
  options.palette.unmapped = Vec3f(0.9f, 0, 0.9f);
  return options;
}

Vec3f colorAt(const Picture& picture, double x, double y) {
  const float* pixel = picture.pixel(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
  return {pixel[0], pixel[1], pixel[2]};
}

/// Cut across the line of sight, through the center: the cut is a disk, seen square on.
TEST(RenderSolid, CutBallShowsItsRingsWhereTheyBelong) {
  RenderOptions options = diagram(600);
  options.samples = 4;
  options.cuts = {{-options.viewDirection, 0}};
  options.lineWidth = 0.004;
  const Rendering rendering = renderSolid(geodesicSphere(24), ballMap(), options);
  EXPECT_EQ(rendering.unmappedSamples, 0u);
  const Picture& picture = rendering.picture;
  for (const auto& [x, y] : {std::pair{1, 1}, {598, 1}, {1, 598}, {598, 598}}) {
    EXPECT_TRUE(colorAt(picture, x, y).isApprox(options.palette.background));
  }
  // The rim from the camera's own fit: the kept half lies behind the disk and must fill the frame but for the
  // margin.
  const double rim = 300 - options.margin * 600;
  EXPECT_TRUE(colorAt(picture, 300, 300).isApprox(options.palette.pole));
  EXPECT_TRUE(colorAt(picture, 300 + 0.05 * rim, 300).isApprox(options.palette.core));

  // In a direction far from seams, going outwards.
  const detail::Camera axes(options.viewDirection, options.up, 1, 1, 1, 0, std::vector<Vec3>{Vec3::Zero()});
  double angle = 0, clearance = 0;
  for (double a = 0; a < 2 * M_PI; a += 0.01) {
    const double d = soccerPanel(std::cos(a) * axes.right() + std::sin(a) * axes.up()).seamDistance;
    if (d > clearance) {
      clearance = d;
      angle = a;
    }
  }
  auto along = [&](double r) {
    return colorAt(picture, 300 + r * rim * std::cos(angle), 300 - r * rim * std::sin(angle));
  };
  for (int k = 1; k < 10; ++k) {
    // Within two pixels of where it belongs there is a line, and none elsewhere in the band.
    float darkest = 1;
    for (double d = -2; d <= 2; d += 0.5) darkest = std::min(darkest, along(0.1 * k + d / rim)[0]);
    EXPECT_LT(darkest, 0.5f) << "ring " << k;
    EXPECT_GT(along(0.1 * k + 0.03)[0], 0.6f) << "band " << k;
  }
  EXPECT_TRUE(along(1.02).isApprox(options.palette.background));
  EXPECT_GT(std::abs(along(0.53)[0] - along(0.63)[0]), 0.1f);
}

TEST(RenderSolid, CutAtAShareOfTheExtentShowsThatRadius) {
  // A plane at a share s of the way from center to rim touches the sphere R = s in the middle of the picture;
  // odd bands are shaded, even ones are not.
  RenderOptions options = diagram(200);
  options.lineWidth = 1e-4;
  for (const double offset : {0.55, 0.46, 0.35, -0.45, -0.35}) {
    const Vec3 radial = -std::copysign(1.0, offset) * options.viewDirection.normalized();
    ASSERT_GT(soccerPanel(radial).seamDistance, 0.05);
    options.cuts = {{-options.viewDirection, offset}};
    const Picture picture = renderSolid(geodesicSphere(24), ballMap(), options).picture;
    const bool odd = static_cast<int>(std::abs(offset) * 10) % 2 == 1;
    EXPECT_NEAR(colorAt(picture, 100, 100)[0], odd ? 1.0f : 0.7f, 0.1f) << offset;
  }
}

TEST(RenderSolid, SkinOfTheBallShowsThePanelOfEveryDirection) {
  const RenderOptions options = diagram(300);
  const TriMesh mesh = geodesicSphere(40);
  const Rendering rendering = renderSolid(mesh, ballMap(), options);
  EXPECT_EQ(rendering.unmappedSamples, 0u);
  const detail::Camera camera(options.viewDirection, options.up, options.fieldOfView, 300, 300,
                              options.margin, mesh.vertices);
  int pentagons = 0, hexagons = 0;
  for (int y = 2; y < 300; y += 3) {
    for (int x = 2; x < 300; x += 3) {
      const detail::Ray ray = camera.ray(x + 0.5, y + 0.5);
      const double b = ray.origin.dot(ray.direction);
      const double discriminant = b * b - ray.origin.squaredNorm() + 1;
      const Vec3f color = colorAt(rendering.picture, x, y);
      EXPECT_TRUE(discriminant > -0.02 || color.isApprox(options.palette.background));
      if (discriminant < 0.05) continue;
      const SoccerPanel panel = soccerPanel(ray.origin + (-b - std::sqrt(discriminant)) * ray.direction);
      if (panel.seamDistance < 0.04) continue;
      ++(panel.pentagon() ? pentagons : hexagons);
      EXPECT_TRUE(
          color.isApprox(panel.pentagon() ? options.palette.pentagon : options.palette.hexagon, 1e-3f))
          << x << " " << y;
    }
  }
  EXPECT_GT(pentagons, 300);
  EXPECT_GT(hexagons, 1000);
}

TEST(RenderSolid, SharpEdgesAndRimsAreMapped) {
  // A map that is strict about the outside: no sample may be lost to rounding, not even at edges and on the
  // rim of cuts.
  RenderOptions options = diagram(400);
  options.cuts = {{{1, -0.4, 0.2}, 0.1}, {{0, 0, 1}, 0}};
  const auto cubeMap = radialMap([](const Vec3& w) { return 1 / w.cwiseAbs().maxCoeff(); });
  const Rendering rendering = renderSolid(cube(5), cubeMap, options);
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
  withThreads(1, [&] { one = renderSolid(mesh, map, options); });
  withThreads(2, [&] { two = renderSolid(mesh, map, options); });
  EXPECT_EQ(one.picture.rgba, two.picture.rgba);
  EXPECT_EQ(one.solidSamples, two.solidSamples);
  EXPECT_EQ(one.unmappedSamples, two.unmappedSamples);
}

TEST(RenderSolid, UnmappedPointsAreNeutralAndCounted) {
  RenderOptions options = diagram(120);
  const FormulaMap nowhere([](const Vec3&) { return kNotANumber; }, [](const Vec3&) { return kNotANumber; });
  const Rendering lost = renderSolid(geodesicSphere(8), nowhere, options);
  EXPECT_GT(lost.solidSamples, 0u);
  EXPECT_EQ(lost.unmappedSamples, lost.solidSamples);
  EXPECT_TRUE(colorAt(lost.picture, 60, 60).isApprox(options.palette.unmapped));
  for (const float value : lost.picture.rgba) EXPECT_TRUE(std::isfinite(value));

  // A hole in the map: half of what is seen, as the plane goes through the line of sight.
  const Vec3 side = options.viewDirection.cross(options.up).normalized();
  const FormulaMap half([=](const Vec3& x) { return side.dot(x) > 0 ? kNotANumber : x; },
                        [](const Vec3& b) { return b; });
  options.shading = Shading::studio;
  const Rendering torn = renderSolid(geodesicSphere(8), half, options);
  EXPECT_NEAR(static_cast<double>(torn.unmappedSamples) / torn.solidSamples, 0.5, 0.01);
  for (const float value : torn.picture.rgba) EXPECT_TRUE(std::isfinite(value));
}

TEST(RenderSolid, FarAndTinyMeshesLookTheSame) {
  RenderOptions options;
  options.width = options.height = 120;
  options.samples = 8;
  options.cuts = {{{1, -0.5, 0}, 0.1}};
  const Picture near = renderSolid(geodesicSphere(12), ballMap(), options).picture;
  for (const auto& [scale, offset] : {std::pair{1.0, 1e6}, {1e-7, 0.0}, {1e7, 0.0}}) {
    const Vec3 center = Vec3::Constant(offset);
    const double s = scale;
    const TriMesh mesh = transformed(geodesicSphere(12), [&](const Vec3& v) { return Vec3(center + s * v); });
    const Picture other = renderSolid(mesh, ballMap(scale * (1 + 1e-9), center), options).picture;
    double difference = 0;
    for (std::size_t i = 0; i < near.rgba.size(); ++i) difference += std::abs(near.rgba[i] - other.rgba[i]);
    EXPECT_LT(difference / near.rgba.size(), 2e-4) << "scale " << scale << ", offset " << offset;
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
  options.palette.hexagon = options.palette.pentagon = options.palette.line = Vec3f::Constant(0.5f);
  const Picture picture = renderSolid(geodesicSphere(16), ballMap(), options).picture;
  // Nothing is cut: the key light stands on the left.
  const double lit = brightness(picture, 100, 60), shaded = brightness(picture, 150, 130);
  EXPECT_GT(lit, 1.5 * shaded);
  const double left = brightness(picture, 20, 150), shadow = brightness(picture, 190, 158);
  EXPECT_GT(left, 1.15 * shadow);
  // With a cut that opens to the right, light and shadow change sides; the far right floor is open now.
  options.cuts = {{{1, 0, 0}, 0.95}};
  const Picture turned = renderSolid(geodesicSphere(16), ballMap(), options).picture;
  EXPECT_GT(brightness(turned, 220, 150), 1.1 * brightness(turned, 45, 158));
  // Far away nothing but the background, dimmed at most by the vignette.
  const double corner = brightness(picture, 5, 5) / options.palette.background.mean();
  EXPECT_GT(corner, 0.75);
  EXPECT_LT(corner, 1.001);
}

TEST(RenderSolid, StopsWhenCancelled) {
  Context context;
  context.onProgress = [&](std::string_view, double) { context.cancel(); };
  RenderOptions options;
  try {
    renderSolid(geodesicSphere(8), ballMap(), options, context);
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
      renderSolid(mesh, ballMap(), options);
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
  EXPECT_THROW(renderSolid(TriMesh(), ballMap(), options), Error);
  // A plane through the lowest vertex: that vertex alone stays.
  options.cuts = {{Vec3::UnitZ(), -1}};
  EXPECT_THROW(renderSolid(geodesicSphere(4), ballMap(), options), Error);
  options.cuts = {{Vec3::UnitZ(), -0.9}};
  EXPECT_NO_THROW(renderSolid(geodesicSphere(4), ballMap(), options));
}

}  // namespace
}  // namespace polestar
