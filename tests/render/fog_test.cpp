// Fogs whose transmittance has a formula.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/render/detail/fog_march.h"
#include "polestar/render/detail/staging.h"
#include "polestar/render/render_fog.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

constexpr double kVoxel = 0.05;
const Vec3 kCenter(2, -1, 0.5);

/// A file with the density around kCenter, and one color where it is not 0.
std::filesystem::path writeFog(const test::ScratchFolder& folder,
                               const std::function<double(const Vec3&)>& density,
                               const Vec3f& color = Vec3f::Zero()) {
  openvdb::initialize();
  auto fog = openvdb::FloatGrid::create();
  auto colors = openvdb::Vec3SGrid::create();
  fog->setName("density");
  fog->setGridClass(openvdb::GRID_FOG_VOLUME);
  colors->setName("Cd");
  const auto transform = openvdb::math::Transform::createLinearTransform(kVoxel);
  transform->postTranslate(openvdb::Vec3d(kCenter[0], kCenter[1], kCenter[2]));
  fog->setTransform(transform);
  colors->setTransform(transform);
  for (int i = -24; i <= 24; ++i) {
    for (int j = -24; j <= 24; ++j) {
      for (int k = -24; k <= 24; ++k) {
        const double value = density(kVoxel * Vec3(i, j, k));
        if (value <= 0) continue;
        fog->tree().setValueOn({i, j, k}, static_cast<float>(value));
        colors->tree().setValueOn({i, j, k}, {color[0], color[1], color[2]});
      }
    }
  }
  openvdb::GridPtrVec grids{fog};
  if (color != Vec3f::Zero()) grids.push_back(colors);
  openvdb::io::File file((folder / "fog.vdb").string());
  file.write(grids);
  file.close();
  return folder / "fog.vdb";
}

/// Radius 1, density 1, an edge of one voxel.
double uniformBall(const Vec3& x) { return std::clamp((1 - x.norm()) / kVoxel + 0.5, 0.0, 1.0); }

/// Radius 1, density 1 - r^2.
double softBall(const Vec3& x) { return 1 - x.squaredNorm(); }

/// At a distance `b` from the middle, averaged over jitters.
double transmittance(const FogVolume& fog, double extinction, double b) {
  const detail::FogMedium medium{fog, extinction, kVoxel, {}};
  detail::FogMarch march(medium);
  const Vec3 along = Vec3(0.3, 0.5, -0.8).normalized(), across = along.cross(Vec3::UnitX()).normalized();
  double sum = 0;
  for (int i = 0; i < 16; ++i) {
    sum += march.transmittance(kCenter + b * across - 5 * along, along, (i + 0.5) / 16, 1);
  }
  return sum / 16;
}

TEST(Fog, AUniformBallLetsThroughWhatBeerAndLambertSay) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, uniformBall));
  EXPECT_EQ(fog.densityName(), "density");
  EXPECT_EQ(fog.colorName(), "");
  EXPECT_NEAR(fog.voxelSize(), kVoxel, 1e-12);
  EXPECT_EQ(fog.largestDensity(), 1);
  for (const double extinction : {0.2, 1.0, 2.5}) {
    for (const double b : {0.0, 0.3, 0.6, 0.85}) {
      const double chord = 2 * std::sqrt(1 - b * b);
      EXPECT_NEAR(transmittance(fog, extinction, b), std::exp(-extinction * chord), 5e-3)
          << extinction << " " << b;
    }
    EXPECT_EQ(transmittance(fog, extinction, 1.1), 1);
  }
  EXPECT_EQ(transmittance(fog, 1000, 0), 0);
}

TEST(Fog, ASoftBallToo) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, softBall));
  for (const double b : {0.0, 0.4, 0.8}) {
    const double s = std::sqrt(1 - b * b);
    EXPECT_NEAR(transmittance(fog, 2, b), std::exp(-2 * 4.0 / 3 * s * s * s), 4e-3) << b;
  }
}

TEST(Fog, LightIsScatteredWhereItIsLost) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, uniformBall));
  const double extinction = 1.5;
  const detail::FogMedium medium{fog, extinction, kVoxel, {}};
  detail::FogMarch march(medium);
  const double through = march.follow(kCenter - 5 * Vec3::UnitX(), Vec3::UnitX(), 0.5);
  EXPECT_NEAR(through, std::exp(-2 * extinction), 3e-3);
  for (const double share : {0.05, 0.1, 0.5, 0.9, 0.999}) {
    // Up to a depth d within the ball, 1 - exp(-extinction d) of all light has been scattered.
    const double depth = -std::log(1 - share * (1 - through)) / extinction;
    EXPECT_NEAR(march.scatterDistance(share), 4 + depth, 0.03) << share;
  }
}

TEST(Fog, CutsTakeFogAway) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, uniformBall));
  const detail::FogMedium medium{fog, 1.0, kVoxel, {{{-Vec3::UnitX(), -kCenter[0]}}}};
  detail::FogMarch march(medium);
  EXPECT_NEAR(march.transmittance(kCenter - 5 * Vec3::UnitX(), Vec3::UnitX(), 0.5, 1), std::exp(-1.0), 0.02);
}

RenderOptions smallPicture() {
  RenderOptions options;
  options.width = 90;
  options.height = 90;
  options.samples = 16;
  options.cuts = {};
  return options;
}

TEST(Fog, PicturesHaveItsAlphaAndColor) {
  const test::ScratchFolder folder;
  const Vec3f color(0.8f, 0.4f, 0.1f);
  const FogVolume fog(writeFog(folder, uniformBall, color));
  EXPECT_EQ(fog.colorName(), "Cd");
  RenderOptions options = smallPicture();
  options.shading = Shading::flat;
  options.transparent = true;
  FogOptions look;
  look.meanFreePath = 0.4;
  look.albedo = Vec3f::Ones();
  const Picture picture = FogRenderer(fog, look, options).render().picture;
  // The frame's unit is half the diagonal of the voxels' box.
  const Box box = boundingBox({fog.outline(), {}});
  const double extinction = 1 / (0.4 * 0.5 * box.diagonal());
  // The middle of the picture looks at the middle of the ball.
  const float* middle = picture.pixel(45, 45);
  EXPECT_NEAR(middle[3], 1 - std::exp(-2 * extinction), 0.01);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(middle[c], color[c] * middle[3], 1e-4);
  EXPECT_EQ(picture.pixel(0, 0)[3], 0);
}

TEST(Fog, LightAndShadowAreThere) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, uniformBall));
  RenderOptions options = smallPicture();
  const Picture picture = FogRenderer(fog, {}, options).render().picture;
  const auto brightness = [&](int x, int y) {
    float sum = 0;
    for (int dy = -3; dy <= 3; ++dy)
      for (int dx = -3; dx <= 3; ++dx) sum += picture.pixel(x + dx, y + dy)[1];
    return sum / 49;
  };
  // The key light stands at the left: as with solids nothing is cut.
  EXPECT_GT(brightness(33, 30), 1.3f * brightness(60, 58));
  float darkest = 1;
  for (int x = 60; x < 86; ++x) darkest = std::min(darkest, brightness(x, 78));
  EXPECT_LT(darkest, 0.8f * brightness(5, 78));
  for (const float value : picture.rgba) {
    EXPECT_TRUE(std::isfinite(value));
    EXPECT_GE(value, 0);
    EXPECT_LT(value, 1.6f);
  }
}

TEST(Fog, TheSameBytesForAnyNumberOfThreadsAndCrop) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, softBall, {0.5f, 0.5f, 0.5f}));
  RenderOptions options = smallPicture();
  options.samples = 3;
  const FogRenderer renderer(fog, {}, options);
  Picture one, three;
  withThreads(1, [&] { one = renderer.render().picture; });
  withThreads(3, [&] { three = renderer.render().picture; });
  EXPECT_EQ(one.rgba, three.rgba);
  options.crop = PixelBox{31, 40, 70, 66};
  const Picture crop = FogRenderer(fog, {}, options).render().picture;
  for (int y = 0; y < crop.height; ++y) {
    for (int x = 0; x < crop.width; ++x) {
      for (int c = 0; c < 4; ++c) ASSERT_EQ(crop.pixel(x, y)[c], one.pixel(x + 31, y + 40)[c]);
    }
  }
}

std::string messageOf(const std::filesystem::path& path) {
  try {
    FogVolume fog(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    return error.what();
  }
  return "";
}

TEST(Fog, RefusesWhatIsNone) {
  const test::ScratchFolder folder;
  EXPECT_THAT(messageOf(folder / "missing.vdb"), HasSubstr("missing.vdb"));
  EXPECT_THAT(messageOf(writeFog(folder, [](const Vec3&) { return 0; })), HasSubstr("empty"));
  auto bad = openvdb::FloatGrid::create();
  bad->setName("density");
  bad->tree().setValueOn({1, 2, 3}, -1);
  openvdb::io::File((folder / "bad.vdb").string()).write(openvdb::GridPtrVec{bad});
  EXPECT_THAT(messageOf(folder / "bad.vdb"), HasSubstr("-1"));
  auto level = openvdb::FloatGrid::create();
  level->setName("surface");
  level->setGridClass(openvdb::GRID_LEVEL_SET);
  openvdb::io::File((folder / "level.vdb").string()).write(openvdb::GridPtrVec{level});
  EXPECT_THAT(messageOf(folder / "level.vdb"), HasSubstr("no fog"));
}

TEST(Fog, RefusesImpossibleOptions) {
  const test::ScratchFolder folder;
  const FogVolume fog(writeFog(folder, softBall));
  RenderOptions options = smallPicture();
  options.cuts = {{Vec3::UnitX(), 0}};
  options.cutMode = CutMode::explode;
  EXPECT_THROW(FogRenderer(fog, {}, options), Error);
  options = smallPicture();
  options.aovs = true;
  EXPECT_THROW(FogRenderer(fog, {}, options), Error);
  FogOptions look;
  look.meanFreePath = 0;
  EXPECT_THROW(FogRenderer(fog, look, smallPicture()), Error);
}

}  // namespace
}  // namespace polestar
