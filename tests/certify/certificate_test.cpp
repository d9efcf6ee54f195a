#include "polestar/certify/certificate.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::pointsInside;
using testing::starShape;

const BallMap& star() {
  static const BallMap map = testing::ballMap(starShape(smoothStar(3)));
  return map;
}

const Check& checkOf(const Certificate& certificate, const std::string& name) {
  const auto found = std::find_if(certificate.checks.begin(), certificate.checks.end(),
                                  [&](const Check& c) { return c.name == name; });
  EXPECT_NE(found, certificate.checks.end()) << name;
  return *found;
}

Certificate certified(const BallMap& map) {
  return certifyGrids(
      map, gridsOf(map, {.voxelSize = voxelSizeFor(map.chart().green().shape().surface().mesh(), 48)}));
}

TEST(Certificate, AGoodMapPassesEveryCheck) {
  const Certificate certificate = certified(star());
  for (const Check& check : certificate.checks)
    EXPECT_TRUE(check.passed) << check.name << ": " << check.detail;
  EXPECT_EQ(certificate.verdict, Verdict::sampled);
  EXPECT_EQ(certificate.failure(), "");
  EXPECT_GT(certificate.sampled.cells, 10000u);
  EXPECT_GT(certificate.sampled.minJacobian, 0);
}

TEST(Certificate, AMirroredBoundaryMapFails) {
  SphereMap mirrored = star().sphere();
  for (Vec3& u : mirrored.directions) u[0] = -u[0];
  mirrored.flips = countFlips(mirrored.directions, star().chart().foliation().triangles);
  const Certificate certificate = certified(BallMap(star().chart(), mirrored));
  EXPECT_EQ(certificate.verdict, Verdict::failed);
  EXPECT_FALSE(checkOf(certificate, "sphere_flips").passed);
  EXPECT_FALSE(checkOf(certificate, "voxel_cells").passed);
}

TEST(Certificate, ASingleFlipFails) {
  SphereMap flipped = star().sphere();
  // One vertex to the far side of its ring.
  const Triangle& t = star().chart().foliation().triangles[10];
  flipped.directions[t[0]] =
      (2 * flipped.directions[t[1]] + 2 * flipped.directions[t[2]] - 3 * flipped.directions[t[0]])
          .normalized();
  flipped.flips = countFlips(flipped.directions, star().chart().foliation().triangles);
  ASSERT_GT(flipped.flips, 0u);
  EXPECT_FALSE(checkOf(certify(BallMap(star().chart(), flipped), {}, {}, 1), "sphere_flips").passed);
}

TEST(Certificate, AnInvertedFoliationCellFails) {
  auto data = std::make_shared<GreenChart::Data>(
      GreenChart::Data{star().chart().green(),
                       star().chart().foliation(),
                       {star().chart().harmonic().begin(), star().chart().harmonic().end()},
                       {star().chart().harmonicGradient().begin(), star().chart().harmonicGradient().end()},
                       {star().chart().directions().begin(), star().chart().directions().end()},
                       {},
                       {},
                       star().chart().report()});
  Foliation& f = data->foliation;
  std::swap(f.nodes[f.nodeId(5, 3)], f.nodes[f.nodeId(8, 3)]);
  data->report.cells = countCells(f);
  const Certificate certificate = certify(BallMap(GreenChart(data), star().sphere()), {}, {}, 1);
  EXPECT_EQ(certificate.verdict, Verdict::failed);
  EXPECT_FALSE(checkOf(certificate, "foliation_cells").passed);
  EXPECT_NE(certificate.failure().find("foliation_cells"), std::string::npos);
}

// The star with this said of its signs.
BallMap withSigns(std::vector<SignProof> signs) {
  const GreenChart& chart = star().chart();
  GreenRecord record = chart.green().record();
  record.signs = std::move(signs);
  auto data = std::make_shared<GreenChart::Data>(
      GreenChart::Data{restoreGreen(chart.green().shape(), chart.green().sources(), record),
                       chart.foliation(),
                       {chart.harmonic().begin(), chart.harmonic().end()},
                       {chart.harmonicGradient().begin(), chart.harmonicGradient().end()},
                       {chart.directions().begin(), chart.directions().end()},
                       {},
                       {},
                       chart.report()});
  return BallMap(GreenChart(std::move(data)), star().sphere());
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

TEST(Certificate, EnclosedSignsAreExactAndSayWhatTheyProve) {
  const Check sampled = checkOf(certify(star(), {}, {}, 1), "field_signs");
  EXPECT_TRUE(sampled.passed);
  EXPECT_FALSE(sampled.exact);
  const Certificate certificate = certify(withSigns({provedAt(1e-3)}), {}, {}, 1);
  const Check& check = checkOf(certificate, "field_signs");
  EXPECT_TRUE(check.passed);
  EXPECT_TRUE(check.exact);
  EXPECT_FALSE(check.decides);
  EXPECT_EQ(check.detail,
            "no critical point but the center within 0.999 of the solid: proved on all 1000 faces");
  EXPECT_EQ(certificate.signs.points, 0u) << "nothing is left to be sampled";
}

TEST(Certificate, SignsThatStayOpenAreNoProof) {
  const Check deeper = checkOf(certify(withSigns({openAt(1e-3), provedAt(2e-3)}), {}, {}, 1), "field_signs");
  EXPECT_FALSE(deeper.passed);
  EXPECT_FALSE(deeper.exact);
  EXPECT_EQ(deeper.value, 3);
  EXPECT_NE(deeper.detail.find("within 0.998 of the solid: proved"), std::string::npos) << deeper.detail;
  EXPECT_NE(deeper.detail.find("shrunk to 0.999 it stays open on 3 of 1000 faces (2 with the wrong sign)"),
            std::string::npos)
      << deeper.detail;
  const Vec3 place = star().chart().green().shape().frame().toWorld(Vec3(0.25, 0, 0));
  EXPECT_NE(deeper.detail.find("near (" + std::to_string(place[0]).substr(0, 4)), std::string::npos)
      << deeper.detail;
  const Check never = checkOf(certify(withSigns({openAt(1e-3), openAt(2e-2)}), {}, {}, 1), "field_signs");
  EXPECT_FALSE(never.passed);
  EXPECT_FALSE(never.exact);
  EXPECT_NE(never.detail.find("not proved"), std::string::npos) << never.detail;
  EXPECT_NE(never.detail.find("shrunk to 0.98"), std::string::npos) << never.detail;
  SignProof onlyRadial = provedAt(1e-3);
  onlyRadial.normal = {4, 0, 0.25};
  const Check entering = checkOf(certify(withSigns({onlyRadial}), {}, {}, 1), "field_signs");
  EXPECT_FALSE(entering.passed);
  EXPECT_NE(entering.detail.find("no critical point"), std::string::npos) << entering.detail;
  EXPECT_NE(entering.detail.find("4 of 1000 faces"), std::string::npos) << entering.detail;
  EXPECT_FALSE(SignProof{}.proved()) << "nothing was looked at";
}

TEST(Certificate, RoundTripsDecide) {
  RoundTrip trip;
  trip.points = 100;
  trip.max = 0.6;
  EXPECT_FALSE(checkOf(certify(star(), {}, trip, 1), "round_trip").passed);
  EXPECT_TRUE(checkOf(certify(star(), {}, trip, 2), "round_trip").passed);
  trip.lost = 1;
  EXPECT_FALSE(checkOf(certify(star(), {}, trip, 2), "round_trip").passed);
}

TEST(Certificate, DeepInversionsDecideShallowOnesDoNot) {
  CellQuality cells;
  cells.cells = 10;
  cells.inverted = 3;
  EXPECT_TRUE(checkOf(certify(star(), cells, {}, 1), "voxel_cells").passed);
  cells.invertedDeep = 1;
  EXPECT_FALSE(checkOf(certify(star(), cells, {}, 1), "voxel_cells").passed);
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
