// Pictures as products: crops, AOVs, exploded pieces, turntables, and light that neither appears nor
// vanishes.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <numbers>

#include "polestar/core/threads.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/render/detail/camera.h"
#include "polestar/render/detail/sampling.h"
#include "polestar/render/detail/staging.h"
#include "polestar/render/detail/studio.h"
#include "polestar/render/mapped_appearance.h"
#include "render/test_textures.h"
#include "support/formula_map.h"

namespace polestar {
namespace {

using testing::appearanceOf;
using testing::BallColors;
using testing::ballMap;
using testing::Plain;

RenderOptions smallPicture() {
  RenderOptions options;
  options.width = 150;
  options.height = 110;
  options.samples = 6;
  options.cuts = {{{1, -0.5, 0}, 0}};
  options.aovs = true;
  return options;
}

const PictureChannel& channel(const Picture& picture, const std::string& name) {
  for (const PictureChannel& c : picture.channels) {
    if (c.name == name) return c;
  }
  throw std::runtime_error("no channel " + name);
}

Vec3 vectorAt(const Picture& picture, const std::string& name, std::size_t pixel) {
  return {channel(picture, name + ".x").values[pixel], channel(picture, name + ".y").values[pixel],
          channel(picture, name + ".z").values[pixel]};
}

/// NaN, as G has without a map that knows it, is equal to itself here.
bool sameBits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

TEST(SolidPicture, ACropIsTheCropOfTheFullPicture) {
  const auto map = ballMap();
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  RenderOptions options = smallPicture();
  const TriMesh mesh = geodesicSphere(12);
  const Picture full = renderSolid(mesh, *look, options).picture;
  for (const PixelBox box :
       {PixelBox{0, 0, 1, 1}, {33, 20, 97, 71}, {149, 109, 150, 110}, {0, 0, 150, 110}}) {
    options.crop = box;
    const Picture crop = renderSolid(mesh, *look, options).picture;
    ASSERT_EQ(crop.width, box.x1 - box.x0);
    ASSERT_EQ(crop.height, box.y1 - box.y0);
    EXPECT_EQ(crop.x0, box.x0);
    EXPECT_EQ(crop.fullWidth, 150);
    for (int y = 0; y < crop.height; ++y) {
      for (int x = 0; x < crop.width; ++x) {
        for (int c = 0; c < 4; ++c) ASSERT_EQ(crop.pixel(x, y)[c], full.pixel(x + box.x0, y + box.y0)[c]);
        for (std::size_t k = 0; k < crop.channels.size(); ++k) {
          const auto at = static_cast<std::size_t>(y * crop.width + x),
                     inFull = static_cast<std::size_t>((y + box.y0) * 150 + x + box.x0);
          ASSERT_TRUE(sameBits(crop.channels[k].values[at], full.channels[k].values[inFull]));
        }
      }
    }
  }
}

TEST(SolidPicture, TheSameBytesForAnyNumberOfThreads) {
  const auto map = ballMap();
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  RenderOptions options = smallPicture();
  options.cuts = {{Vec3::UnitX(), 0}, {Vec3::UnitY(), 0.2}};
  options.cutMode = CutMode::explode;
  const SolidRenderer renderer(geodesicSphere(12), *look, options);
  Rendering one, three;
  withThreads(1, [&] { one = renderer.render(); });
  withThreads(3, [&] { three = renderer.render(); });
  EXPECT_EQ(one.picture.rgba, three.picture.rgba);
  for (std::size_t k = 0; k < one.picture.channels.size(); ++k) {
    const std::vector<float>&a = one.picture.channels[k].values, &b = three.picture.channels[k].values;
    EXPECT_TRUE(std::equal(a.begin(), a.end(), b.begin(), b.end(), sameBits));
  }
  EXPECT_EQ(one.primaryRays, three.primaryRays);
  EXPECT_EQ(one.lightRays, three.lightRays);
}

/// A ball of radius 2 about (3, 4, 5), half of it cut away towards the camera's right.
TEST(SolidPicture, AovsAreThoseOfTheBall) {
  const Vec3 center(3, 4, 5);
  const double radius = 2;
  const auto map = ballMap(radius * (1 + 1e-9), center);
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  RenderOptions options = smallPicture();
  options.samples = 1;
  options.cuts = {{Vec3::UnitX(), 0}};
  const TriMesh mesh =
      transformed(geodesicSphere(80), [&](const Vec3& v) { return Vec3(center + radius * v); });
  const SolidRenderer renderer(mesh, *look, options);
  const Picture picture = renderer.render().picture;
  // The camera from its own metadata: a point's place in it, and its place on the screen.
  const auto& m = picture.camera->worldToCamera;
  Mat3 axes;
  Vec3 shift;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) axes(j, i) = m[4 * i + j];
    shift[i] = m[12 + i];
  }
  const Vec3 eye = -axes.transpose() * shift, forward = axes.row(2);
  const double tangent = std::tan(0.5 * options.fieldOfView);
  int cuts = 0, skins = 0;
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) {
      const double a = tangent * (2 * x + 1 - options.width) / options.height,
                   b = tangent * (options.height - 2 * y - 1) / options.height;
      const Vec3 d = (axes.transpose() * Vec3(a, b, 1)).normalized();
      const double half = d.dot(eye - center),
                   discriminant = half * half - (eye - center).squaredNorm() + radius * radius;
      const auto pixel = static_cast<std::size_t>(y * options.width + x);
      const float id = channel(picture, "id").values[pixel];
      EXPECT_TRUE(discriminant > -0.02 * radius || id == 0);
      if (discriminant < 0.1) continue;
      const double onPlane = (center[0] - eye[0]) / d[0], in = -half - std::sqrt(discriminant);
      const Vec3 plane = eye + onPlane * d, skin = eye + in * d;
      const bool cut = (plane - center).norm() < radius - 0.02;
      if (!cut && skin[0] > center[0] - 0.02) continue;  // the rim, or gone
      const Vec3 point = cut ? plane : skin;
      EXPECT_EQ(id, cut ? 2 : 1) << x << " " << y;
      EXPECT_NEAR(channel(picture, "Z").values[pixel], forward.dot(point - eye), 2e-3) << x << " " << y;
      const Vec3 normal = cut ? Vec3(Vec3::UnitX()) : Vec3((skin - center) / radius);
      EXPECT_LT((vectorAt(picture, "N", pixel) - normal).norm(), 2e-3);
      EXPECT_LT((vectorAt(picture, "ball", pixel) - (point - center) / radius).norm(), 2e-3);
      ++(cut ? cuts : skins);
    }
  }
  EXPECT_GT(cuts, 500);
  EXPECT_GT(skins, 500);
}

TEST(SolidPicture, PiecesThatDoNotMoveAreTheWholeSolid) {
  const auto map = testing::radialMap([](const Vec3& w) { return 1 / w.cwiseAbs().maxCoeff(); });
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  RenderOptions options = smallPicture();
  options.shading = Shading::flat;
  options.cuts = {};
  const Rendering whole = renderSolid(cube(5), *look, options);
  options.cuts = {{{1, 0.2, 0.1}, 0}, {{0, 1, -0.3}, 0.1}, {{0.1, 0, 1}, -0.2}};
  options.cutMode = CutMode::explode;
  options.explode = 0;
  const Rendering pieces = renderSolid(cube(5), *look, options);
  EXPECT_EQ(pieces.unmappedSamples, 0u);
  EXPECT_NEAR(static_cast<double>(pieces.solidSamples), static_cast<double>(whole.solidSamples), 2.0);
  int differ = 0;
  for (std::size_t i = 0; i < whole.picture.rgba.size(); ++i)
    differ += std::abs(whole.picture.rgba[i] - pieces.picture.rgba[i]) > 4e-3f;
  // Along the seams one pixel has two patches instead of one.
  EXPECT_LT(differ, 60);
}

TEST(SolidPicture, ExplodedPiecesStandApartAndAreAllThere) {
  const auto map = ballMap(1 + 1e-9);
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  RenderOptions options = smallPicture();
  options.samples = 1;
  options.cuts = {{Vec3::UnitX(), 0}, {Vec3::UnitY(), 0}, {Vec3::UnitZ(), 0}};
  options.cutMode = CutMode::explode;
  options.explode = 0.6;
  const Picture picture = renderSolid(geodesicSphere(40), *look, options).picture;
  std::array<int, 8> seen{};
  for (std::size_t i = 0; i < picture.rgba.size() / 4; ++i) {
    const auto id = static_cast<int>(channel(picture, "id").values[i]);
    if (id == 0) continue;
    const int piece = id / 100;
    ASSERT_LT(piece, 8);
    ++seen[static_cast<std::size_t>(piece)];
    // Every point has the coordinates of the octant that its piece is.
    const Vec3 ball = vectorAt(picture, "ball", i);
    for (int k = 0; k < 3; ++k) EXPECT_GT((piece >> k & 1 ? 1 : -1) * ball[k], -1e-4) << piece;
    EXPECT_NEAR(id % 100 > 1 ? ball[id % 100 - 2] : ball.norm() - 1, 0, 1e-5);
  }
  EXPECT_GE(std::count_if(seen.begin(), seen.end(), [](int n) { return n > 50; }), 7);
}

TEST(SolidPicture, SlicesKeepWhatIsInsideOfAllPlanes) {
  const auto map = ballMap(1 + 1e-9);
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  RenderOptions options = smallPicture();
  options.cuts = {{Vec3::UnitZ(), 0.3}, {-Vec3::UnitZ(), 0.3}};
  options.cutMode = CutMode::slices;
  const Picture picture = renderSolid(geodesicSphere(40), *look, options).picture;
  int seen = 0;
  for (std::size_t i = 0; i < picture.rgba.size() / 4; ++i) {
    if (channel(picture, "id").values[i] == 0) continue;
    EXPECT_LT(std::abs(vectorAt(picture, "ball", i)[2]), 0.301);
    ++seen;
  }
  EXPECT_GT(seen, 1000);
}

TEST(SolidPicture, ATurnedSolidIsWhatTheTurntableShows) {
  const double angle = 0.8;
  const Mat3 turn = Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix();
  const auto radius = [](const Vec3& w) { return 1 + 0.3 * w[0] * w[0] * w[0]; };
  const auto map = testing::radialMap(radius);
  const auto turnedMap = testing::FormulaMap(
      [&](const Vec3& x) -> Vec3 {
        Vec3 ball;
        const Vec3 back = turn.transpose() * x;
        map.forward({&back, 1}, {&ball, 1});
        return ball;
      },
      [&](const Vec3& b) -> Vec3 {
        Vec3 x;
        map.inverse({&b, 1}, {&x, 1});
        return turn * x;
      });
  const TriMesh mesh = transformed(geodesicSphere(30), [&](const Vec3& w) { return Vec3(radius(w) * w); });
  const TriMesh turned = transformed(mesh, [&](const Vec3& v) { return Vec3(turn * v); });
  RenderOptions options = smallPicture();
  options.cuts = {};
  options.aovs = false;
  options.samples = 16;
  // The same frame for both: a box that both fit in.
  options.framed = cornersOf({Vec3::Constant(-1.4), Vec3::Constant(1.4)});
  const auto look = appearanceOf(map, std::make_shared<BallColors>());
  const auto turnedLook = appearanceOf(turnedMap, std::make_shared<BallColors>());
  const Picture byTable = SolidRenderer(mesh, *look, options).render(angle).picture;
  const Picture byHand = SolidRenderer(turned, *turnedLook, options).render().picture;
  // Directions to the dome are other ones, so lit pictures agree by the block.
  for (int y0 = 0; y0 < options.height; y0 += 11) {
    for (int x0 = 0; x0 < options.width; x0 += 15) {
      double sum = 0;
      for (int y = y0; y < y0 + 11; ++y) {
        for (int x = x0; x < x0 + 15; ++x)
          sum += static_cast<double>(byTable.pixel(x, y)[0] - byHand.pixel(x, y)[0]);
      }
      EXPECT_NEAR(sum / 165, 0, 6e-3) << x0 << " " << y0;
    }
  }
  options.shading = Shading::flat;
  const Picture flat = SolidRenderer(mesh, *look, options).render(angle).picture;
  const Picture flatByHand = SolidRenderer(turned, *turnedLook, options).render().picture;
  double sum = 0;
  for (std::size_t i = 0; i < flat.rgba.size(); ++i) sum += std::abs(flat.rgba[i] - flatByHand.rgba[i]);
  EXPECT_LT(sum / static_cast<double>(flat.rgba.size()), 2e-4);
}

TEST(SolidPicture, TheTurntableKeepsTheSolidInTheFrame) {
  const auto map = ballMap(3);
  const auto look = appearanceOf(map, std::make_shared<Plain>(0.5f));
  RenderOptions options = smallPicture();
  options.shading = Shading::flat;
  options.cuts = {};
  options.aovs = false;
  options.samples = 4;
  for (int i = 0; i < 8; ++i) options.turns.push_back(i * std::numbers::pi / 4);
  // A long bar through the axis: framed for one turn it would leave the picture at another.
  const TriMesh bar =
      transformed(cube(2), [](const Vec3& v) { return Vec3(2.5 * v[0], 0.2 * v[1], 0.2 * v[2]); });
  const SolidRenderer renderer(bar, *look, options);
  for (const double turn : options.turns) {
    const Picture picture = renderer.render(turn).picture;
    for (int x = 0; x < options.width; ++x) EXPECT_EQ(picture.pixel(x, 2)[0], options.background[0]);
    for (int y = 0; y < options.height; ++y) EXPECT_EQ(picture.pixel(2, y)[0], options.background[0]);
  }
}

TEST(SolidPicture, TransparentBackgroundsHaveTheShadowAsAlpha) {
  const auto map = ballMap(1 + 1e-9);
  const auto look = appearanceOf(map, std::make_shared<Plain>(0.5f));
  RenderOptions options = smallPicture();
  options.transparent = true;
  const Picture picture = renderSolid(geodesicSphere(20), *look, options).picture;
  int shadow = 0, solid = 0;
  for (std::size_t i = 0; i < picture.rgba.size() / 4; ++i) {
    const float* rgba = &picture.rgba[4 * i];
    EXPECT_GE(rgba[3], 0);
    EXPECT_LE(rgba[3], 1);
    const bool dark = rgba[0] + rgba[1] + rgba[2] == 0;
    shadow += dark && rgba[3] > 0.3f && rgba[3] < 1;
    solid += !dark && rgba[3] == 1;
  }
  EXPECT_GT(shadow, 100);
  EXPECT_GT(solid, 1000);
  EXPECT_EQ(picture.pixel(0, 0)[3], 0);
  options.floor = false;
  const Picture bare = renderSolid(geodesicSphere(20), *look, options).picture;
  for (std::size_t i = 0; i < bare.rgba.size() / 4; ++i) {
    EXPECT_EQ(bare.rgba[4 * i] == 0, bare.rgba[4 * i + 3] == 0);
  }
}

/// Light is linear in the albedo: nothing is lost or made between a grey solid and a white one.
TEST(SolidPicture, LightGoesByTheAlbedo) {
  const auto map = ballMap(1 + 1e-9);
  const auto white = appearanceOf(map, std::make_shared<Plain>(1.0f)),
             grey = appearanceOf(map, std::make_shared<Plain>(0.25f)),
             black = appearanceOf(map, std::make_shared<Plain>(0.0f));
  RenderOptions options = smallPicture();
  options.transparent = true;
  options.floor = false;
  const TriMesh mesh = geodesicSphere(20);
  const Picture bright = renderSolid(mesh, *white, options).picture,
                dim = renderSolid(mesh, *grey, options).picture,
                dark = renderSolid(mesh, *black, options).picture;
  for (std::size_t i = 0; i < bright.rgba.size(); ++i) {
    if (i % 4 == 3) continue;
    EXPECT_NEAR(dim.rgba[i], 0.25f * bright.rgba[i], 1e-6f);
    EXPECT_EQ(dark.rgba[i], 0);
    EXPECT_LT(bright.rgba[i], 1.45f);
  }
}

/// In the open, a matte white point gets the dome's mean over its hemisphere, by numbers: floor below, sky
/// above.
TEST(Studio, TheOpenDomeGivesItsMeanByTheCosine) {
  const std::vector<Vec3> corners{Vec3::Constant(-1), Vec3::Constant(1)};
  const detail::Camera camera(detail::cameraPose(RenderOptions()), corners);
  const detail::Studio studio(camera, {});
  constexpr int kCount = 4096;
  std::vector<float> x(kCount), y(kCount);
  detail::diskPoints({7, 0}, 2, kCount, x.data(), y.data());
  const auto mean = [&](const Vec3f& normal, bool seen) {
    Vec3f sum = Vec3f::Zero();
    for (int i = 0; i < kCount; ++i) {
      detail::LightSeen light;
      light.toKey = normal;
      light.toDome = detail::Studio::domeDirection(normal, {x[i], y[i]});
      EXPECT_NEAR(light.toDome.norm(), 1, 1e-5f);
      EXPECT_GE(light.toDome.dot(normal), -1e-6f);
      light.dome = seen;
      sum += studio.onSolid(normal, normal, light).diffuse;
    }
    return Vec3f(sum / kCount);
  };
  // Up: radiance 0.78 + 0.34 h, h the cosine: its mean by the cosine is 0.78 + 0.34 * 2/3. Times half.
  const float up = mean(Vec3f::UnitZ(), true)[1];
  const float dome = 0.5f * (0.78f + 0.34f * 2 / 3);
  EXPECT_GT(up, dome - 2e-3f);
  EXPECT_LT(up, dome + 0.1f) << "of the rim light, which stands behind the solid and a little above";
  // Down: nothing but the floor.
  EXPECT_NEAR(mean(-Vec3f::UnitZ(), true)[1], 0.5f * 0.62f, 1e-3f);
  // A closed room sends back less than the open dome.
  EXPECT_LT(mean(Vec3f::UnitZ(), false)[1], up);
}

TEST(Sampling, PointsAreStratified) {
  for (const std::uint32_t seed : {1u, 77u}) {
    constexpr int kCount = 64;
    float u[kCount], v[kCount];
    detail::squarePoints({seed, 64}, 3, kCount, u, v);
    // One point in each cell of every elementary grid: 64 x 1, 8 x 8, 1 x 64.
    for (const int across : {1, 2, 4, 8, 16, 32, 64}) {
      std::vector<int> cells(kCount);
      for (int i = 0; i < kCount; ++i)
        ++cells[static_cast<int>(u[i] * static_cast<float>(across)) * (kCount / across) +
                static_cast<int>(v[i] * static_cast<float>(kCount / across))];
      for (const int count : cells) EXPECT_EQ(count, 1) << across;
    }
    float x[kCount], y[kCount];
    detail::diskPoints({seed, 64}, 3, kCount, x, y);
    for (int i = 0; i < kCount; ++i) {
      EXPECT_NEAR(x[i] * x[i] + y[i] * y[i], u[i], 1e-6f);
      EXPECT_NEAR(x[i], std::sqrt(u[i]) * std::cos(2 * std::numbers::pi * (v[i] - 0.5)), 2e-6);
      EXPECT_NEAR(y[i], std::sqrt(u[i]) * std::sin(2 * std::numbers::pi * (v[i] - 0.5)), 2e-6);
    }
  }
}

TEST(Sampling, NeighbouringPixelsShareTheSquareEvenly) {
  // 4 samples in each of 4 x 4 pixels: 64 points, stratified together as those of one pixel are.
  std::vector<int> cells(64);
  for (int y = 4; y < 8; ++y) {
    for (int x = 8; x < 12; ++x) {
      float u[4], v[4];
      detail::squarePoints(detail::pixelSamples(x, y, 4), 1, 4, u, v);
      for (int i = 0; i < 4; ++i) ++cells[static_cast<int>(8 * u[i]) * 8 + static_cast<int>(8 * v[i])];
    }
  }
  for (const int count : cells) EXPECT_EQ(count, 1);
}

}  // namespace
}  // namespace polestar
