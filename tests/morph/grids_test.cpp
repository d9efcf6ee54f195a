// Frames as grids: coordinates agree with the maps, velocities with the frames around, voxels keep
// orientation.
#include "polestar/morph/morph_grids.h"

#include <gtest/gtest.h>

#include <cmath>

#include "polestar/pipeline.h"
#include "polestar/texture/procedural.h"
#include "shapes.h"

namespace polestar {
namespace {

using testing::coarse;
using testing::lobes;
using testing::waist;

constexpr double kVoxel = 0.06;

const MorphComplex& between() {
  static const MorphComplex complex({{lobes(), nullptr}, {waist(), nullptr}},
                                    {.surfaceTolerance = 0.25 * kVoxel});
  return complex;
}

MorphGridOptions options() { return {.grids = {.voxelSize = kVoxel}}; }

MorphFrame frameAt(double frame) {
  return MorphPath(between(), PathKind::straight)
      .frame(MorphTimeline::passage(2, 1, 25, Ease::linear), frame, 24);
}

/// Values of a grid at its own voxels inside.
struct Sampled {
  std::vector<Vec3> points;
  std::vector<Vec3f> values;
};
Sampled inside(const SolidGrids& grids, const std::string& name) {
  std::vector<Sampled> parts(grids.leafCount(name));
  grids.visitBricks(name, [&](std::size_t leaf, const SolidGrids::Brick& brick) {
    constexpr int n = SolidGrids::Brick::kSize;
    for (int i = 0; i + 1 < n; ++i) {
      for (int j = 0; j + 1 < n; ++j) {
        for (int k = 0; k + 1 < n; ++k) {
          const int at = (i * n + j) * n + k;
          if (!brick.active[at] || brick.signedDistance[at] >= 0) continue;
          parts[leaf].points.push_back(
              grids.indexToWorld(Vec3(brick.origin[0] + i, brick.origin[1] + j, brick.origin[2] + k)));
          parts[leaf].values.push_back(brick.values[at]);
        }
      }
    }
  });
  Sampled all;
  for (const Sampled& part : parts) {
    all.points.insert(all.points.end(), part.points.begin(), part.points.end());
    all.values.insert(all.values.end(), part.values.begin(), part.values.end());
  }
  return all;
}

TEST(MorphGrids, EndFramesHaveTheMapsOwnCoordinates) {
  for (const double at : {1.0, 25.0}) {
    const SolidGrids grids = morphGrids(between(), frameAt(at), {}, options());
    const BallMap& map = at == 1 ? lobes() : waist();
    const Sampled rest = inside(grids, "rest");
    ASSERT_GT(rest.points.size(), 10000U);
    std::vector<Vec3> ball(rest.points.size());
    map.forward(rest.points, ball);
    double sum = 0, worst = 0;
    std::size_t count = 0;
    for (std::size_t i = 0; i < ball.size(); ++i) {
      if (!ball[i].allFinite()) continue;  // between the surface and the common triangles
      const double off = (rest.values[i].cast<double>() - ball[i]).norm();
      sum += off;
      worst = std::max(worst, off);
      ++count;
    }
    RecordProperty(at == 1 ? "mean_first" : "mean_last", std::to_string(sum / count));
    EXPECT_GT(count, 0.98 * ball.size());
    EXPECT_LT(sum / count, 1e-3);
    EXPECT_LT(worst, kVoxel / 2);
  }
}

TEST(MorphGrids, EveryVoxelHasItsValuesAndCellsKeepOrientation) {
  for (const double at : {1.0, 7.0, 13.0, 25.0}) {
    SolidGrids grids = morphGrids(between(), frameAt(at), {}, options());
    const CellQuality cells = judgeVoxelCells(grids);
    EXPECT_EQ(cells.voxels, grids.insideVoxels());
    EXPECT_EQ(cells.inverted, 0U) << "frame " << at;
    EXPECT_EQ(inside(grids, "vel").points.size(), grids.insideVoxels());
  }
}

// Along a path the ball coordinates stay: rest(x + v dt, t + dt) = rest(x, t).
TEST(MorphGrids, VelocitiesCarryTheCoordinates) {
  constexpr double kStep = 0.25;  // frames
  const SolidGrids now = morphGrids(between(), frameAt(10), {}, options()),
                   later = morphGrids(between(), frameAt(10 + kStep), {}, options());
  const Sampled rest = inside(now, "rest"), velocity = inside(now, "vel");
  std::vector<Vec3> carried(rest.points.size());
  for (std::size_t i = 0; i < carried.size(); ++i)
    carried[i] = rest.points[i] + kStep / 24 * velocity.values[i].cast<double>();
  const SampledGrids lookUp = later.lookUp();
  std::vector<Vec3f> found(carried.size());
  std::vector<float> weights(carried.size());
  lookUp.find("rest", true)->sample(carried, {}, found, weights);
  double sum = 0;
  for (std::size_t i = 0; i < carried.size(); ++i) {
    ASSERT_GT(weights[i], 0.99F);
    sum += (found[i] - rest.values[i]).norm();
  }
  // Trilinear values of a map with kinks; without the velocity they are off by ten times as much.
  EXPECT_LT(sum / static_cast<double>(carried.size()), 1e-3);
}

TEST(MorphGrids, ColorsAreBlendedByTheWeights) {
  const std::shared_ptr<const SolidTexture> kiwi = makeTexture("kiwi"), orange = makeTexture("orange");
  const std::vector<MorphTexture> both{{kiwi, std::nullopt, {}}, {orange, std::nullopt, {}}},
      kiwiAlone{{kiwi, std::nullopt, {}}, {kiwi, std::nullopt, {}}},
      orangeAlone{{orange, std::nullopt, {}}, {orange, std::nullopt, {}}};
  const MorphFrame frame = frameAt(7);  // a quarter of the way
  const Sampled a = inside(morphGrids(between(), frame, kiwiAlone, options()), "Cd"),
                b = inside(morphGrids(between(), frame, orangeAlone, options()), "Cd"),
                blend = inside(morphGrids(between(), frame, both, options()), "Cd");
  for (std::size_t i = 0; i < blend.values.size(); ++i)
    ASSERT_LT((blend.values[i] - 0.75F * a.values[i] - 0.25F * b.values[i]).norm(), 1e-5F);
}

// Colors that lie in the first shape's own grids come back there as they are.
TEST(MorphGrids, GridsOfAShapeComeBackInItsOwnFrame) {
  SolidGrids colored(lobes().chart().green().shape().surface().mesh(), {.voxelSize = kVoxel});
  const auto colorAt = [](const Vec3& x) {
    return Vec3f(0.5F + 0.3F * static_cast<float>(x.x()), 0.5F, 0.5F - 0.3F * static_cast<float>(x.z()));
  };
  colored.addVector("Cd", ValueRole::invariant, [&](const VoxelBatch& batch, std::span<Vec3f> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = colorAt(batch.points[i]);
  });
  const SampledGrids file = colored.lookUp();
  const MorphTexture texture{nullptr, *file.find("Cd", true), between().nodesIn(lobes(), nullptr)};
  const std::vector<MorphTexture> textures{texture, texture};
  const Sampled first = inside(morphGrids(between(), frameAt(1), textures, options()), "Cd");
  for (std::size_t i = 0; i < first.values.size(); ++i)
    ASSERT_LT((first.values[i] - colorAt(first.points[i])).norm(), 0.02F);
}

}  // namespace
}  // namespace polestar
