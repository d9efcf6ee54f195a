// map --domain: cubes and polycubes from the shell, and what does not work told.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <sstream>

#include "cli/render_input.h"
#include "polestar/io/picture.h"
#include "polestar/map/map_file.h"
#include "polestar/map/similarity_map.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

using ::testing::HasSubstr;

class DomainTool : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<ScratchFolder>();
    mesh_ = folder_->obj("star.obj", smoothStar(3));
    made_ = runTool({"map", mesh_, "-o", *folder_ / "cube.vdb", "--domain", "cube", "--domain-axes", "0,0,0",
                     "--dim", "32", "--inverse", *folder_ / "cube-position.vdb", "--json"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  void SetUp() override { ASSERT_EQ(made_.exitCode, 0) << made_.err; }

  static ToolRun refused(std::vector<std::string> options) {
    std::vector<std::string> words{"map", mesh_, "-o", *folder_ / "never.vdb", "--dim", "16"};
    words.insert(words.end(), options.begin(), options.end());
    return runTool(words);
  }

  static inline std::unique_ptr<ScratchFolder> folder_;
  static inline std::string mesh_;
  static inline ToolRun made_;
};

TEST_F(DomainTool, SaysWhatTheDomainIs) {
  const auto json = made_.json();
  EXPECT_EQ(json["domain"]["kind"], "cube");
  EXPECT_EQ(json["domain"]["cells"], 1);
  EXPECT_EQ(json["domain"]["corners"], 8);
  EXPECT_GT(json["domain"]["overlap"].get<double>(), 0.3);
  EXPECT_EQ(json["sphere"]["kind"], "field-line");
  EXPECT_EQ(json["certificate"]["verdict"], "proved");
  EXPECT_EQ(json["inverse"]["inverted_deep"], 0);
  EXPECT_EQ(json["domain"]["distortion_by_edge_distance"].size(), 5u);
}

TEST_F(DomainTool, BothFilesAreVerified) {
  for (const char* name : {"cube.vdb", "cube.pmap"}) {
    const ToolRun run = runTool({"verify", *folder_ / name});
    EXPECT_EQ(run.exitCode, 0) << run.out << run.err;
  }
}

TEST_F(DomainTool, EvalAnswersInTheDomainToo) {
  const std::string points = folder_->file("points.txt", "0 0 0\n0.3 0.1 -0.2\n9 9 9\n");
  const auto json = runTool({"eval", *folder_ / "cube.pmap", "--points", points, "--json"}).json();
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(json["domain"][0][k].get<double>(), 0, 1e-12);
  EXPECT_EQ(json["domain"][1].size(), 3u);
  EXPECT_TRUE(json["domain"][2].is_null());
}

TEST_F(DomainTool, InfoNamesTheDomain) {
  EXPECT_THAT(runTool({"info", *folder_ / "cube.pmap"}).out, HasSubstr("cube"));
  const auto json = runTool({"info", *folder_ / "cube-position.vdb", "--json"}).json();
  std::vector<std::string> names;
  for (const auto& grid : json["grids"]) {
    names.push_back(grid["name"]);
    EXPECT_EQ(grid["metadata"]["polestar:domain"], "cube");
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("surface", "density", "position"));
}

std::string linesOf(const std::vector<Vec3>& points) {
  std::ostringstream lines;
  lines.precision(17);
  for (const Vec3& p : points) lines << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
  return lines.str();
}

std::vector<Vec3> pointsOf(const nlohmann::json& list) {
  std::vector<Vec3> points;
  for (const auto& p : list) points.emplace_back(p[0].get<double>(), p[1].get<double>(), p[2].get<double>());
  return points;
}

double largestDistance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double largest = a.size() == b.size() ? 0 : std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    largest = std::max(largest, (a[i] - b[i]).norm());
  return largest;
}

TEST_F(DomainTool, WarpEndsInTheDomainAndComesBack) {
  const std::string map = *folder_ / "cube.pmap";
  std::vector<Vec3> points{{0, 0, 0}, {0.3, 0.1, -0.2}, {-0.2, 0.25, 0.1}, {0, 0, 0.4}};
  const auto surface = smoothStar(3).vertices;
  points.insert(points.end(), surface.begin(), surface.end());
  const auto there = runTool({"warp", "-", map, "--json"}, {.input = linesOf(points)}).json();
  EXPECT_EQ(there["from"], "solid");
  EXPECT_EQ(there["to"], "cube");
  EXPECT_EQ(there["moved"]["outside"], 0);
  const std::vector<Vec3> inCube = pointsOf(there["warped"]);
  EXPECT_LT(inCube[0].norm(), 1e-12);
  for (std::size_t i = 0; i < inCube.size(); ++i) {
    const double out = inCube[i].lpNorm<Eigen::Infinity>();
    EXPECT_NEAR(out, i < 4 ? std::min(out, 0.999) : 1, 1e-12) << linesOf({points[i]});
  }
  // What eval says of the same points, by the one map of both.
  const auto eval =
      runTool({"eval", map, "--points", "-", "--table", "--json"}, {.input = linesOf(points)}).json();
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((pointsOf(eval["domain"])[i] - inCube[i]).norm(), 1e-9);
  const auto back = runTool({"warp", "-", map, "--inverse", "--json"}, {.input = linesOf(inCube)}).json();
  EXPECT_EQ(back["from"], "cube");
  EXPECT_EQ(back["to"], "solid");
  EXPECT_LT(largestDistance(pointsOf(back["warped"]), points), 1e-6);
}

TEST_F(DomainTool, CornersOfTheDomainAreOnTheSolid) {
  std::vector<Vec3> corners;
  for (int c = 0; c < 8; ++c) corners.emplace_back(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
  const std::string map = *folder_ / "cube.pmap";
  const auto json = runTool({"warp", "-", map, "--inverse", "--json"}, {.input = linesOf(corners)}).json();
  EXPECT_EQ(json["moved"]["outside"], 0);
  // On the surface: G vanishes there, and R is 1.
  const auto ball =
      runTool({"warp", "-", map, "--to", "ball", "--json"}, {.input = linesOf(pointsOf(json["warped"]))})
          .json();
  EXPECT_EQ(ball["to"], "ball");
  for (const Vec3& y : pointsOf(ball["warped"])) EXPECT_NEAR(y.norm(), 1, 1e-9);
  const auto outside =
      runTool({"warp", "-", map, "--inverse", "--json"}, {.input = "1.01 0 0\n0 0 0.99\n"}).json();
  EXPECT_EQ(outside["moved"]["outside"], 1);
  EXPECT_NEAR(outside["moved"]["outside_farthest"].get<double>(), 0.01, 1e-9);
}

TEST_F(DomainTool, WarpCarriesSurfacesAndGridsIntoTheDomain) {
  const std::string map = *folder_ / "cube.pmap", mesh = *folder_ / "in-cube.off";
  ASSERT_EQ(runTool({"warp", mesh_, map, "-o", mesh}).exitCode, 0);
  // Triangles run straight from vertex to vertex, over the cube's edges too.
  const Box box = boundingBox(readMesh(mesh).mesh);
  EXPECT_LT((box.max - Vec3::Ones()).norm() + (box.min + Vec3::Ones()).norm(), 1e-9);
  const ToolRun grids =
      runTool({"warp", *folder_ / "cube.vdb", map, "-o", *folder_ / "grids-in-cube.vdb", "--dim", "24"});
  ASSERT_EQ(grids.exitCode, 0) << grids.err;
  const auto info = runTool({"info", *folder_ / "grids-in-cube.vdb", "--json"}).json();
  for (const auto& grid : info["grids"]) EXPECT_EQ(grid["metadata"]["polestar:domain"], "cube");
}

TEST_F(DomainTool, ADomainIsNotTurned) {
  const ToolRun run =
      runTool({"warp", "-", *folder_ / "cube.pmap", "--rotate", "0,0,30"}, {.input = "0 0 0\n"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("--to ball"));
  EXPECT_EQ(runTool({"warp", "-", *folder_ / "cube.pmap", "--rotate", "0,0,30", "--to", "ball"},
                    {.input = "0 0 0\n"})
                .exitCode,
            0);
  EXPECT_EQ(runTool({"warp", "-", *folder_ / "cube.pmap", "--align", "--to", "ball"}, {.input = "0 0 0\n"})
                .exitCode,
            2);
}

TEST_F(DomainTool, PicturesGoByTheDomain) {
  const auto draw = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> words{"render", *folder_ / "cube.vdb", "-o", *folder_ / name, "--json", "--size",
                                   "64x48",  "--samples",           "2",  "--overwrite"};
    words.insert(words.end(), more.begin(), more.end());
    return runTool(words);
  };
  const ToolRun row = draw("row.png", {"--show", "solid,ball,domain"});
  ASSERT_EQ(row.exitCode, 0) << row.err;
  EXPECT_EQ(row.json()["look"], "lattice");
  EXPECT_EQ(row.json()["samples"]["unmapped"], 0);
  EXPECT_EQ(draw("a.png", {"--texture", "lattice", "--set", "divisions=3", "--iso-lines", "radius"}).exitCode,
            0);
  EXPECT_EQ(
      draw("a.png", {"--texture", "kiwi", "--iso-lines", "lattice,radius", "--show", "domain"}).exitCode, 0);
  EXPECT_EQ(draw("a.png", {"--shells", "0.5,0.8", "--field-lines", "9", "--show", "solid,domain"}).exitCode,
            0);
  EXPECT_EQ(draw("a.png", {"--texture", "coordinates"}).json()["look"], "coordinates");
}

/// A small patch's color, without light.
Vec3f colorAt(const cli::Subject& subject, const Vec3& point, const Vec3& normal, bool skin) {
  SurfacePatch patch;
  patch.point = point;
  patch.normal = normal;
  patch.first = normal.unitOrthogonal();
  patch.second = normal.cross(patch.first);
  patch.pixelFirst = patch.pixelSecond = 1e-4;
  patch.skin = skin;
  const SurfaceTap tap;
  SurfaceLook look;
  subject.appearance->look({&patch, 1}, {&tap, 1}, 1, {&look, 1});
  EXPECT_TRUE(look.known);
  return look.color;
}

TEST_F(DomainTool, ThePointOfTheSolidAndItsPlaceInTheDomainHaveOneColor) {
  const std::filesystem::path file = *folder_ / "cube.pmap";
  cli::Session session("render", "", {});
  const std::vector<cli::Body> bodies{cli::Body::solid, cli::Body::domain, cli::Body::ball};
  const auto subjects = cli::loadSubjects(file, bodies, cli::LookChoices(), session);
  const MapFile map = readMapFile(file);
  const DomainMap& domain = map.domain.value();
  const SimilarityMap placed(map.map.chart().green().shape().frame().origin, domain.shape().axes,
                             domain.shape().unit);
  // In the middles of cubes, of which there are 7^3, so that no line is near; on the skin at the middles of
  // their faces.
  int light = 0, deep = 0;
  for (int i = -3; i <= 3; ++i) {
    for (int j = -3; j <= 3; ++j) {
      for (const bool skin : {false, true}) {
        const Vec3 place(2 * i / 7.0, 2 * j / 7.0, skin ? 1 : 2 / 7.0);
        Vec3 point;
        domain.inverse({&place, 1}, {&point, 1});
        const Vec3 outward = (point - placed.toWorld(Vec3::Zero())).normalized();
        const Vec3f color = colorAt(subjects[0], point, outward, skin);
        const Vec3f ofDomain = colorAt(subjects[1], placed.toWorld(place), domain.shape().axes.col(2), skin);
        EXPECT_LT((color - ofDomain).norm(), 0.01) << place.transpose() << (skin ? " skin" : " inside");
        const bool isLight = (i + j + (skin ? 3 : 1)) % 2 == 0;
        // The tint at this place, in light cubes and in deep ones.
        const float tint = linearFromSrgbValue(static_cast<float>(0.7 + 0.29 * place[0]));
        EXPECT_NEAR(ofDomain[0] / tint, isLight ? 1 : 0.55, 0.01);
        ++(isLight ? light : deep);
      }
    }
  }
  EXPECT_GT(std::min(light, deep), 40);
  EXPECT_LT((subjects[2].appearance->center() - placed.toWorld(Vec3::Zero())).norm(), 1e-12);
}

TEST_F(DomainTool, TexturesOfTheBallAreNotReadOffCubeCoordinates) {
  const auto json =
      runTool({"transfer", "soccer", *folder_ / "cube.vdb", "-o", *folder_ / "soccer.vdb", "--json"}).json();
  EXPECT_EQ(json["rest"], "computed");
}

TEST_F(DomainTool, APolycubeByHandIsUsedOrNamesItsCells) {
  const std::string good = folder_->file("good.txt", "# a plus\n-1:1 0 0\n0 -1:1 0\n");
  const ToolRun run = runTool({"map", mesh_, "-o", *folder_ / "plus.vdb", "--domain", "polycube",
                               "--polycube", good, "--dim", "24", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["domain"]["cells"], 5);
  const ToolRun apart =
      refused({"--domain", "polycube", "--polycube", folder_->file("apart.txt", "0 0 0\n2 0 0\n")});
  EXPECT_EQ(apart.exitCode, 5);
  EXPECT_THAT(apart.err, HasSubstr("2 0 0"));
  const ToolRun broken =
      refused({"--domain", "polycube", "--polycube", folder_->file("broken.txt", "0 0\n")});
  EXPECT_EQ(broken.exitCode, 3);
  EXPECT_EQ(refused({"--domain", "polycube", "--polycube", *folder_ / "none.txt"}).exitCode, 3);
}

TEST_F(DomainTool, OptionsWithoutEffectAreErrors) {
  EXPECT_EQ(refused({"--cells", "4"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain", "cube", "--cells", "4"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain", "cube", "--exact"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain-axes", "0,0,0"}).exitCode, 2);
  EXPECT_EQ(refused({"--domain", "polycube", "--cells", "65"}).exitCode, 2);
  EXPECT_EQ(refused({"--inverse", *folder_ / "never.vdb"}).exitCode, 2);
  EXPECT_THAT(folder_->names(), ::testing::Not(::testing::Contains("never.vdb")));
}

}  // namespace
}  // namespace polestar::testing
