#include "polestar/certify/certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "certify/maps.h"
#include "polestar/pipeline.h"

namespace polestar {
namespace {

using testing::checkOf;
using ::testing::ElementsAre;
using testing::failureOf;
using testing::mapOf;
using testing::partsOf;
using testing::star;

TEST(Certificate, AGoodMapIsProved) {
  const Certificate certificate = certifyGrids(
      star(),
      gridsOf(star(), {.voxelSize = voxelSizeFor(star().chart().green().shape().surface().mesh(), 48)}));
  for (const Check& check : certificate.checks)
    EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
  EXPECT_EQ(certificate.verdict, Verdict::proved);
  EXPECT_EQ(certificate.firstFailure(), nullptr);
  EXPECT_GT(certificate.sampled.cells, 10000u);
  EXPECT_GT(certificate.sampled.minJacobian, 0);
}

TEST(Certificate, ChecksHaveTheRolesThatMakeTheVerdict) {
  const Certificate certificate = certify(star(), {}, {}, 1);
  std::map<CheckRole, std::vector<std::string>> names;
  for (const Check& check : certificate.checks) names[check.role].push_back(check.name);
  EXPECT_THAT(names[CheckRole::proof],
              ElementsAre("finite", "boundary_attached", "center", "surface_star", "sphere_flips",
                          "sphere_degree", "image_radii", "foliation_cells", "image_cells", "voxel_cells"));
  EXPECT_THAT(names[CheckRole::falsifier],
              ElementsAre("boundary_error", "charge", "field_signs", "round_trip"));
  EXPECT_THAT(names[CheckRole::warning], ElementsAre("surface_signs"));
}

// The star with this said of its signs.
BallMap withSigns(std::vector<SignProof> signs) {
  GreenChart::Data data = partsOf(star().chart());
  GreenRecord record = data.green.record();
  record.signs = std::move(signs);
  data.green = restoreGreen(data.green.shape(), data.green.sources(), record);
  return mapOf(std::move(data), star().sphere());
}

SignProof provedAt(double delta) {
  SignProof proof;
  proof.delta = delta;
  proof.faces = 1000;
  proof.radial.worst = proof.normal.worst = -0.1;
  return proof;
}

SignProof openAt(double delta) {
  SignProof proof = provedAt(delta);
  proof.radial = {3, 2, 0.5};
  proof.weakest = {{17, Vec3(0.25, 0, 0), 0.5, -0.5, 0.125}};
  return proof;
}

TEST(Certificate, EnclosedSignsSayWhatTheyProve) {
  EXPECT_TRUE(checkOf(certify(star(), {}, {}, 1), "surface_signs").passed);
  const Certificate certificate = certify(withSigns({provedAt(1e-3)}), {}, {}, 1);
  const Check& check = checkOf(certificate, "surface_signs");
  EXPECT_TRUE(check.passed);
  EXPECT_EQ(check.detail,
            "no critical point but the center within 0.999 of the solid: proved on all 1000 faces");
  EXPECT_EQ(certificate.signs.points, 0u) << "nothing is left to be sampled";
}

TEST(Certificate, SignsThatStayOpenAreAWarning) {
  const Certificate warned = certify(withSigns({openAt(1e-3), provedAt(2e-3)}), {}, {}, 1);
  EXPECT_EQ(warned.verdict, Verdict::proved);
  const Check deeper = checkOf(warned, "surface_signs");
  EXPECT_FALSE(deeper.passed);
  EXPECT_EQ(deeper.value, 3);
  EXPECT_NE(deeper.detail.find("within 0.998 of the solid: proved"), std::string::npos) << deeper.detail;
  EXPECT_NE(deeper.detail.find("shrunk to 0.999 it stays open on 3 of 1000 faces (2 with the wrong sign)"),
            std::string::npos)
      << deeper.detail;
  const Vec3 place = star().chart().green().shape().frame().toWorld(Vec3(0.25, 0, 0));
  EXPECT_NE(deeper.detail.find("near (" + std::to_string(place[0]).substr(0, 4)), std::string::npos)
      << deeper.detail;
  const Check never = checkOf(certify(withSigns({openAt(1e-3), openAt(2e-2)}), {}, {}, 1), "surface_signs");
  EXPECT_FALSE(never.passed);
  EXPECT_NE(never.detail.find("not proved"), std::string::npos) << never.detail;
  EXPECT_NE(never.detail.find("shrunk to 0.98"), std::string::npos) << never.detail;
  SignProof onlyRadial = provedAt(1e-3);
  onlyRadial.normal = {4, 0, 0.25};
  const Check entering = checkOf(certify(withSigns({onlyRadial}), {}, {}, 1), "surface_signs");
  EXPECT_FALSE(entering.passed);
  EXPECT_NE(entering.detail.find("no critical point"), std::string::npos) << entering.detail;
  EXPECT_NE(entering.detail.find("4 of 1000 faces"), std::string::npos) << entering.detail;
  EXPECT_FALSE(SignProof{}.proved()) << "nothing was looked at";
}

TEST(Certificate, RoundTripsRefute) {
  RoundTrip trip;
  trip.points = 100;
  trip.max = 0.6;
  EXPECT_EQ(failureOf(certify(star(), {}, trip, 1)), "round_trip");
  EXPECT_TRUE(checkOf(certify(star(), {}, trip, 2), "round_trip").passed);
  trip.lost = 1;
  EXPECT_FALSE(checkOf(certify(star(), {}, trip, 2), "round_trip").passed);
}

TEST(Certificate, DeepInversionsDecideShallowOnesDoNot) {
  CellQuality cells;
  cells.cells = 10;
  cells.inverted = 3;
  cells.collapsed = 2;
  EXPECT_TRUE(checkOf(certify(star(), cells, {}, 1), "voxel_cells").passed);
  cells.invertedDeep = 1;
  EXPECT_EQ(failureOf(certify(star(), cells, {}, 1)), "voxel_cells");
  cells.invertedDeep = 0;
  cells.collapsedDeep = 1;
  EXPECT_EQ(failureOf(certify(star(), cells, {}, 1)), "voxel_cells");
}

// A map whose inverse is off by a fixed vector.
class Shifted final : public VolumeMap {
 public:
  void forward(std::span<const Vec3> x, std::span<Vec3> y) const override {
    std::copy(x.begin(), x.end(), y.begin());
  }
  void inverse(std::span<const Vec3> y, std::span<Vec3> x) const override {
    for (std::size_t i = 0; i < y.size(); ++i) x[i] = y[i] + Vec3(0, 0.25, 0);
  }
  void jacobian(std::span<const Vec3>, std::span<Mat3> j) const override {
    std::fill(j.begin(), j.end(), Mat3::Identity());
  }
};

TEST(RoundTripTest, MeasuresTheGap) {
  const std::vector<Vec3> x{{0.5, 0.25, 0}, {0, 0.125, 0.5}};
  const RoundTrip trip = measureRoundTrip(Shifted(), x);
  EXPECT_EQ(trip.points, 2u);
  EXPECT_EQ(trip.lost, 0u);
  EXPECT_NEAR(trip.max, 0.25, 1e-12);
  EXPECT_NEAR(trip.rms, 0.25, 1e-12);
}

TEST(SignReportTest, NaturalShapesHaveTheSignsOfLemma2) {
  const SignReport report = sampleSigns(star().chart().green());
  EXPECT_EQ(report.radialFailures, 0u);
  EXPECT_EQ(report.normalFailures, 0u);
  EXPECT_LT(report.worstRadial, 0);
}

}  // namespace
}  // namespace polestar
