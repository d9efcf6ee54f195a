// Green's functions that are none: samples refute them, whatever their records say.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "certify/maps.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/exact_green.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::checkOf;
using ::testing::ElementsAre;
using testing::failuresOf;
using ::testing::IsEmpty;
using testing::mapOf;
using testing::partsOf;
using testing::star;

std::vector<std::string> failures(const BallMap& map) { return failuresOf(certify(map, {}, {}, 1)); }

// The star's table with this field.
BallMap withGreen(GreenFunction green) {
  GreenChart::Data data = partsOf(star().chart());
  data.green = std::move(green);
  return mapOf(std::move(data), star().sphere());
}

BallMap withDensity(const std::function<double(std::size_t, double)>& spoil) {
  const GreenFunction& good = star().chart().green();
  SurfaceLayer layer = std::get<SurfaceLayer>(good.sources());
  for (std::size_t i = 0; i < layer.density.size(); ++i) layer.density[i] = spoil(i, layer.density[i]);
  return withGreen(restoreGreen(good.shape(), std::move(layer), good.record()));
}

TEST(WrongField, ADensityWithNoise) {
  EXPECT_THAT(failures(withDensity([](std::size_t, double density) { return density; })), IsEmpty());
  std::mt19937_64 engine(1);
  std::uniform_real_distribution<> uniform(-0.5, 0.5);
  std::vector<double> noise(star().chart().green().density().size());
  for (double& x : noise) x = uniform(engine);
  const auto found =
      failures(withDensity([&](std::size_t i, double density) { return density * (1 + noise[i]); }));
  EXPECT_EQ(found.front(), "boundary_error");
}

TEST(WrongField, ATotalChargeThatIsNotOne) {
  EXPECT_THAT(failures(withDensity([](std::size_t, double density) { return 1.002 * density; })),
              ElementsAre("charge"));
}

TEST(WrongField, AToleranceThatIsNone) {
  MapOptions options;
  options.largestAngle = 0;
  options.green.tolerance = 0.5;
  const BallMap map = mapToBall(testing::starShape(cube(2), Vec3(0.3, 0.2, 0.1)), options);
  const Certificate certificate = certify(map, {}, {}, 1);
  EXPECT_GT(checkOf(certificate, "boundary_error").value, 1e-2);
  EXPECT_EQ(testing::failureOf(certificate), "boundary_error");
}

TEST(WrongField, TooFewCharges) {
  GreenOptions options;
  options.solver = GreenSolver::mfs;
  options.mfs.sourcesPerVertex = 0.02;
  const auto found = failures(withGreen(solveGreen(star().chart().green().shape(), options)));
  EXPECT_EQ(found.front(), "boundary_error");
}

// The ball's Green's function with its pole at `pole`, told as one with its pole at the center: charges at
// both take the one for the other.
GreenFunction poleElsewhere(const StarShape& ball, const Vec3& pole) {
  GreenRecord record;
  record.harmonicRadius = testing::BallGreen{pole}.harmonicRadius();
  PointSources sources;
  sources.positions = {pole / pole.squaredNorm(), pole, Vec3(1e-9, 0, 0)};
  sources.charges = {-1 / pole.norm(), 1, -1};
  return restoreGreen(ball, std::move(sources), std::move(record));
}

TEST(WrongField, APoleThatIsNotTheCenter) {
  const BallMap ball = testing::ballMap(testing::starShape(icosphere(4), Vec3(0, 0, 0)));
  EXPECT_THAT(failures(ball), IsEmpty());
  for (const Vec3& pole : {Vec3(0.3, 0, 0), Vec3(0.05, -0.02, 0.03), Vec3(0, 0.02, 0)}) {
    GreenChart::Data data = partsOf(ball.chart());
    data.green = poleElsewhere(ball.chart().green().shape(), pole);
    const Certificate certificate = certify(mapOf(std::move(data), ball.sphere()), {}, {}, 1);
    EXPECT_LT(checkOf(certificate, "boundary_error").value, 1e-2) << "G is 0 on the surface, as it should be";
    EXPECT_THAT(failuresOf(certificate), ElementsAre("field_signs"));
  }
}

}  // namespace
}  // namespace polestar
