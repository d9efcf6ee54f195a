#include "polestar/map/map_file.h"

#include <gtest/gtest.h>

#include <unistd.h>
#include <cstring>

#include <fstream>
#include <random>

#include "polestar/core/error.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/solids.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;
using testing::pointsInside;

class MapFileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::temp_directory_path() / ("polestar map file " + std::to_string(::getpid()));
    fs::create_directories(folder_);
    path_ = folder_ / "star.pmap";
  }
  void TearDown() override { fs::remove_all(folder_); }

  static const BallMap& map() {
    static const BallMap made = testing::ballMap(testing::starShape(
        transformed(smoothStar(2), [](const Vec3& p) { return Vec3(0.1 * p + Vec3(5, 6, 7)); })));
    return made;
  }
  std::vector<char> bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void replace(const std::vector<char>& content) const {
    std::ofstream(path_, std::ios::binary)
        .write(content.data(), static_cast<std::streamsize>(content.size()));
  }

  fs::path folder_, path_;
};

TEST_F(MapFileTest, HoldsTheMapToTheLastBit) {
  const std::string hash =
      writeMapFile(path_, map(), {"star.obj", "polestar map star.obj -o star.vdb", 0.05});
  const MapFile file = readMapFile(path_);
  EXPECT_EQ(file.hash, hash);
  EXPECT_EQ(hash.size(), 32u);
  EXPECT_EQ(file.provenance.source, "star.obj");
  EXPECT_EQ(file.provenance.arguments, "polestar map star.obj -o star.vdb");
  EXPECT_EQ(file.provenance.balanceVolume, 0.05);
  const std::vector<Vec3> x = pointsInside(map().chart().green().shape(), 500);
  std::vector<Vec3> before(x.size()), after(x.size());
  map().forward(x, before);
  file.map.forward(x, after);
  EXPECT_EQ(before, after);
  map().inverse(before, before);
  file.map.inverse(after, after);
  EXPECT_EQ(before, after);
  EXPECT_EQ(file.map.chart().green().record().charge, map().chart().green().record().charge);
  EXPECT_EQ(file.map.chart().report().cells.bad(), map().chart().report().cells.bad());
  // The traced map needs the density, too.
  std::vector<Vec3> a(1), b(1);
  TracedBallMap(map()).forward({&x[7], 1}, a);
  TracedBallMap(file.map).forward({&x[7], 1}, b);
  EXPECT_EQ(a, b);
}

TEST_F(MapFileTest, HoldsEveryBoundaryAndRadius) {
  const GreenChart& chart = map().chart();
  for (const SphereMapKind boundary : kSphereMapKinds) {
    for (const RadiusKind radius : kRadiusKinds) {
      MapOptions options;
      options.boundary = boundary;
      options.radius = radius;
      BoundaryChoice choice = chooseBoundary(chart, options);
      const BallMap made(chart, std::move(choice.sphere), {}, std::move(choice.radius));
      const std::string hash = writeMapFile(path_, made);
      const MapFile file = readMapFile(path_);
      EXPECT_EQ(file.map.sphere().kind, boundary);
      EXPECT_EQ(file.map.radius().kind(), radius);
      EXPECT_EQ(writeMapFile(path_, file.map), hash);
      const std::vector<Vec3> x = pointsInside(chart.green().shape(), 50);
      std::vector<Vec3> before(x.size()), after(x.size());
      made.forward(x, before);
      file.map.forward(x, after);
      EXPECT_EQ(before, after);
    }
  }
}

TEST_F(MapFileTest, HoldsChargesToTheLastBit) {
  MapOptions options;
  options.green.solver = GreenSolver::mfs;
  options.green.mfs.mode = MfsMode::smooth;
  const BallMap made = mapToBall(testing::starShape(smoothStar(2)), options);
  const std::string hash = writeMapFile(path_, made);
  const MapFile file = readMapFile(path_);
  const GreenFunction &before = made.chart().green(), &after = file.map.chart().green();
  EXPECT_EQ(std::get<PointSources>(before.sources()).positions,
            std::get<PointSources>(after.sources()).positions);
  EXPECT_EQ(std::get<PointSources>(before.sources()).charges,
            std::get<PointSources>(after.sources()).charges);
  EXPECT_FALSE(after.charge().has_value());
  EXPECT_EQ(after.record().summary.solver, "mfs");
  ASSERT_TRUE(after.record().mfs.has_value());
  EXPECT_EQ(after.record().mfs->mode, MfsMode::smooth);
  EXPECT_EQ(after.record().mfs->heldOutError, before.record().mfs->heldOutError);
  // Written again, and restored again: the same file.
  EXPECT_EQ(writeMapFile(path_, file.map), hash);
  const std::vector<Vec3> x = pointsInside(before.shape(), 20);
  std::vector<Vec3> a(x.size()), b(x.size());
  TracedBallMap(made).forward(x, a);
  TracedBallMap(file.map).forward(x, b);
  // Bit for bit: between the smooth surface and its chords G is negative, and the answer NaN from both.
  EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(Vec3)), 0);
}

TEST_F(MapFileTest, HoldsWhatWasProvedOfTheSigns) {
  const GreenFunction& green = map().chart().green();
  GreenRecord record = green.record();
  SignProof open;
  open.delta = 1e-3;
  open.faces = green.layerMesh().triangles.size();
  open.radial = {2, 1, 0.5};
  open.normal = {1, 0, 0.25};
  open.weakest = {{7, Vec3(0.1, 0.2, 0.3), 0.5, -0.5, 0.4}, {3, Vec3(0.3, 0.2, 0.1), 0.1, -0.75, -0.2}};
  open.points = 1234;
  SignProof proved = open;
  proved.delta = 2e-3;
  proved.radial = {0, 0, -0.125};
  proved.weakest.clear();
  record.signs = {open, proved};
  auto data = std::make_shared<GreenChart::Data>(
      GreenChart::Data{restoreGreen(green.shape(), green.sources(), record),
                       map().chart().foliation(),
                       {map().chart().harmonic().begin(), map().chart().harmonic().end()},
                       {map().chart().harmonicGradient().begin(), map().chart().harmonicGradient().end()},
                       {map().chart().directions().begin(), map().chart().directions().end()},
                       {},
                       {},
                       map().chart().report()});
  writeMapFile(path_, BallMap(GreenChart(std::move(data)), map().sphere(), map().options()));
  const std::vector<SignProof> signs = readMapFile(path_).map.chart().green().record().signs;
  ASSERT_EQ(signs.size(), 2u);
  EXPECT_FALSE(signs[0].proved());
  EXPECT_TRUE(signs[1].proved());
  EXPECT_EQ(signs[0].delta, 1e-3);
  EXPECT_EQ(signs[0].faces, open.faces);
  EXPECT_EQ(signs[0].radial.failed, 2u);
  EXPECT_EQ(signs[0].radial.refuted, 1u);
  EXPECT_EQ(signs[0].normal.worst, 0.25);
  EXPECT_EQ(signs[0].points, 1234u);
  ASSERT_EQ(signs[0].weakest.size(), 2u);
  EXPECT_EQ(signs[0].weakest[1].triangle, 3u);
  EXPECT_EQ(signs[0].weakest[1].place, Vec3(0.3, 0.2, 0.1));
  EXPECT_EQ(signs[0].weakest[1].seen, -0.2);
  // Without them, as in files of older versions, there are none.
  writeMapFile(path_, map());
  EXPECT_TRUE(readMapFile(path_).map.chart().green().record().signs.empty());
}

TEST_F(MapFileTest, SameMapSameBytes) {
  writeMapFile(path_, map());
  const std::vector<char> first = bytes();
  writeMapFile(path_, map());
  EXPECT_EQ(first, bytes());
}

TEST_F(MapFileTest, AnyDamageIsRefused) {
  writeMapFile(path_, map());
  const std::vector<char> good = bytes();
  std::mt19937 random(11);
  for (int i = 0; i < 300; ++i) {
    std::vector<char> bad = good;
    if (i % 3 == 0) {
      bad.resize(random() % bad.size());
    } else {
      bad[i < 150 ? random() % 4096 : random() % bad.size()] ^= static_cast<char>(1 << random() % 8);
    }
    replace(bad);
    EXPECT_THROW(readMapFile(path_), Error);
    EXPECT_THROW(readMapFileInfo(path_), Error);
  }
}

TEST_F(MapFileTest, OtherFilesAreNamed) {
  replace({'s', 'o', 'l', 'i', 'd'});
  try {
    readMapFile(path_);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_NE(std::string(error.what()).find("star.pmap"), std::string::npos);
  }
  EXPECT_THROW(readMapFile(folder_ / "nothing.pmap"), Error);
  EXPECT_THROW(readMapFile(folder_), Error);
}

}  // namespace
}  // namespace polestar
