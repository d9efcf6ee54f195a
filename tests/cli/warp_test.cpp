// polestar warp: points, surfaces, tetrahedra and grids there and back, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <numbers>
#include <sstream>

#include "mesh/tet_bodies.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/read_tet_mesh.h"
#include "polestar/mesh/shapes.h"
#include "polestar/mesh/tet_orientation.h"
#include "polestar/mesh/write_mesh.h"
#include "polestar/mesh/write_tet_mesh.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const TriMesh& starSurface() {
  static const TriMesh mesh = smoothStar(3);
  return mesh;
}

std::vector<Vec3> pointsOf(const std::string& lines) {
  std::vector<Vec3> points;
  std::istringstream in(lines);
  for (std::string line; std::getline(in, line);) {
    std::istringstream numbers(line);
    Vec3 point;
    std::string word;
    for (int k = 0; k < 3 && numbers >> word; ++k) point[k] = std::strtod(word.c_str(), nullptr);
    points.push_back(point);
  }
  return points;
}

/// Two maps are made once for the whole suite; nothing here writes to them.
class Warp : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    maps_ = std::make_unique<ScratchFolder>();
    made_ = runTool({"map", maps_->obj("star.obj", starSurface()), "-o", *maps_ / "star.vdb", "--dim", "32"});
    madeBall_ =
        runTool({"map", maps_->obj("ball.obj", icosphere(3)), "-o", *maps_ / "ball.vdb", "--dim", "24"});
  }
  static void TearDownTestSuite() { maps_.reset(); }
  void SetUp() override {
    ASSERT_EQ(made_.exitCode, 0) << made_.err;
    ASSERT_EQ(madeBall_.exitCode, 0) << madeBall_.err;
  }
  static std::string star() { return *maps_ / "star.pmap"; }
  static std::string ball() { return *maps_ / "ball.pmap"; }

  std::string tets(const std::string& name, const TetMesh& mesh) const {
    writeTetMesh(scratch_ / name, mesh);
    return scratch_ / name;
  }

  static inline std::unique_ptr<ScratchFolder> maps_;
  static inline ToolRun made_, madeBall_;
  ScratchFolder scratch_;
};

TEST_F(Warp, PointsGoThereAndBack) {
  const std::string points = "0.1 0.2 0.3\n-0.4,0.1,0\n0 0 0.6\n";
  const ToolRun there = runTool({"warp", "-", star()}, {.input = points});
  EXPECT_EQ(there.exitCode, 0) << there.err;
  EXPECT_EQ(there.messages(), "");
  const ToolRun back = runTool({"warp", "-", star(), "--inverse"}, {.input = there.out});
  EXPECT_EQ(back.exitCode, 0) << back.err;
  const std::vector<Vec3> x = pointsOf("0.1 0.2 0.3\n-0.4 0.1 0\n0 0 0.6\n"), y = pointsOf(back.out);
  ASSERT_EQ(y.size(), 3u);
  for (int i = 0; i < 3; ++i) EXPECT_LT((x[i] - y[i]).norm(), 1e-9);

  // The same numbers as eval has them.
  const auto json = runTool({"warp", "-", star(), "--json"}, {.input = points}).json();
  const auto eval = runTool({"eval", star(), "--points", "-", "--table", "--json"}, {.input = points}).json();
  EXPECT_EQ(json["points"], eval["points"]);
  EXPECT_EQ(json["warped"], eval["ball"]);
  EXPECT_EQ(json["moved"]["count"], 3);
  const auto exact = runTool({"warp", "-", star(), "--exact", "--json"}, {.input = points}).json();
  const auto traced = runTool({"eval", star(), "--points", "-", "--json"}, {.input = points}).json();
  EXPECT_EQ(exact["warped"], traced["ball"]);
  EXPECT_EQ(exact["exact"], true);
}

TEST_F(Warp, PointsOutsideAreNanWithAWarning) {
  const ToolSettings input{.input = "0.1 0.2 0.3\n0 0 5\n7 0 0\n"};
  const ToolRun run = runTool({"warp", "-", star()}, input);
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_THAT(run.out, HasSubstr("\nnan nan nan\nnan nan nan\n"));
  EXPECT_THAT(run.err, AllOf(HasSubstr("warning: 2 of 3 points lie outside"), HasSubstr("number 1"),
                             HasSubstr("0 0 5")));
  const auto json = runTool({"warp", "-", star(), "--json"}, input).json();
  EXPECT_EQ(json["moved"]["outside"], 2);
  EXPECT_EQ(json["moved"]["outside_first"]["id"], 1);
  EXPECT_TRUE(json["warped"][1].is_null());
}

TEST_F(Warp, PointsGoToAFile) {
  const std::string points = scratch_.file("points.xyz", "# some\n0.1 0.2 0.3\n\n-0.4 0.1 0\n");
  const ToolRun run = runTool({"warp", points, star(), "-o", scratch_ / "out.csv", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["outputs"][0], scratch_ / "out.csv");
  EXPECT_FALSE(run.json().contains("warped"));
  const std::string csv = readFile(scratch_ / "out.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), ','), 4);
  const ToolRun back =
      runTool({"warp", scratch_ / "out.csv", star(), "--inverse", "-o", scratch_ / "back.txt"});
  EXPECT_EQ(back.exitCode, 0) << back.err;
  EXPECT_LT((pointsOf(readFile(scratch_ / "back.txt"))[1] - Vec3(-0.4, 0.1, 0)).norm(), 1e-9);
}

TEST_F(Warp, TheSurfaceBecomesTheSphereAndComesBack) {
  for (const char* name : {"ball.ply", "ball.obj", "ball.off", "ball.stl"}) {
    SCOPED_TRACE(name);
    const std::string sphere = scratch_ / name;
    const ToolRun run = runTool({"warp", *maps_ / "star.obj", star(), "-o", sphere, "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.json()["kind"], "surface");
    EXPECT_EQ(run.json()["moved"]["count"], starSurface().vertices.size());
    EXPECT_EQ(run.json()["moved"]["outside"], 0);
    const TriMesh mesh = readMesh(sphere).mesh;
    EXPECT_EQ(mesh.triangles.size(), starSurface().triangles.size());
    for (const Vec3& v : mesh.vertices) EXPECT_NEAR(v.norm(), 1, 1e-6);

    if (std::string(name) != "ball.stl") continue;
    const ToolRun back = runTool({"warp", sphere, star(), "--inverse", "-o", scratch_ / "back.obj"});
    ASSERT_EQ(back.exitCode, 0) << back.err;
    const TriMesh again = readMesh(scratch_ / "back.obj").mesh;
    double worst = 0;
    for (std::size_t t = 0; t < again.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k)
        worst = std::max(worst, (again.corner(t, k) - starSurface().corner(t, k)).norm());
    }
    EXPECT_LT(worst, 1e-5);
  }
}

TEST_F(Warp, TetrahedraStayPositiveAndKeepTheirLabels) {
  TetMesh solid = shells(starSurface(), 4);
  MeshData region{"region", 1, true, false, {}};
  for (std::size_t i = 0; i < solid.cellCount(); ++i) region.values.push_back(static_cast<double>(i % 3));
  solid.cellData = {region};
  const std::string input = tets("solid.vtk", solid);
  const ToolRun run = runTool({"warp", input, *maps_ / "star.vdb", "-o", scratch_ / "ball.msh", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.messages(), "");
  const auto report = run.json()["tetrahedra"];
  EXPECT_EQ(report["count"], solid.cellCount());
  EXPECT_EQ(report["before"]["positive"], solid.cellCount());
  EXPECT_EQ(report["after"]["positive"], solid.cellCount());
  EXPECT_EQ(report["turned"], 0);
  EXPECT_EQ(report["first"].size(), 0u);
  EXPECT_GT(report["quality"]["after"]["least"].get<double>(), 0);
  EXPECT_THAT(run.json()["left_out"], IsEmpty());
  const TetMeshFile out = readTetMesh(scratch_ / "ball.msh");
  EXPECT_EQ(out.mesh.corners, solid.corners);
  EXPECT_EQ(out.mesh.cellData[0].values, region.values);

  // And back, in other formats; the text says what was done.
  const ToolRun back =
      runTool({"warp", scratch_ / "ball.msh", star(), "--inverse", "-o", scratch_ / "again.mesh"});
  ASSERT_EQ(back.exitCode, 0) << back.err;
  EXPECT_THAT(back.out, AllOf(HasSubstr("from the ball to the solid of"), HasSubstr("turned over"),
                              HasSubstr("mean ratio"), HasSubstr("wrote")));
  const TetMesh again = readTetMesh(scratch_ / "again.mesh").mesh;
  for (std::size_t i = 0; i < again.vertices.size(); ++i)
    EXPECT_LT((again.vertices[i] - solid.vertices[i]).norm(), 5e-3);
}

TEST_F(Warp, OnToAnotherSolidAndBack) {
  const std::string input = tets("solid.vtk", shells(starSurface(), 3));
  const std::vector<std::string> turn{"--to", ball(), "--rotate", "10,20,30"};
  const auto with = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), turn.begin(), turn.end());
    return runTool(arguments);
  };
  const ToolRun there = with({"warp", input, star(), "-o", scratch_ / "there.vtk", "--json"});
  ASSERT_EQ(there.exitCode, 0) << there.err;
  EXPECT_EQ(there.json()["from"], "solid");
  EXPECT_EQ(there.json()["to"], "solid");
  EXPECT_EQ(there.json()["tetrahedra"]["turned"], 0);
  const ToolRun back =
      with({"warp", scratch_ / "there.vtk", star(), "--inverse", "-o", scratch_ / "back.vtk"});
  ASSERT_EQ(back.exitCode, 0) << back.err;
  const TetMesh a = readTetMesh(input).mesh, b = readTetMesh(scratch_ / "back.vtk").mesh;
  const TetMesh turned = readTetMesh(scratch_ / "there.vtk").mesh;
  double moved = 0;
  for (std::size_t i = 0; i < a.vertices.size(); ++i) {
    EXPECT_LT((a.vertices[i] - b.vertices[i]).norm(), 5e-3) << i;
    moved = std::max(moved, (a.vertices[i] - turned.vertices[i]).norm());
  }
  EXPECT_GT(moved, 0.3) << "the ball was turned";
}

// Slivers of either bulge: the map bends one of them over. Nothing but the report can find that.
TEST_F(Warp, TurnedTetrahedraEndWith6) {
  TetMesh slivers;
  for (const double bulge : {1e-7, -1e-7}) {
    const auto first = static_cast<std::int32_t>(slivers.vertices.size());
    slivers.vertices.insert(slivers.vertices.end(),
                            {{0.1, 0.1, 0.4}, {0.5, 0.1, 0.4}, {0.3, 0.4, 0.4}, {0.3, 0.2, 0.4 + bulge}});
    std::array<std::int32_t, 4> corners{first, first + 1, first + 2, first + 3};
    if (bulge < 0) std::swap(corners[0], corners[1]);
    slivers.addCell(CellShape::tetrahedron, corners);
  }
  const std::string input = tets("slivers.vtk", slivers);
  const std::vector<std::string> arguments{"warp", input, star(), "-o", scratch_ / "out.vtk", "--json"};
  ToolRun run = runTool(arguments);
  EXPECT_EQ(run.exitCode, 6) << run.err;
  EXPECT_EQ(run.json()["error"]["code"], "not_converged");
  const auto report = run.json()["tetrahedra"];
  EXPECT_EQ(report["before"]["positive"], 2);
  EXPECT_EQ(report["turned"], 1);
  EXPECT_EQ(report["turned_on_boundary"], 1);
  EXPECT_EQ(report["first"].size(), 1u);
  EXPECT_LT(report["quality"]["after"]["least"].get<double>(), 0);
  EXPECT_THAT(run.err, HasSubstr("1 of 2 tetrahedra turned over"));
  EXPECT_THAT(scratch_.names(), ElementsAre("slivers.vtk"));

  auto keeping = arguments;
  keeping.push_back("--keep-failed");
  run = runTool(keeping);
  EXPECT_EQ(run.exitCode, 6);
  EXPECT_THAT(scratch_.names(), ElementsAre("out.vtk", "slivers.vtk"));
  EXPECT_EQ(run.json()["outputs"][0], scratch_ / "out.vtk");
}

TEST_F(Warp, VerticesOutsideEndWith3UnlessTheyAreSnapped) {
  TetMesh solid = shells(starSurface(), 2);
  const std::size_t moved = 17;
  solid.vertices[moved] *= 1.01;
  const std::string input = tets("solid.vtk", solid);
  ToolRun run = runTool({"warp", input, star(), "-o", scratch_ / "out.vtk", "--json"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(HasSubstr("1 of 1,285 vertices lie outside"), HasSubstr("number 17,"),
                             HasSubstr("--snap 0.00")));
  EXPECT_EQ(run.json()["moved"]["outside"], 1);
  EXPECT_EQ(run.json()["moved"]["outside_first"]["id"], moved);
  EXPECT_THAT(scratch_.names(), ElementsAre("solid.vtk"));

  run = runTool({"warp", input, star(), "-o", scratch_ / "out.vtk", "--snap", "0.01", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["moved"]["snapped"], 1);
  EXPECT_NEAR(readTetMesh(scratch_ / "out.vtk").mesh.vertices[moved].norm(), 1, 1e-12);

  // A mesh of something else.
  for (Vec3& v : solid.vertices) v += Vec3(100, 0, 0);
  run = runTool({"warp", tets("far.vtk", solid), star(), "-o", scratch_ / "far-out.vtk"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("units"));
}

TEST_F(Warp, WhatAFormatCannotHoldIsSaid) {
  TetMesh solid = shells(starSurface(), 2);
  MeshData normals{"n", 3, false, true, std::vector<double>(3 * solid.vertices.size(), 1)};
  MeshData heat{"heat", 1, false, false, std::vector<double>(solid.vertices.size(), 2)};
  solid.vertexData = {normals, heat};
  const ToolRun run =
      runTool({"warp", tets("solid.vtk", solid), star(), "-o", scratch_ / "out.mesh", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.json()["left_out"],
              ElementsAre("the normals n, which held before the warp", "vertex data heat"));
  EXPECT_THAT(run.err, HasSubstr("left out: vertex data heat"));
}

TEST_F(Warp, DamagedMeshesEndWith3AndSayWhere) {
  const std::string whole = readFile(tets("solid.vtk", shells(starSurface(), 2)));
  const std::string cut = scratch_.file("cut.vtk", whole.substr(0, whole.size() / 3));
  ToolRun run = runTool({"warp", cut, star(), "-o", scratch_ / "out.vtk"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, AllOf(StartsWith("polestar warp: cannot read " + cut), HasSubstr("line ")));
  run = runTool({"warp", scratch_.file("a.meshb", "x"), star(), "-o", scratch_ / "out.vtk"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("binary Medit"));
  EXPECT_EQ(
      runTool({"warp", scratch_ / "solid.vtk", scratch_ / "no.pmap", "-o", scratch_ / "o.vtk"}).exitCode, 3);
  EXPECT_EQ(runTool({"warp", scratch_ / "no.vtk", star(), "-o", scratch_ / "o.vtk"}).exitCode, 3);
  EXPECT_EQ(runTool({"warp", scratch_.file("no.txt", "\n"), star()}).exitCode, 3);
}

TEST_F(Warp, GridsGoIntoTheBall) {
  const std::string grids = *maps_ / "star.vdb";
  const ToolRun run = runTool({"warp", grids, grids, "-o", scratch_ / "out.vdb", "--dim", "24", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("surface: a level set is no distance"));
  const auto json = run.json();
  EXPECT_NEAR(json["voxel_size"].get<double>(), 2.0 / 24, 1e-15);
  EXPECT_NEAR(json["voxels_inside"].get<double>(), 4.0 / 3 * std::acos(-1) * 12 * 12 * 12, 150);
  ASSERT_EQ(json["grids"].size(), 4u);
  EXPECT_EQ(json["grids"][2]["name"], "rest");
  EXPECT_EQ(json["grids"][2]["active_voxels"], json["voxels_inside"]);
  const auto info = runTool({"info", scratch_ / "out.vdb", "--json"}).json();
  EXPECT_EQ(info["grids"][0]["class"], "unknown");
  EXPECT_EQ(info["grids"][2]["metadata"]["polestar:domain"], "ball");
  EXPECT_FALSE(info["grids"][2]["metadata"].contains("polestar:map_hash"));

  // From solid to solid, in voxels of a given size.
  const ToolRun on =
      runTool({"warp", grids, star(), "--to", ball(), "-o", scratch_ / "on.vdb", "--voxel", "0.2"});
  EXPECT_EQ(on.exitCode, 0) << on.err;
  EXPECT_THAT(on.out, AllOf(HasSubstr("rest"), HasSubstr("voxels of 0.2")));
  // To standard output.
  const ToolRun piped =
      runTool({"warp", grids, star(), "-o", "-", "--dim", "8", "-q"}, {.output = scratch_ / "piped.vdb"});
  EXPECT_EQ(piped.exitCode, 0) << piped.err;
  EXPECT_EQ(readFile(scratch_ / "piped.vdb").substr(0, 4), " BDV");
}

TEST_F(Warp, LandmarksBringTwoSolidsIntoLine) {
  // The three tips of the upper half go a third of the way on to the next, the poles stay.
  std::ofstream pairs(scratch_ / "pairs.csv");
  pairs << "# star, ball\n0,0,0.9, 0,0,1\n0,0,-0.9, 0,0,-1\n";
  for (int k = 0; k < 3; ++k) {
    const double angle = 2 * k * std::numbers::pi / 3, turned = angle + 0.35 + 0.1 * k;
    pairs << std::cos(angle) << ',' << std::sin(angle) << ",0.5, " << 0.9 * std::cos(turned) << ','
          << 0.9 * std::sin(turned) << ",0.4\n";
  }
  pairs.close();
  const std::vector<std::string> on{"--to", ball(), "--landmarks", scratch_ / "pairs.csv", "--json"};
  const auto with = [&](std::vector<std::string> arguments, const std::string& input) {
    arguments.insert(arguments.end(), on.begin(), on.end());
    return runTool(arguments, {.input = input});
  };
  const ToolRun there = with({"warp", "-", star()}, "0.5 0 0.25\n0.1 0.2 0.3\n");
  ASSERT_EQ(there.exitCode, 0) << there.err;
  const auto landmarks = there.json()["landmarks"];
  EXPECT_EQ(landmarks["pairs"], 5);
  EXPECT_EQ(landmarks["refined"], true);
  EXPECT_TRUE(landmarks["stalled"].is_null());
  EXPECT_LT(landmarks["worst_degrees"], 0.1);
  EXPECT_LT(landmarks["largest_dilatation"], 3);
  const auto at = there.json()["warped"];
  const ToolRun back =
      with({"warp", "-", star(), "--inverse"}, at[0].dump().substr(1, at[0].dump().size() - 2) + "\n");
  ASSERT_EQ(back.exitCode, 0) << back.err;
  const auto point = back.json()["warped"][0];
  EXPECT_LT((Vec3(point[0], point[1], point[2]) - Vec3(0.5, 0, 0.25)).norm(), 1e-8);
}

TEST_F(Warp, AlignsAndFollowsSurfaceMaps) {
  // The star onto itself: of three turns that agree, none.
  const ToolRun aligned =
      runTool({"warp", "-", star(), "--to", star(), "--align", "--json"}, {.input = "0.1 0.2 0.3\n"});
  ASSERT_EQ(aligned.exitCode, 0) << aligned.err;
  EXPECT_EQ(aligned.json()["alignment"]["ambiguous"], true);
  EXPECT_THAT(aligned.err, HasSubstr("fits about as well"));
  const auto same = aligned.json()["warped"][0];
  EXPECT_LT((Vec3(same[0], same[1], same[2]) - Vec3(0.1, 0.2, 0.3)).norm(), 1e-3);

  TriMesh onBall = icosphere(3);
  const std::string first = scratch_.obj("first.obj", starSurface());
  const std::vector<std::string> follow{
      "warp", "-", star(), "--to", ball(), "--surface-map", first, scratch_.obj("second.obj", onBall)};
  const Vec3 vertex = starSurface().vertices[100];
  std::ostringstream line;
  line.precision(17);
  line << vertex.transpose() << '\n';
  const ToolRun mapped = runTool(follow, {.input = line.str()});
  ASSERT_EQ(mapped.exitCode, 0) << mapped.err;
  EXPECT_LT((pointsOf(mapped.out)[0] - onBall.vertices[100]).norm(), 1e-3);
  std::swap(onBall.vertices[100], onBall.vertices[200]);
  scratch_.obj("second.obj", onBall);
  const ToolRun folded = runTool(follow, {.input = line.str()});
  EXPECT_EQ(folded.exitCode, 6);
  EXPECT_THAT(folded.err, AllOf(HasSubstr("turned over or flat on the second solid"), HasSubstr(" at ")));
}

TEST_F(Warp, SolidsAreBroughtIntoLineInOneWay) {
  const std::string none = scratch_ / "none.csv";
  const ToolRun two = runTool({"warp", "-", star(), "--to", ball(), "--align", "--landmarks", none});
  EXPECT_EQ(two.exitCode, 2);
  EXPECT_THAT(two.err, AllOf(HasSubstr("--align"), HasSubstr("--landmarks")));
  const ToolRun alone = runTool({"warp", "-", star(), "--align"});
  EXPECT_EQ(alone.exitCode, 2);
  EXPECT_THAT(alone.err, HasSubstr("--to MAP2 is missing"));
}

TEST_F(Warp, InterruptedWaitingEndsWith130) {
  const ToolRun run =
      runTool({"warp", "-", star(), "-o", scratch_ / "out.txt"},
              {.interruptAfter = std::chrono::milliseconds(300), .limit = std::chrono::seconds(20)});
  EXPECT_FALSE(run.hung);
  EXPECT_EQ(run.exitCode, 130);
  EXPECT_THAT(scratch_.names(), IsEmpty());
}

TEST_F(Warp, TheSameBytesForAnyNumberOfThreads) {
  const std::string input = tets("solid.vtk", shells(starSurface(), 3));
  std::vector<std::string> files;
  for (const char* threads : {"1", "3"}) {
    const ScratchFolder other;
    // The command line is in the title: all but -j must be alike.
    const ToolRun run = runTool({"warp", input, star(), "-o", "out.vtk"},
                                {.folder = other.path(), .environment = {{"SLURM_CPUS_PER_TASK", threads}}});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    files.push_back(readFile(other / "out.vtk"));
  }
  EXPECT_TRUE(files[0] == files[1]);
}

// TetGen [Si 2015] as a program of its own, as in the paper's step 4. M: it takes nearly flat parts of the
// surface for flat otherwise, and puts vertices outside.
class Tetgen : public Warp {
 protected:
  void SetUp() override {
    Warp::SetUp();
    if (std::system("command -v tetgen >/dev/null 2>&1") != 0)
      GTEST_SKIP() << "there is no tetgen on the PATH";
  }

  void mesh(const TriMesh& surface, const std::string& switches) const {
    writeMesh(scratch_ / "solid.off", surface);
    const std::string command =
        "cd " + scratch_.path().string() + " && tetgen -" + switches + " solid.off >/dev/null 2>&1";
    ASSERT_EQ(std::system(command.c_str()), 0);
  }

  nlohmann::json carried(const std::string& name, const std::string& map) const {
    const ToolRun run = runTool(
        {"warp", scratch_ / name, map, "-o", scratch_ / "out.vtk", "--overwrite", "--keep-failed", "--json"});
    EXPECT_TRUE(run.exitCode == 0 || run.exitCode == 6) << run.err;
    const auto json = run.json();
    const auto report = json["tetrahedra"];
    EXPECT_EQ(run.exitCode == 6, report["turned"] != 0 || report["flattened"] != 0);
    EXPECT_EQ(json["moved"]["outside"], 0);
    EXPECT_EQ(report["map_folds"], 0);
    EXPECT_EQ(report["before"]["positive"], report["count"]);
    // The report against the files themselves.
    const TetMesh before = readTetMesh(scratch_ / name).mesh, after = readTetMesh(scratch_ / "out.vtk").mesh;
    EXPECT_EQ(compareTetrahedra(before.tetrahedra().corners, before.vertices, after.vertices).turned,
              report["turned"]);
    return report;
  }
};

TEST_F(Tetgen, NoTetrahedronOfTheBallTurns) {
  mesh(icosphere(3), "pq1.3YMQ");
  const auto report = carried("solid.1.ele", ball());
  EXPECT_GT(report["count"].get<int>(), 500);
  // Those with all vertices on the boundary are not the map's to keep.
  EXPECT_EQ(report["turned"], report["turned_on_boundary"]);
  EXPECT_EQ(report["flattened"], report["flattened_on_boundary"]);
}

TEST_F(Tetgen, HardlyAnyOfAStarTurnAndThoseForTheirStraightEdges) {
  mesh(starSurface(), "pq1.3MkgQ");
  for (const char* name : {"solid.1.vtk", "solid.1.mesh"}) {
    SCOPED_TRACE(name);
    const auto report = carried(name, star());
    EXPECT_GT(report["count"].get<int>(), 500);
    EXPECT_LE(report["turned"].get<double>(), 1e-3 * report["count"].get<double>());
  }
}

}  // namespace
}  // namespace polestar::testing
