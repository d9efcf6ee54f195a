// polestar morph: sequences of grids and surfaces, parts of shots, and what is refused before anything is
// made.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>

#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Two maps are made once for the whole suite; nothing here writes to them.
class Morph : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    maps_ = std::make_unique<ScratchFolder>();
    made_ = runTool({"map", maps_->obj("star.obj", smoothStar(3)), "-o", *maps_ / "star.vdb", "--dim", "24"});
    madeBall_ =
        runTool({"map", maps_->obj("ball.obj", icosphere(3)), "-o", *maps_ / "ball.vdb", "--dim", "24"});
  }
  static void TearDownTestSuite() { maps_.reset(); }
  void SetUp() override {
    ASSERT_EQ(made_.exitCode, 0) << made_.err;
    ASSERT_EQ(madeBall_.exitCode, 0) << madeBall_.err;
  }
  static std::string star() { return *maps_ / "star.vdb"; }
  static std::string ball() { return *maps_ / "ball.pmap"; }

  /// morph of star and ball at 24 voxels, with more arguments.
  ToolRun morph(std::vector<std::string> more) const {
    std::vector<std::string> words{"morph", star(), ball(), "--dim", "24"};
    words.insert(words.end(), more.begin(), more.end());
    return runTool(words, {.folder = scratch_.path()});
  }

  /// The surfaces of frames 1 to 3 of `m.####.ply`.
  std::array<TriMesh, 3> surfaces() const {
    return {readMesh(scratch_ / "m.0001.ply").mesh, readMesh(scratch_ / "m.0002.ply").mesh,
            readMesh(scratch_ / "m.0003.ply").mesh};
  }

  static inline std::unique_ptr<ScratchFolder> maps_;
  static inline ToolRun made_, madeBall_;
  ScratchFolder scratch_;
};

std::string metadataOf(const fs::path& path, const std::string& grid, const std::string& key) {
  for (const GridInfo& info : readGridInfo(path)) {
    if (info.name != grid) continue;
    for (const auto& [name, value] : info.metadata) {
      if (name == key) return value;
    }
  }
  return "";
}

TEST_F(Morph, WritesASequenceThatTheJudgeAccepts) {
  const ToolRun run = morph({"--frames", "1-4", "-o", "melt.####.vdb", "--texture", "kiwi", "--texture",
                             "orange", "--ease", "smooth", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(scratch_.names(),
              ElementsAre("melt.0001.vdb", "melt.0002.vdb", "melt.0003.vdb", "melt.0004.vdb"));
  const nlohmann::json json = run.json();
  EXPECT_EQ(json["path"]["kind"], "straight");
  EXPECT_EQ(json["path"]["straight_at_all_times"][0]["open"], 0);
  ASSERT_EQ(json["frames"].size(), 4U);
  for (const auto& frame : json["frames"]) {
    EXPECT_TRUE(frame["proof"]["holds"]);
    EXPECT_EQ(frame["voxel_cells"]["inverted_deep"], 0);
  }
  std::vector<std::string> names;
  for (const GridInfo& info : readGridInfo(scratch_ / "melt.0002.vdb")) {
    names.push_back(info.name);
    EXPECT_EQ(info.role == ValueRole::contravariant, info.name == "vel");
  }
  EXPECT_THAT(names, ElementsAre("surface", "density", "rest", "vel", "Cd"));
  EXPECT_EQ(metadataOf(scratch_ / "melt.0002.vdb", "rest", "polestar:domain"), "ball");
  EXPECT_EQ(metadataOf(scratch_ / "melt.0002.vdb", "rest", "polestar:certificate"), "proved");
  EXPECT_THAT(metadataOf(scratch_ / "melt.0002.vdb", "vel", "polestar:weights"), HasSubstr("0.740741"));

  const ToolRun verified = runTool({"verify", scratch_ / "melt.0002.vdb", "--json"});
  EXPECT_EQ(verified.exitCode, 0) << verified.err << verified.out;
  EXPECT_THAT(verified.out, HasSubstr("not_judged"));
}

TEST_F(Morph, AFarmMakesTheSameFrames) {
  ASSERT_EQ(morph({"--frames", "1-3", "-o", "all.####.vdb"}).exitCode, 0);
  ASSERT_EQ(morph({"--shot", "1-3", "--frames", "2", "-o", "part.####.vdb", "-j", "1"}).exitCode, 0);
  const auto voxels = [&](const std::string& name) {
    std::vector<std::pair<std::string, std::size_t>> counts;
    for (const GridInfo& info : readGridInfo(scratch_ / name))
      counts.emplace_back(info.name, info.activeVoxels);
    return counts;
  };
  EXPECT_EQ(voxels("all.0002.vdb"), voxels("part.0002.vdb"));
  EXPECT_EQ(metadataOf(scratch_ / "all.0002.vdb", "rest", "polestar:weights"),
            metadataOf(scratch_ / "part.0002.vdb", "rest", "polestar:weights"));
  EXPECT_FALSE(fs::exists(scratch_ / "part.0001.vdb"));
}

TEST_F(Morph, SurfacesKeepTheirTriangles) {
  ASSERT_EQ(morph({"--frames", "1-3", "-o", "m.####.vdb", "--mesh", "m.####.ply", "--half"}).exitCode, 0);
  const TriMesh first = readMesh(scratch_ / "m.0001.ply").mesh, last = readMesh(scratch_ / "m.0003.ply").mesh;
  EXPECT_EQ(first.triangles, last.triangles);
  for (const Vec3& vertex : last.vertices) ASSERT_NEAR(vertex.norm(), 1, 0.02);
}

TEST_F(Morph, WeightsGiveStillsAndSequences) {
  ASSERT_EQ(morph({"--weights", "0.25,0.75", "-o", "still.vdb"}).exitCode, 0);
  EXPECT_THAT(metadataOf(scratch_ / "still.vdb", "rest", "polestar:weights"), HasSubstr("0.250000,0.750000"));
  scratch_.file("w.txt", "# there and back\n1 0\n0.5 0.5\n1 0\n");
  const ToolRun run = morph({"--weights", "w.txt", "--frames", "5-7", "-o", "back.####.vdb", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NEAR(run.json()["frames"][0]["volume"], run.json()["frames"][2]["volume"], 1e-12);
  EXPECT_EQ(morph({"--weights", "w.txt", "--frames", "5-8", "-o", "x.####.vdb"}).exitCode, 2);
  EXPECT_EQ(morph({"--weights", "0.5,0.6", "-o", "x.vdb"}).exitCode, 2);
  EXPECT_EQ(morph({"--weights", "0.5,0.3,0.2", "-o", "x.vdb"}).exitCode, 2);
}

TEST_F(Morph, MeshesAreMappedFirst) {
  const ToolRun run =
      runTool({"morph", *maps_ / "star.obj", ball(), "--weights", "1,0", "--dim", "24", "-o", "first.vdb"},
              {.folder = scratch_.path()});
  EXPECT_EQ(run.exitCode, 0) << run.err;
}

const std::vector<std::string> kThreeSurfaces{"--frames", "1-3",        "-o",    "m.####.vdb",
                                              "--mesh",   "m.####.ply", "--json"};

std::vector<std::string> with(std::vector<std::string> words, const std::vector<std::string>& more) {
  words.insert(words.end(), more.begin(), more.end());
  return words;
}

std::size_t nearestVertex(const TriMesh& mesh, const Vec3& place) {
  const auto closer = [&](const Vec3& a, const Vec3& b) { return (a - place).norm() < (b - place).norm(); };
  return static_cast<std::size_t>(std::min_element(mesh.vertices.begin(), mesh.vertices.end(), closer) -
                                  mesh.vertices.begin());
}

double azimuth(const Vec3& x) { return std::atan2(x.y(), x.x()); }

Mat3 aboutZ(double angle) { return Eigen::AngleAxisd(angle, Vec3::UnitZ()).toRotationMatrix(); }

// Sides of the common triangles are 0.06 radians long at most; the alignment stretches them by less than two.
constexpr double kSide = 0.06;

TEST_F(Morph, LandmarksMeetAndRunBetween) {
  const TriMesh surface = smoothStar(3);
  std::vector<Vec3> from{surface.vertices[nearestVertex(surface, {0, 0, 9})],
                         surface.vertices[nearestVertex(surface, {0, 0, -9})]};
  std::vector<Vec3> to{Vec3::UnitZ(), -Vec3::UnitZ()};
  // Poles stay; around the equator some go farther than others.
  for (int k = 0; k < 3; ++k) {
    const double angle = 2 * k * std::numbers::pi / 3;
    from.push_back(surface.vertices[nearestVertex(surface, aboutZ(angle) * Vec3(9, 0, 0))]);
    to.push_back(aboutZ(angle + 0.5 + 0.15 * k) * Vec3::UnitX());
  }
  std::ofstream pairs(scratch_ / "pairs.csv");
  pairs.precision(17);
  for (std::size_t i = 0; i < from.size(); ++i)
    pairs << from[i].transpose() << "  " << to[i].transpose() << '\n';
  pairs.close();
  const ToolRun run = morph(with(kThreeSurfaces, {"--landmarks", "pairs.csv"}));
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto told = run.json()["aligned"][0];
  EXPECT_EQ(told["shape"], ball());
  EXPECT_LT(told["landmarks"]["worst_degrees"], 0.1);
  const std::array<TriMesh, 3> frames = surfaces();
  std::vector<std::size_t> vertices;
  for (std::size_t i = 0; i < from.size(); ++i) {
    const std::size_t v = nearestVertex(frames[0], from[i]);
    vertices.push_back(v);
    EXPECT_LT((frames[0].vertices[v] - from[i]).norm(), kSide);
    EXPECT_LT((frames[2].vertices[v] - to[i]).norm(), 2 * kSide) << i;
    if (i < 2) continue;
    const double whole = std::remainder(azimuth(to[i]) - azimuth(from[i]), 2 * std::numbers::pi);
    const double half =
        std::remainder(azimuth(frames[1].vertices[v]) - azimuth(from[i]), 2 * std::numbers::pi);
    EXPECT_NEAR(half / whole, 0.5, 0.25) << i;
  }
  // Without them the star's lobes go straight out to the ball.
  ASSERT_EQ(morph(with(kThreeSurfaces, {"--overwrite"})).exitCode, 0);
  const TriMesh plain = surfaces()[2];
  for (std::size_t i = 2; i < from.size(); ++i)
    EXPECT_GT((plain.vertices[nearestVertex(surfaces()[0], from[i])] - to[i]).norm(), 4 * kSide);
}

TEST_F(Morph, AlignedCopiesTurn) {
  const TriMesh lump = radialShape(3, [](const Vec3& d) {
    return 1 + 0.35 * d.x() + 0.3 * d.x() * d.y() + 0.25 * d.y() * d.z() - 0.2 * d.z() * d.z();
  });
  const Mat3 quarter = aboutZ(std::numbers::pi / 2), eighth = aboutZ(std::numbers::pi / 4);
  const std::string first = scratch_.obj("lump.obj", lump);
  const std::string last =
      scratch_.obj("turned.obj", transformed(lump, [&](const Vec3& x) -> Vec3 { return quarter * x; }));
  const std::vector<std::string> words = with({"morph", first, last, "--dim", "24"}, kThreeSurfaces);
  const ToolRun run = runTool(with(words, {"--align"}), {.folder = scratch_.path()});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_NEAR(run.json()["aligned"][0]["alignment"]["degrees"], 90, 0.1);
  const auto volume = [](const ToolRun& made, int frame) -> double {
    return made.json()["frames"][frame]["volume"];
  };
  EXPECT_NEAR(volume(run, 1) / volume(run, 0), 1, 1e-3);
  const std::array<TriMesh, 3> frames = surfaces();
  // It turns about its own center, which goes straight.
  Vec3 shift = Vec3::Zero();
  for (std::size_t v = 0; v < frames[0].vertices.size(); ++v)
    shift += frames[1].vertices[v] - eighth * frames[0].vertices[v];
  shift /= static_cast<double>(frames[0].vertices.size());
  for (std::size_t v = 0; v < frames[0].vertices.size(); ++v) {
    ASSERT_LT((frames[1].vertices[v] - eighth * frames[0].vertices[v] - shift).norm(), 0.02);
    ASSERT_LT((frames[2].vertices[v] - quarter * frames[0].vertices[v]).norm(), 0.02);
  }
  // Not aligned it melts into its copy.
  const ToolRun melted = runTool(with(words, {"--overwrite"}), {.folder = scratch_.path()});
  ASSERT_EQ(melted.exitCode, 0) << melted.err;
  EXPECT_LT(volume(melted, 1) / volume(melted, 0), 0.99);
}

TEST_F(Morph, SurfaceMapsAreFollowed) {
  const TriMesh onStar = smoothStar(3);
  const TriMesh onBall = transformed(icosphere(3), [](const Vec3& x) -> Vec3 { return aboutZ(0.6) * x; });
  const ToolRun run = morph(with(
      kThreeSurfaces, {"--surface-map", scratch_.obj("star.obj", onStar), scratch_.obj("ball.obj", onBall)}));
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["aligned"][0]["surface_map"]["triangles"], onStar.triangles.size());
  const std::array<TriMesh, 3> frames = surfaces();
  for (const std::size_t i : {0U, 100U, 333U}) {
    const std::size_t v = nearestVertex(frames[0], onStar.vertices[i]);
    EXPECT_LT((frames[2].vertices[v] - onBall.vertices[i]).norm(), 2 * kSide) << i;
  }
}

TEST_F(Morph, AlignmentsOfSeveralShapesAreToldApart) {
  // Of three turns of the star that agree none is taken; of those of a ball, either.
  const ToolRun run = runTool({"morph", star(), star(), ball(), "--dim", "24", "--weights", "0.4,0.4,0.2",
                               "--align", "-o", "still.vdb", "--json"},
                              {.folder = scratch_.path()});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, AllOf(HasSubstr("--align of star.vdb: a turn that differs by"),
                             HasSubstr("--align of ball.pmap: one of the solids is round")));
  const nlohmann::json told = run.json()["aligned"];
  ASSERT_EQ(told.size(), 2U);
  for (const auto& shape : told) EXPECT_EQ(shape["alignment"]["ambiguous"], true);
  EXPECT_NEAR(told[0]["alignment"]["degrees"], 0, 1e-6);

  scratch_.file("pairs.csv", "1,0,0, 1,0,0\n");
  const ToolRun two = runTool({"morph", star(), star(), ball(), "--weights", "0.4,0.4,0.2", "--landmarks",
                               "pairs.csv", "-o", "marked.vdb"},
                              {.folder = scratch_.path()});
  EXPECT_EQ(two.exitCode, 3);
  EXPECT_THAT(two.err,
              HasSubstr("pairs.csv:1: landmarks are 9 numbers a line, a place on each of the 3 solids"));
}

TEST_F(Morph, MistakesAreToldBeforeAnythingIsMade) {
  const auto refused = [&](const std::vector<std::string>& more, int code, const std::string& message) {
    const ToolRun run = morph(more);
    EXPECT_EQ(run.exitCode, code) << message;
    EXPECT_THAT(run.err, HasSubstr(message));
  };
  refused({"--frames", "1-3"}, 2, "-o OUT.####.vdb is missing");
  refused({"--frames", "1-3", "-o", "m.vdb"}, 2, "no place for the number");
  refused({"--frames", "1-3", "-o", "m.####.png"}, 2, "does not end in .vdb");
  refused({"-o", "m.####.vdb"}, 2, "which frames?");
  refused({"--frames", "3", "-o", "m.####.vdb"}, 2, "two frames at least");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--texture", "nothing"}, 2, "nothing");
  refused({"--frames", "5", "--shot", "1-3", "-o", "m.####.vdb"}, 2, "not in the shot");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--mesh", "m.####.png"}, 2, "--mesh");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--surface-map", "a.ply", "b.ply", "c.ply"}, 2,
          "3 meshes for 2 shapes");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--align", "--rotate", "0,0,90"}, 2, "--rotate");
  refused({"--frames", "1-3", "-o", "m.####.vdb", "--landmarks", "none.csv"}, 3, "none.csv");
  const ToolRun one = runTool({"morph", star(), "--frames", "1-3", "-o", "m.####.vdb"});
  EXPECT_EQ(one.exitCode, 2);
  EXPECT_THAT(one.err, HasSubstr("two shapes at least"));
  const ToolRun missing =
      runTool({"morph", star(), scratch_ / "no.vdb", "--frames", "1-3", "-o", "m.####.vdb"});
  EXPECT_EQ(missing.exitCode, 3);
  scratch_.file("m.0002.vdb", "mine");
  refused({"--frames", "1-3", "-o", "m.####.vdb"}, 3, "exists already");
  EXPECT_THAT(scratch_.names(), ElementsAre("m.0002.vdb"));
}

TEST_F(Morph, ADryRunNamesItsFiles) {
  const ToolRun run = morph({"--frames", "1-2", "-o", "m.####.vdb", "--dry-run"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("m.0001.vdb"), HasSubstr("m.0002.vdb")));
  EXPECT_THAT(scratch_.names(), IsEmpty());
}

}  // namespace
}  // namespace polestar::testing
