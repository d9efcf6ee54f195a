// Textures carried into solids, held against the composition of the maps themselves.
#include "polestar/texture/transfer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <random>

#include "polestar/core/error.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/composed_map.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/meshes.h"
#include "support/scratch_folder.h"
#include "support/solids.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;

/// Smooth, different along every axis, known everywhere; unfiltered, as the tests want points.
class Waves final : public SolidTexture {
 public:
  static Vec3f at(const Vec3& ball) {
    return (Vec3(0.5, 0.5, 0.5) + 0.4 * Vec3(std::sin(4 * ball.x() + ball.z()), std::cos(3 * ball.y()),
                                             std::sin(5 * ball.z() - 2 * ball.y())))
        .cast<float>();
  }
  void sample(std::span<const TexturePoint> points, std::span<TextureSample> samples) const override {
    for (std::size_t i = 0; i < points.size(); ++i) samples[i].color = at(points[i].ball);
  }
  bool hasFiber() const override { return true; }
  void fiber(std::span<const Vec3> ball, std::span<Vec3> direction) const override {
    for (std::size_t i = 0; i < ball.size(); ++i) direction[i] = grain(ball[i]);
  }
  static Vec3 grain(const Vec3& ball) { return {1, ball.x(), -0.5 * ball.z()}; }
};

const BallMap& starMap() {
  static const BallMap map = testing::ballMap(testing::starShape(smoothStar(4)));
  return map;
}

const BallMap& lobesMap() {
  static const BallMap map = [] {
    const TriMesh mesh = transformed(smoothStar(4), [](const Vec3& v) -> Vec3 {
      return Vec3(7, -3, 2) + Vec3(1.4 * v.y(), 0.8 * v.z() + 0.1 * v.x(), 1.1 * v.x());
    });
    return testing::ballMap(testing::starShape(mesh));
  }();
  return map;
}

const TriMesh& surfaceOf(const BallMap& map) { return map.chart().green().shape().surface().mesh(); }

TransferOptions optionsFor(const BallMap& target, int dim) {
  TransferOptions options;
  options.grids.voxelSize = voxelSizeFor(surfaceOf(target), dim);
  return options;
}

SampledGrids written(const Transfer& transfer, const test::ScratchFolder& folder, const std::string& name) {
  transfer.grids.write(folder / name);
  return SampledGrids(folder / name);
}

struct Errors {
  double mean = 0, worst = 0;
  std::size_t points = 0;
};

/// Of a color grid against a function of the world, NaN outside.
template <class Truth>
Errors errorsAt(const std::vector<Vec3>& points, const SampledGrid& grid, Truth&& truth) {
  std::vector<Vec3f> values(points.size());
  std::vector<float> weights(points.size());
  grid.sample(points, {}, values, weights);
  Errors errors;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3f expected = truth(points[i]);
    if (!expected.allFinite()) continue;
    const double error = (values[i] - expected).norm();
    errors.mean += error;
    errors.worst = std::max(errors.worst, error);
    ++errors.points;
  }
  errors.mean /= static_cast<double>(errors.points);
  return errors;
}

/// Between voxels.
template <class Truth>
Errors errorsOf(const SampledGrid& grid, const BallMap& map, Truth&& truth) {
  return errorsAt(testing::pointsInside(map.chart().green().shape(), 20000), grid, truth);
}

/// Of a grid over the solid's box.
std::vector<Vec3> voxelCenters(const BallMap& map, double voxel) {
  const Box box = boundingBox(surfaceOf(map));
  const Vec3 count = box.extent() / voxel;
  std::vector<Vec3> centers;
  for (int i = 0; i < count.x(); ++i) {
    for (int j = 0; j < count.y(); ++j) {
      for (int k = 0; k < count.z(); ++k)
        centers.emplace_back(box.min + voxel * (Vec3(i, j, k) + Vec3::Constant(0.5)));
    }
  }
  return centers;
}

Vec3f wavesThrough(const VolumeMap& map, const Vec3& x) {
  Vec3 ball;
  map.forward({&x, 1}, {&ball, 1});
  return ball.allFinite() ? Waves::at(ball) : Vec3f(Vec3f::Constant(std::nanf("")));
}

// Voxel centers show the texture where the map says, but for the tenth of a voxel that interpolation may
// take.
TEST(TransferTexture, IsTheTextureOfTheMap) {
  const test::ScratchFolder folder;
  const TransferOptions options = optionsFor(starMap(), 48);
  const Transfer transfer = transferTexture(TextureRoute(starMap()), Waves(), options);
  EXPECT_GT(transfer.report.interpolated, 0U);
  EXPECT_LT(transfer.report.interpolated, transfer.report.blocks);
  EXPECT_EQ(transfer.report.unanswered, 0U);
  const SampledGrids file = written(transfer, folder, "waves.vdb");
  const SampledGrid* color = file.find("Cd", true);
  ASSERT_NE(color, nullptr);

  const Errors errors = errorsAt(voxelCenters(starMap(), options.grids.voxelSize), *color,
                                 [](const Vec3& x) { return wavesThrough(starMap(), x); });
  ASSERT_GT(errors.points, 10000U);
  // In voxels, by the steepest slope of the color: a two-hundredth on average; between the places where
  // interpolation is checked, a kink of the map may leave a quarter.
  const double slope = 0.4 * std::sqrt(4 * 4 + 1 + 3 * 3 + 5 * 5 + 2 * 2), voxelOfBall = 1.0 / 24;
  EXPECT_LT(errors.mean, slope * voxelOfBall / 200);
  EXPECT_LT(errors.worst, slope * voxelOfBall / 4);
}

TEST(TransferTexture, WritesFibersAlongTheCarriedGrain) {
  const test::ScratchFolder folder;
  const Transfer transfer = transferTexture(TextureRoute(starMap()), Waves(), optionsFor(starMap(), 48));
  const SampledGrids file = written(transfer, folder, "waves.vdb");
  const SampledGrid* fiber = file.find("fiber", true);
  ASSERT_NE(fiber, nullptr);
  EXPECT_EQ(fiber->role(), ValueRole::contravariant);
  const std::vector<Vec3> centers = voxelCenters(starMap(), optionsFor(starMap(), 48).grids.voxelSize);
  const Errors errors = errorsAt(centers, *fiber, [](const Vec3& x) -> Vec3f {
    Vec3 ball;
    Mat3 jacobian;
    starMap().forward({&x, 1}, {&ball, 1});
    starMap().jacobian({&x, 1}, {&jacobian, 1});
    return (jacobian.inverse() * Waves::grain(ball)).normalized().cast<float>();
  });
  EXPECT_LT(errors.mean, 0.01);
}

/// What `map` writes of the star, read again.
class TransferIntoMappedGrids : public ::testing::Test {
 protected:
  static constexpr int kDim = 48;
  static void SetUpTestSuite() { gridsOf(starMap(), optionsFor(starMap(), kDim).grids).write(path()); }
  static void TearDownTestSuite() { std::filesystem::remove(path()); }
  static std::filesystem::path path() {
    return std::filesystem::path(::testing::TempDir()) / ("star " + std::to_string(::getpid()) + ".vdb");
  }
  static TransferOptions options(std::shared_ptr<const SolidGrids> mapped) {
    TransferOptions options;
    options.mapped = std::move(mapped);
    return options;
  }
  static std::shared_ptr<SolidGrids> mapped() {
    return std::make_shared<SolidGrids>(*SolidGrids::read(path()));
  }
  static std::vector<Vec3> centers() {
    return voxelCenters(starMap(), optionsFor(starMap(), kDim).grids.voxelSize);
  }
  const test::ScratchFolder folder_;
};

// Every voxel has its own place, so the color is the texture's to what floats hold; new grids interpolate
// places, which costs up to a tenth of a voxel.
TEST_F(TransferIntoMappedGrids, ColorsAreThoseOfTheirOwnCoordinates) {
  const auto motion =
      std::make_shared<const BallMotion>(rotationXyz(Vec3(20, -35, 60)), Vec3(0.1, 0.2, -0.1));
  const TextureRoute route(starMap(), motion);
  const Transfer transfer = transferTexture(route, Waves(), options(mapped()));
  const Transfer anew = transferTexture(route, Waves(), optionsFor(starMap(), kDim));
  EXPECT_EQ(transfer.report.unanswered, 0U);
  EXPECT_EQ(transfer.report.blocks, 0U);
  EXPECT_EQ(transfer.report.voxels, anew.report.voxels);
  const auto truth = [&](const Vec3& x) -> Vec3f {
    Vec3 ball;
    starMap().forward({&x, 1}, {&ball, 1});
    if (!ball.allFinite()) return Vec3f::Constant(std::nanf(""));
    motion->forward({&ball, 1}, {&ball, 1});
    return Waves::at(ball);
  };
  const SampledGrids file = written(transfer, folder_, "mapped.vdb");
  const Errors read = errorsAt(centers(), *file.find("Cd", true), truth),
               interpolated =
                   errorsAt(centers(), *written(anew, folder_, "anew.vdb").find("Cd", true), truth);
  ASSERT_GT(read.points, 10000U);
  EXPECT_LT(read.worst, 1e-5);
  EXPECT_GT(interpolated.worst, 1e-3) << "nothing is interpolated: the bound above says nothing";
  ASSERT_EQ(file.grids().size(), 4U) << "surface, density, Cd and fiber, but no rest that nobody asked for";
}

// On the skin, too, where neighbours outside do not count; outside, where the padding continues the grain.
TEST_F(TransferIntoMappedGrids, FibersFollowTheCarriedGrain) {
  const TextureRoute route(starMap());
  const Transfer transfer = transferTexture(route, Waves(), options(mapped()));
  const SampledGrids file = written(transfer, folder_, "mapped.vdb");
  const SampledGrid* fiber = file.find("fiber", true);
  ASSERT_NE(fiber, nullptr);
  const Errors inside = errorsAt(centers(), *fiber, [](const Vec3& x) -> Vec3f {
    Vec3 ball;
    Mat3 jacobian;
    starMap().forward({&x, 1}, {&ball, 1});
    starMap().jacobian({&x, 1}, {&jacobian, 1});
    return (jacobian.inverse() * Waves::grain(ball)).normalized().cast<float>();
  });
  EXPECT_GT(inside.points, 10000U);
  EXPECT_LT(inside.mean, 0.01);
  // Just outside, against the map's derivative on the surface.
  const TriMesh& surface = surfaceOf(starMap());
  const Vec3 center = starMap().chart().green().shape().frame().origin;
  const double voxel = optionsFor(starMap(), kDim).grids.voxelSize;
  std::vector<Vec3> outside;
  for (std::size_t v = 0; v < surface.vertices.size(); v += 5)
    outside.push_back(surface.vertices[v] + voxel * (surface.vertices[v] - center).normalized());
  const Errors beyond = errorsAt(outside, *fiber, [&](const Vec3& x) -> Vec3f {
    Vec3 ball;
    Mat3 jacobian;
    route.map({&x, 1}, {&ball, 1});
    route.jacobian({&x, 1}, {&jacobian, 1});
    return (jacobian.inverse() * Waves::grain(ball)).normalized().cast<float>();
  });
  EXPECT_EQ(beyond.points, outside.size());
  EXPECT_LT(beyond.mean, 0.1);
}

// As where `map` has filtered voxels: what the certificate is about is `rest`, not the table.
TEST_F(TransferIntoMappedGrids, RestIsBelievedWhereItWasMoved) {
  const auto grids = mapped();
  SolidGrids::Cube cube = grids->readCube("rest", {kDim / 2, kDim / 2, kDim / 2}, 2);
  ASSERT_EQ(cube.active.back(), 1);
  const Vec3f moved = cube.values.back() + Vec3f(0.02f, -0.01f, 0.03f);
  cube.values.back() = moved;
  const std::vector<std::size_t> last{cube.values.size() - 1};
  grids->replace("rest", cube, last);
  TransferOptions withRest = options(grids);
  withRest.rest = true;
  const SampledGrids file =
      written(transferTexture(TextureRoute(starMap()), Waves(), withRest), folder_, "moved.vdb");
  const std::vector<Vec3> at{grids->indexToWorld(Vec3::Constant(kDim / 2 + 1))};
  for (const auto& [name, expected] :
       {std::pair{"Cd", Waves::at(moved.cast<double>())}, std::pair{"rest", moved}}) {
    const Errors errors = errorsAt(at, *file.find(name, true), [&](const Vec3&) { return expected; });
    EXPECT_LT(errors.worst, 1e-6) << name;
  }
}

// With a body of its own the texture is asked for through that body's map, from the same places.
TEST_F(TransferIntoMappedGrids, GridsOfABodyComeAsIntoNewOnes) {
  const SampledGrids source = written(
      transferTexture(TextureRoute(lobesMap()), Waves(), optionsFor(lobesMap(), 32)), folder_, "source.vdb");
  const TextureRoute route(starMap(), {}, lobesMap());
  const std::vector<CarriedGrid> carried = chooseGrids(source, {"Cd"});
  const Transfer transfer = transferGrids(route, carried, options(mapped()));
  EXPECT_EQ(transfer.report.unanswered, 0U);
  EXPECT_GT(transfer.report.interpolated, 0U);
  const SampledGrids file = written(transfer, folder_, "mapped.vdb"),
                     anew = written(transferGrids(route, carried, optionsFor(starMap(), kDim)), folder_,
                                    "anew.vdb");
  const Errors errors = errorsAt(centers(), *file.find("Cd", true), [&](const Vec3& x) {
    Vec3f value;
    float weight = 0;
    anew.find("Cd", true)->sample({&x, 1}, {}, {&value, 1}, {&weight, 1});
    return weight > 0 ? value : Vec3f(Vec3f::Constant(std::nanf("")));
  });
  EXPECT_GT(errors.points, 10000U);
  EXPECT_LT(errors.mean, 1e-4);
}

// The composition of analytic texture, motion and both maps, against what went through a grid of the source:
// the error of the transfer is that of reading the source between its voxels.
TEST(TransferGrids, AgreeWithTheCompositionOfTheMaps) {
  const test::ScratchFolder folder;
  const SampledGrids source = written(
      transferTexture(TextureRoute(lobesMap()), Waves(), optionsFor(lobesMap(), 48)), folder, "source.vdb");
  const auto motion =
      std::make_shared<const BallMotion>(rotationXyz(Vec3(20, -35, 60)), Vec3(0.1, 0.2, -0.1));
  // Finer than the source, so that nothing is filtered away.
  const TransferOptions options = optionsFor(starMap(), 96);
  const Transfer transfer =
      transferGrids(TextureRoute(starMap(), motion, lobesMap()), chooseGrids(source, {"Cd"}), options);
  EXPECT_EQ(transfer.report.unanswered, 0U);
  const SampledGrids result = written(transfer, folder, "result.vdb");

  // At the places where the voxels look, by maps and texture alone.
  const auto route = [&](const Vec3& x) {
    Vec3 place;
    starMap().forward({&x, 1}, {&place, 1});
    motion->forward({&place, 1}, {&place, 1});
    lobesMap().inverse({&place, 1}, {&place, 1});
    return place;
  };
  const std::vector<Vec3> centers = voxelCenters(starMap(), options.grids.voxelSize);
  std::vector<Vec3> places;
  for (const Vec3& center : centers) places.push_back(route(center));
  const Errors ofSource =
      errorsAt(places, *source.find("Cd", true), [](const Vec3& y) { return wavesThrough(lobesMap(), y); });
  const Errors ofResult = errorsAt(centers, *result.find("Cd", true),
                                   [&](const Vec3& x) { return wavesThrough(lobesMap(), route(x)); });
  EXPECT_GT(ofSource.mean, 1e-4);
  EXPECT_LT(ofResult.mean, 1.1 * ofSource.mean) << "source " << ofSource.mean;
}

// The texture turns as --rotate says: what is seen along +x in the ball is seen along +y after a quarter turn
// about z.
TEST(TransferGrids, TurnWithTheMotionsInverse) {
  const BallMap ball = testing::ballMap(testing::starShape(icosphere(4)));
  const Mat3 quarter = rotationXyz(Vec3(0, 0, 90));
  const TextureRoute route(ball, std::make_shared<const BallMotion>(quarter.transpose()));
  const Vec3 x(0, 0.5, 0);
  Vec3 place;
  route.map({&x, 1}, {&place, 1});
  EXPECT_LT((place - Vec3(0.5, 0, 0)).norm(), 1e-3);
}

// A scalar, its gradient (covariant) and a flow (contravariant): what they say together does not depend on
// the solid in which it is said.
TEST(TransferGrids, CarryVectorsByTheirKind) {
  const test::ScratchFolder folder;
  const auto scalar = [](const Vec3& y) {
    return std::sin(2 * (y.x() - 7)) + 0.7 * (y.y() + 3) * (y.z() - 2);
  };
  const auto gradient = [](const Vec3& y) {
    return Vec3(2 * std::cos(2 * (y.x() - 7)), 0.7 * (y.z() - 2), 0.7 * (y.y() + 3));
  };
  const auto flow = [](const Vec3& y) { return Vec3(y.y() + 3, 1, 0.3 * (y.x() - 7)); };
  SolidGrids grids(surfaceOf(lobesMap()), optionsFor(lobesMap(), 64).grids);
  const std::array<Attribute, 4> attributes{
      {{.name = "heat"},
       {.name = "slope", .vector = true, .role = ValueRole::covariant},
       {.name = "flow", .vector = true, .role = ValueRole::contravariant},
       {.name = "P", .vector = true, .role = ValueRole::position}}};
  grids.add(attributes, [&](const VoxelBatch& batch, AttributeValues& values) {
    for (std::size_t i = 0; i < batch.points.size(); ++i) {
      values.scalars(0)[i] = static_cast<float>(scalar(batch.points[i]));
      values.vectors(1)[i] = gradient(batch.points[i]).cast<float>();
      values.vectors(2)[i] = flow(batch.points[i]).cast<float>();
      values.vectors(3)[i] = batch.points[i].cast<float>();
    }
  });
  grids.write(folder / "source.vdb");
  const SampledGrids source(folder / "source.vdb");
  const TextureRoute route(starMap(), {}, lobesMap());
  const Transfer transfer = transferGrids(route, chooseGrids(source), optionsFor(starMap(), 64));
  ASSERT_EQ(transfer.report.grids.size(), 4U);
  const SampledGrids file = written(transfer, folder, "result.vdb");

  std::vector<Vec3> points = testing::pointsInside(starMap().chart().green().shape(), 8000);
  std::erase_if(points, [](const Vec3& x) { return x.norm() > 0.5; });
  std::vector<Vec3> places(points.size());
  route.map(points, places);
  std::vector<Vec3f> heat(points.size()), slope(points.size()), carriedFlow(points.size()),
      position(points.size());
  std::vector<float> weights(points.size());
  file.find("heat", false)->sample(points, {}, heat, weights);
  file.find("slope", true)->sample(points, {}, slope, weights);
  file.find("flow", true)->sample(points, {}, carriedFlow, weights);
  file.find("P", true)->sample(points, {}, position, weights);
  ASSERT_GT(points.size(), 500U);
  double heatError = 0, pairing = 0, positionError = 0, slopeError = 0, slopeLength = 0;
  constexpr double step = 0.02;
  for (std::size_t i = 0; i < points.size(); ++i) {
    heatError += std::abs(heat[i].x() - scalar(places[i]));
    pairing += std::abs(slope[i].dot(carriedFlow[i]) - gradient(places[i]).dot(flow(places[i])));
    positionError += (position[i].cast<double>() - points[i]).norm();
    Vec3 differences;
    for (int k = 0; k < 3; ++k) {
      const std::array<Vec3, 2> around{points[i] + step * Vec3::Unit(k), points[i] - step * Vec3::Unit(k)};
      std::array<Vec3, 2> images;
      route.map(around, images);
      differences[k] = (scalar(images[0]) - scalar(images[1])) / (2 * step);
    }
    slopeError += (slope[i].cast<double>() - differences).norm();
    slopeLength += differences.norm();
  }
  const auto count = static_cast<double>(points.size());
  // Read between voxels twice, of 0.04 each: h^2 / 8 times a second derivative of about 4.
  EXPECT_LT(heatError / count, 4e-3);
  EXPECT_LT(positionError / count, 2e-3);
  EXPECT_LT(slopeError, 0.05 * slopeLength);
  EXPECT_LT(pairing / count, 0.03);
}

// There and back between two solids returns what was there, but for two readings between voxels.
void expectReturns(const BallMap& a, const BallMap& b, int dim) {
  const test::ScratchFolder folder;
  const SampledGrids first =
      written(transferTexture(TextureRoute(a), Waves(), optionsFor(a, dim)), folder, "first.vdb");
  const SampledGrids there =
      written(transferGrids(TextureRoute(b, {}, a), chooseGrids(first, {"Cd"}), optionsFor(b, dim)), folder,
              "there.vdb");
  const SampledGrids back =
      written(transferGrids(TextureRoute(a, {}, b), chooseGrids(there, {"Cd"}), optionsFor(a, dim)), folder,
              "back.vdb");
  const Errors once = errorsOf(*first.find("Cd", true), a, [&](const Vec3& x) { return wavesThrough(a, x); });
  const Errors twice =
      errorsOf(*there.find("Cd", true), b, [&](const Vec3& x) { return wavesThrough(b, x); });
  const Errors returned =
      errorsOf(*back.find("Cd", true), a, [&](const Vec3& x) { return wavesThrough(a, x); });
  EXPECT_GT(once.mean, 0);
  // Each step reads between voxels once more; coarser footprints on the way average a little.
  EXPECT_LT(returned.mean, 2 * (once.mean + twice.mean)) << once.mean << " " << twice.mean;
  EXPECT_LT(returned.mean, 0.02);
}

TEST(TransferGrids, ReturnFromThereAndBack) { expectReturns(lobesMap(), starMap(), 48); }

TEST(TransferGrids, ReturnBetweenRealModels) {
  POLESTAR_REQUIRE_MESHES();
  const auto map = [](const std::string& name) {
    return testing::ballMap(testing::starShapeFromFile(*testing::meshFolder() / name));
  };
  expectReturns(map("castalia.obj"), map("psyche.obj"), 64);
}

TEST(ChooseGrids, TakesColorsAndLeavesTheSolidsOwn) {
  const test::ScratchFolder folder;
  SolidGrids grids(icosphere(3), {.voxelSize = 0.1});
  const auto one = [](const VoxelBatch&, std::span<float> values) {
    std::fill(values.begin(), values.end(), 1);
  };
  for (const char* name : {"B", "G", "R", "heat"}) grids.addScalar(name, one);
  grids.write(folder / "three.vdb");
  const SampledGrids file(folder / "three.vdb");
  const std::vector<CarriedGrid> chosen = chooseGrids(file);
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_TRUE(chosen[0].color);
  ASSERT_EQ(chosen[0].sources.size(), 3U);
  EXPECT_EQ(chosen[0].sources[0].name(), "R");
  EXPECT_EQ(chosen[0].sources[2].name(), "B");
  EXPECT_EQ(chosen[1].name, "heat");
  EXPECT_EQ(chooseGrids(file, {"density"})[0].name, "density");
  try {
    chooseGrids(file, {"nothing"});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("nothing"), HasSubstr("heat"), HasSubstr("surface")));
  }
}

TEST(ChooseGrids, RefusesWhatIsNoNumberAndSaysWhere) {
  const test::ScratchFolder folder;
  SolidGrids grids(icosphere(3), {.voxelSize = 0.1});
  grids.addVector("Cd", ValueRole::invariant, [](const VoxelBatch& batch, std::span<Vec3f> values) {
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = Vec3f::Constant(batch.points[i].norm() < 0.1 ? std::nanf("") : 1.0f);
  });
  grids.write(folder / "nan.vdb");
  try {
    chooseGrids(SampledGrids(folder / "nan.vdb"));
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), AllOf(HasSubstr("Cd"), HasSubstr("no numbers")));
  }
}

TEST(TransferGrids, RefuseGridsOfAnotherBody) {
  const test::ScratchFolder folder;
  SolidGrids grids(transformed(icosphere(3), [](const Vec3& v) -> Vec3 { return v + Vec3(50, 0, 0); }),
                   {.voxelSize = 0.1});
  grids.addVector("Cd", ValueRole::invariant, [](const VoxelBatch&, std::span<Vec3f>) {});
  grids.write(folder / "far.vdb");
  const SampledGrids far(folder / "far.vdb");
  EXPECT_THROW(
      transferGrids(TextureRoute(starMap(), {}, lobesMap()), chooseGrids(far), optionsFor(starMap(), 24)),
      Error);
  EXPECT_THROW(transferGrids(TextureRoute(starMap()), chooseGrids(far), optionsFor(starMap(), 24)), Error);
}

}  // namespace
}  // namespace polestar
