// map, eval, info and render on one small solid, from the mesh to the picture.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "cli/text.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "run_tool.h"
#include "support/opencl.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsSupersetOf;
using ::testing::Pair;
using ::testing::StartsWith;

std::vector<std::string> memberNames(const nlohmann::json& object) {
  std::vector<std::string> names;
  for (const auto& [name, value] : object.items()) names.push_back(name);
  return names;
}

/// The map is made once for the whole suite; nothing here writes to it.
class MappedBall : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = std::make_unique<ScratchFolder>();
    mesh_ = folder_->obj("it's a ball.obj", icosphere(3));
    made_ = runTool({"map", mesh_, "-o", grids(), "--dim", "32", "--json"});
  }
  static void TearDownTestSuite() { folder_.reset(); }
  void SetUp() override { ASSERT_EQ(made_.exitCode, 0) << made_.err; }

  static std::string grids() { return *folder_ / "it's a ball.vdb"; }
  static std::string map() { return *folder_ / "it's a ball.pmap"; }

  static inline std::unique_ptr<ScratchFolder> folder_;
  static inline std::string mesh_;
  static inline ToolRun made_;
};

TEST_F(MappedBall, MakesTheGridsAndTheMapAndNothingElse) {
  EXPECT_EQ(made_.messages(), "");
  EXPECT_THAT(folder_->names(), ElementsAre("it's a ball.obj", "it's a ball.pmap", "it's a ball.vdb"));
}

TEST_F(MappedBall, JsonHasTheMembersOfTheSchema) {
  const auto json = made_.json();
  EXPECT_THAT(memberNames(json),
              IsSupersetOf({"schema", "version", "command", "inputs", "threads", "units", "valid", "star",
                            "center", "margin_relative", "solver", "harmonic_radius", "boundary_error",
                            "charge", "certificate", "sphere", "sampled", "timings", "peak_memory_bytes"}));
  EXPECT_THAT(memberNames(json["boundary_error"]), IsSupersetOf({"max", "rms", "points", "kind"}));
  EXPECT_THAT(memberNames(json["certificate"]), IsSupersetOf({"verdict", "checks"}));
  EXPECT_THAT(memberNames(json["sphere"]),
              IsSupersetOf({"kind", "flips", "omega_flips", "qc_mean", "qc_max"}));
  EXPECT_THAT(memberNames(json["sampled"]),
              IsSupersetOf({"voxels", "cells", "inverted", "collapsed", "inverted_deep", "min_jacobian",
                            "round_trip_rms", "round_trip_max"}));
  EXPECT_THAT(memberNames(json["timings"]),
              IsSupersetOf({"load", "check", "green", "trace", "sphere", "sample", "certify", "write"}));
  EXPECT_EQ(json["solver"], "layer");
  EXPECT_NEAR(json["harmonic_radius"].get<double>(), 1, 0.01) << "of the unit ball about its center";
  EXPECT_NEAR(json["charge"].get<double>(), -1, 1e-3);
}

TEST_F(MappedBall, IsProvedByTheChecksThatAreProofs) {
  const auto certificate = made_.json()["certificate"];
  EXPECT_EQ(certificate["verdict"], "proved");
  std::map<std::string, int> roles;
  for (const auto& check : certificate["checks"]) {
    EXPECT_THAT(memberNames(check), ElementsAre("detail", "limit", "name", "passed", "role", "value"));
    EXPECT_TRUE(check["passed"].get<bool>()) << check;
    ++roles[check["role"]];
  }
  EXPECT_THAT(roles, ElementsAre(Pair("falsifier", 4), Pair("proof", 10), Pair("warning", 1)));
  const ScratchFolder scratch;
  const ToolRun run = runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--dim", "24"});
  EXPECT_THAT(run.out, HasSubstr("verdict     proved: the map's table is one to one"));
  EXPECT_THAT(runTool({"info", scratch / "ball.vdb"}).out, HasSubstr("polestar:certificate      proved"));
}

TEST_F(MappedBall, ExactGridsAreTraced) {
  const ScratchFolder scratch;
  const std::vector<std::string> arguments{"map",   mesh_, "-o",     scratch / "ball.vdb",
                                           "--dim", "16",  "--exact"};
  const ToolRun text = runTool(arguments);
  ASSERT_EQ(text.exitCode, 0) << text.err;
  EXPECT_THAT(text.out, HasSubstr("voxels      traced one by one; "));
  auto again = arguments;
  again.insert(again.end(), {"--overwrite", "--json"});
  const auto json = runTool(again).json();
  EXPECT_EQ(json["certificate"]["verdict"], "proved");
  EXPECT_TRUE(json["exact"]["traced"].get<bool>());
  EXPECT_LT(json["exact"]["answered_by_table"].get<int>(), json["sampled"]["voxels"].get<int>() / 50);
  const auto metadata = [](const std::string& file) {
    return runTool({"info", file, "--json"}).json()["grids"][0]["metadata"];
  };
  EXPECT_EQ(metadata(scratch / "ball.vdb")["polestar:exact"], "yes");
  EXPECT_TRUE(metadata(scratch / "ball.vdb").contains("polestar:answered_by_table"));
  EXPECT_EQ(metadata(grids())["polestar:exact"], "no");
  EXPECT_FALSE(made_.json()["exact"]["traced"].get<bool>());
  EXPECT_TRUE(made_.json()["exact"]["answered_by_table"].is_null());
}

TEST_F(MappedBall, ProvesItsBoundaryErrorWhenAsked) {
  EXPECT_EQ(made_.json()["boundary_error"]["kind"], "sampled");
  EXPECT_TRUE(made_.json()["field_signs"].empty());
  const ScratchFolder scratch;
  const ToolRun run =
      runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--dim", "24", "--prove", "-q", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto error = run.json()["boundary_error"];
  EXPECT_EQ(error["kind"], "bound");
  EXPECT_GE(error["max"].get<double>(), error["sampled"].get<double>());
  const auto signs = run.json()["field_signs"];
  ASSERT_FALSE(signs.empty());
  EXPECT_THAT(memberNames(signs[0]),
              IsSupersetOf({"delta", "proved", "faces", "radial", "normal", "weakest", "points", "seconds"}));
  EXPECT_EQ(signs[0]["delta"], 1e-3);
  EXPECT_TRUE(signs.back()["proved"].get<bool>());
  EXPECT_LT(signs.back()["radial"]["worst"].get<double>(), 0);
  // The field that was proved is the one that the .pmap brings back.
  const ToolSettings points{.input = "0.3 0.2 -0.1\n"};
  const auto fromMesh = runTool({"eval", mesh_, "--prove", "-q", "--points", "-", "--json"}, points).json();
  const auto fromMap = runTool({"eval", scratch / "ball.pmap", "--points", "-", "--json"}, points).json();
  for (const char* name : {"ball", "green", "gradient"}) EXPECT_EQ(fromMesh[name], fromMap[name]) << name;
}

TEST_F(MappedBall, OtherBoundariesAndRadiiAreWrittenDown) {
  const struct {
    std::vector<std::string> options;
    const char *boundary, *radius;
  } cases[] = {{{}, "conformal", "green"},
               {{"--boundary", "field-line"}, "field-line", "green"},
               {{"--boundary", "balanced"}, "balanced", "balanced"},
               {{"--boundary", "balanced", "--radius", "mixed"}, "balanced", "mixed"},
               {{"--boundary", "radial", "--radius", "volume"}, "radial", "volume"}};
  for (const auto& [options, boundary, radius] : cases) {
    const ScratchFolder scratch;
    std::vector<std::string> arguments{"map", mesh_, "-o", scratch / "ball.vdb", "--dim", "24", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ToolRun run = runTool(arguments);
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.json()["sphere"]["kind"], boundary);
    EXPECT_EQ(run.json()["sphere"]["flips"], 0);
    EXPECT_EQ(run.json()["sphere"]["omega_flips"], 0);
    EXPECT_EQ(run.json()["radius"]["kind"], radius);
    const auto grids = runTool({"info", scratch / "ball.vdb", "--json"}).json()["grids"];
    EXPECT_EQ(grids[0]["metadata"]["polestar:boundary"], boundary);
    EXPECT_EQ(grids[0]["metadata"]["polestar:radius"], radius);
    const auto file = runTool({"info", scratch / "ball.pmap", "--json"}).json()["map"];
    EXPECT_EQ(file["radius"]["kind"], radius);
    EXPECT_EQ(file["chart"]["direction_flips"], 0);
  }
  EXPECT_EQ(runTool({"map", mesh_, "-o", *folder_ / "no.vdb", "--radius", "big"}).exitCode, 2);
}

TEST_F(MappedBall, TheWeightOfVolumesIsChosenAndWrittenDown) {
  const auto made = [&](const ScratchFolder& scratch, std::vector<std::string> options) {
    const std::string egg = scratch.obj("egg.obj", transformed(icosphere(3), [](const Vec3& v) {
                                          return Vec3(2.5 * v[0], v[1], 0.7 * v[2]);
                                        }));
    std::vector<std::string> arguments{"map", egg, "-o", scratch / "egg.vdb", "--dim", "24", "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const ToolRun run = runTool(arguments);
    EXPECT_EQ(run.exitCode, 0) << run.err;
    return run.json();
  };
  EXPECT_TRUE(made_.json()["balance_volume"].is_null());
  const ScratchFolder plain, even;
  const auto byDefault = made(plain, {"--radius", "balanced"});
  const auto chosen = made(even, {"--radius", "balanced", "--balance-volume", "0.5"});
  EXPECT_EQ(byDefault["balance_volume"], 0.03);
  EXPECT_EQ(chosen["balance_volume"], 0.5);
  // More weight on even volumes draws shells towards equal shares: less steep at the center.
  EXPECT_LT(chosen["radius"]["slope_at_center"].get<double>(),
            byDefault["radius"]["slope_at_center"].get<double>());
  const auto grids = runTool({"info", even / "egg.vdb", "--json"}).json()["grids"];
  EXPECT_EQ(grids[0]["metadata"]["polestar:balance_volume"], "0.5");
  EXPECT_EQ(runTool({"info", even / "egg.pmap", "--json"}).json()["map"]["balance_volume"], 0.5);
  EXPECT_THAT(runTool({"info", even / "egg.pmap"}).out, HasSubstr("balance volume"));
}

TEST_F(MappedBall, AWeightOfVolumesThatWeighsNothingIsRefused) {
  const ScratchFolder scratch;
  const ToolRun run = runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--balance-volume", "0.1"});
  EXPECT_EQ(run.exitCode, 2);
  EXPECT_THAT(run.err, HasSubstr("--balance-volume has no effect here"));
  for (const char* bad : {"-0.1", "1000", "much"}) {
    EXPECT_EQ(
        runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--boundary", "balanced", "--balance-volume", bad})
            .exitCode,
        2)
        << bad;
  }
}

TEST_F(MappedBall, SaysBothFlips) {
  const ScratchFolder scratch;
  const ToolRun run =
      runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--dim", "24", "--boundary", "field-line"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("0 flipped triangles of phi, 0 of omega"));
  EXPECT_THAT(runTool({"info", scratch / "ball.pmap"}).out, HasSubstr("0 of phi, 0 of omega"));
}

TEST_F(MappedBall, ThePapersSolverTellsWhatItDid) {
  const ScratchFolder scratch;
  const ToolRun run =
      runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--dim", "24", "--solver", "mfs", "-q", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto json = run.json();
  EXPECT_EQ(json["solver"], "mfs");
  ASSERT_TRUE(json.contains("charge"));
  EXPECT_TRUE(json["charge"].is_null()) << "the sum of charges outside tells nothing";
  const auto& mfs = json["green"]["mfs"];
  EXPECT_EQ(mfs["mode"], "paper");
  EXPECT_EQ(mfs["sources"], 385) << "0.6 of 642 vertices";
  EXPECT_GT(json["boundary_error"]["max"].get<double>(), mfs["collocation_error"].get<double>());
  // The charges are in the .pmap: the traced answer needs them.
  const ToolSettings points{.input = "0.3 0.2 -0.1\n"};
  const auto fromMesh =
      runTool({"eval", mesh_, "--solver", "mfs", "-q", "--points", "-", "--json"}, points).json();
  const auto fromMap = runTool({"eval", scratch / "ball.pmap", "--points", "-", "--json"}, points).json();
  for (const char* name : {"ball", "green", "gradient"}) EXPECT_EQ(fromMesh[name], fromMap[name]) << name;
}

TEST_F(MappedBall, ChargesForASmoothSurfaceSayHowWellTheyDidWhereTheyWereNotAsked) {
  const ScratchFolder scratch;
  const ToolRun run = runTool({"map", mesh_, "-o", scratch / "ball.vdb", "--dim", "24", "--solver", "mfs",
                               "--mfs", "smooth", "-q", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  const auto mfs = run.json()["green"]["mfs"];
  EXPECT_EQ(mfs["mode"], "smooth");
  EXPECT_LT(mfs["held_out_error"].get<double>(), 1e-5);
  EXPECT_EQ(runTool({"map", mesh_, "-o", scratch / "no.vdb", "--mfs", "rough"}).exitCode, 2);
}

TEST_F(MappedBall, InfoKnowsBothFiles) {
  const auto grid = runTool({"info", grids(), "--json"}).json();
  std::vector<std::string> names;
  for (const auto& one : grid["grids"]) names.push_back(one["name"]);
  EXPECT_THAT(names, IsSupersetOf({"surface", "density", "rest", "green"}));
  const auto map = runTool({"info", MappedBall::map(), "--json"}).json();
  EXPECT_EQ(map["file"]["format"], "pmap");
  EXPECT_EQ(map["map"]["source"], "it's a ball.obj");
  const std::string hash = made_.json()["map_hash"];
  // Of the finer surface that field lines start from.
  const std::uint64_t lines = made_.json()["foliation"]["lines"];
  EXPECT_GT(lines, 642u);
  EXPECT_EQ(grid["grids"][0]["metadata"]["polestar:map_hash"], hash);
  EXPECT_THAT(runTool({"info", MappedBall::map()}).out,
              AllOf(HasSubstr(hash), HasSubstr(cli::grouped(lines))));
}

TEST_F(MappedBall, EvalKnowsTheBallsGreensFunction) {
  const std::string points = "0.3, 0.2 -0.1\n0 0 0.9\n2 0 0\n";
  const auto json = runTool({"eval", grids(), "--points", "-", "--json"}, {.input = points}).json();
  ASSERT_EQ(json["points"].size(), 3U);
  EXPECT_EQ(json["points"][0], nlohmann::json::array({0.3, 0.2, -0.1}));
  for (int i = 0; i < 2; ++i) {
    const Vec3 x(json["points"][i][0], json["points"][i][1], json["points"][i][2]);
    const Vec3 ball(json["ball"][i][0], json["ball"][i][1], json["ball"][i][2]);
    // 642 vertices: the polyhedron lies up to 1 % inside the ball.
    EXPECT_NEAR(ball.norm(), x.norm(), 0.01);
    EXPECT_NEAR(json["green"][i].get<double>(), 1 / x.norm() - 1, 0.02);
    EXPECT_NEAR(json["gradient"][i][2].get<double>(), -x.z() / std::pow(x.norm(), 3), 0.02);
  }
  for (const char* name : {"ball", "green", "gradient"}) EXPECT_TRUE(json[name][2].is_null()) << name;
}

TEST_F(MappedBall, EvalAtTheCenterIsTheOriginWithoutGreen) {
  const auto center = made_.json()["center"];
  const std::string point = center[0].dump() + " " + center[1].dump() + " " + center[2].dump() + "\n";
  const auto json = runTool({"eval", map(), "--points", "-", "--json"}, {.input = point}).json();
  EXPECT_EQ(json["ball"][0], nlohmann::json::array({0, 0, 0}));
  EXPECT_TRUE(json["green"][0].is_null());
}

TEST_F(MappedBall, EvalIsTheSameFromMeshMapAndGrids) {
  const ToolSettings points{.input = "0.3 0.2 -0.1\n"};
  const auto fromMesh = runTool({"eval", mesh_, "--points", "-", "--json"}, points).json();
  const auto fromMap = runTool({"eval", map(), "--points", "-", "--json"}, points).json();
  const auto fromGrids = runTool({"eval", grids(), "--points", "-", "--json"}, points).json();
  for (const char* name : {"ball", "green", "gradient"}) {
    EXPECT_EQ(fromMesh[name], fromMap[name]) << name;
    EXPECT_EQ(fromMap[name], fromGrids[name]) << name;
  }
}

TEST_F(MappedBall, ADeviceThatIsNotThereMeansTheCpuAndVerboseSaysSo) {
  const ToolSettings points{.input = "0.3 0.2 -0.1\n"};
  const auto onCpu = runTool({"eval", mesh_, "--points", "-", "--json"}, points).json();
  const ToolRun run =
      runTool({"eval", mesh_, "--points", "-", "--json", "--device", "opencl:no such", "-v"}, points);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("no OpenCL device: sums run on the CPU"));
  EXPECT_EQ(run.json()["green"], onCpu["green"]);
  EXPECT_EQ(run.json()["ball"], onCpu["ball"]);
  const ToolRun calm = runTool({"eval", mesh_, "--points", "-", "--device", "opencl:no such"}, points);
  EXPECT_EQ(calm.messages(), "");
}

TEST_F(MappedBall, ADeviceGivesTheSameMap) {
  POLESTAR_REQUIRE_OPENCL();
  const ToolRun run = runTool(
      {"map", mesh_, "-o", *folder_ / "device.vdb", "--dim", "32", "--json", "-v", "--device", "opencl"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("run on the OpenCL device"));
  EXPECT_EQ(made_.json()["green"]["device"], "cpu");
  EXPECT_NE(run.json()["green"]["device"], "cpu");
  const double radius = made_.json()["harmonic_radius"];
  EXPECT_NEAR(run.json()["harmonic_radius"].get<double>(), radius, 1e-5 * radius);
  for (const char* file : {"device.vdb", "device.pmap"}) fs::remove(folder_->path() / file);
}

TEST_F(MappedBall, EvalAsTextIsOneLineAPoint) {
  const ToolRun run = runTool({"eval", map(), "--points", "-"}, {.input = "0.3 0.2 -0.1\n2 0 0\n"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(StartsWith("# x y z"), HasSubstr("\n0.3 0.2 -0.1  "),
                             HasSubstr("\n2 0 0  nan nan nan  nan")));
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 3);
}

TEST_F(MappedBall, RenderDrawsAPng) {
  const ScratchFolder scratch;
  const ToolRun run = runTool({"render", grids(), "-o", scratch / "a b.png", "--size", "64x48", "--samples",
                               "4", "--cut", "x,0.1", "--cut", "-1,-1,0", "--view", "-1,1,-0.5", "--json"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_GT(run.json()["samples"]["solid"].get<int>(), 1000);
  EXPECT_THAT(scratch.names(), ElementsAre("a b.png"));
  const std::string png = readFile(scratch / "a b.png");
  ASSERT_THAT(png, StartsWith("\x89PNG\r\n"));
  EXPECT_EQ(png.substr(16, 8), std::string("\0\0\0\x40\0\0\0\x30", 8)) << "width and height";
}

TEST_F(MappedBall, TheSameBytesForAnyNumberOfThreads) {
  std::vector<std::string> files;
  for (const char* threads : {"1", "3"}) {
    const ScratchFolder scratch;
    // The command line is part of the metadata: all but -j must be alike.
    const ToolRun run =
        runTool({"map", mesh_, "-o", "out.vdb", "--dim", "24"},
                {.folder = scratch.path(), .environment = {{"SLURM_CPUS_PER_TASK", threads}}});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    files.push_back(readFile(scratch / "out.vdb") + readFile(scratch / "out.pmap"));
  }
  EXPECT_TRUE(files[0] == files[1]);
}

TEST_F(MappedBall, GridsGoToStandardOutput) {
  const ScratchFolder scratch;
  const ToolRun run = runTool({"map", mesh_, "-o", "-", "--dim", "16"},
                              {.folder = scratch.path(), .output = scratch / "piped.vdb"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(scratch.names(), ElementsAre("piped.vdb"));
  EXPECT_GE(runTool({"info", scratch / "piped.vdb", "--json"}).json()["grids"].size(), 4U);
}

TEST_F(MappedBall, GridsWithoutTheirMapAreNoMap) {
  const ScratchFolder scratch;
  fs::copy_file(grids(), scratch / "lonely.vdb");
  ToolRun run = runTool({"eval", scratch / "lonely.vdb", "--points", "-"}, {.input = "0 0 0\n"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("lonely.pmap"));

  // A map beside it that it was not made from.
  const std::string other = scratch.obj("other.obj", cube(4));
  ASSERT_EQ(runTool({"map", other, "-o", scratch / "other.vdb", "--dim", "16", "--keep-failed"}).out.empty(),
            false);
  fs::copy_file(scratch / "other.pmap", scratch / "lonely.pmap");
  run = runTool({"eval", scratch / "lonely.vdb", "--points", "-"}, {.input = "0 0 0\n"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("polestar:map_hash"));
}

TEST_F(MappedBall, DamagedMapsEndWith3) {
  const ScratchFolder scratch;
  const std::string whole = readFile(map());
  std::string flipped = whole;
  flipped[flipped.size() / 2] = static_cast<char>(flipped[flipped.size() / 2] ^ 1);
  const std::vector<std::string> damaged{"", whole.substr(0, 6), whole.substr(0, whole.size() / 2), flipped};
  for (const std::string& content : damaged) {
    SCOPED_TRACE(content.size());
    const std::string file = scratch.file("damaged.pmap", content);
    const ToolRun run = runTool({"eval", file, "--points", "-"}, {.input = "0 0 0\n"});
    EXPECT_EQ(run.exitCode, 3) << run.err;
    EXPECT_THAT(run.err, HasSubstr("damaged.pmap"));
  }
}

TEST_F(MappedBall, OverwriteReplacesBothFiles) {
  const ScratchFolder scratch;
  scratch.file("out.vdb", "old");
  scratch.file("out.pmap", "old");
  const ToolRun run = runTool({"map", mesh_, "-o", scratch / "out.vdb", "--dim", "16", "--overwrite"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(readFile(scratch / "out.vdb").substr(0, 4), " BDV");
  EXPECT_EQ(readFile(scratch / "out.pmap").substr(0, 8), "POLESTAR");
}

TEST(Map, InterruptedEndsWith130AndLeavesNothing) {
  const ScratchFolder scratch;
  const std::string mesh = scratch.obj("ball.obj", icosphere(4));
  const ToolRun run =
      runTool({"map", mesh, "-o", scratch / "out.vdb", "--dim", "256", "-j", "1", "--json"},
              {.interruptAfter = std::chrono::milliseconds(500), .limit = std::chrono::seconds(60)});
  EXPECT_FALSE(run.hung);
  EXPECT_EQ(run.exitCode, 130) << run.err;
  EXPECT_EQ(run.json()["error"]["code"], "cancelled");
  EXPECT_EQ(run.err, "polestar map: cancelled; nothing was written\n");
  EXPECT_THAT(scratch.names(), ElementsAre("ball.obj"));
}

TEST(Map, FailedCertificatesEndWith6AndFilesStayOnlyWhenAsked) {
  const ScratchFolder scratch;
  // Spikes, between which no charges fit: a coarse Green's function.
  const std::string mesh = scratch.obj("spikes.obj", starPolyhedron(3));
  std::vector<std::string> arguments{"map", mesh, "-o", scratch / "out.vdb", "--dim", "24", "--json"};
  EXPECT_EQ(runTool(arguments).exitCode, 0) << "the layer's is fine enough";
  arguments.insert(arguments.end(), {"--solver", "mfs"});
  for (const char* name : {"out.vdb", "out.pmap"}) fs::remove(scratch.path() / name);
  ToolRun run = runTool(arguments);
  ASSERT_EQ(run.exitCode, 6) << run.err;
  EXPECT_EQ(run.json()["certificate"]["verdict"], "failed");
  EXPECT_EQ(run.json()["error"]["code"], "not_converged");
  EXPECT_THAT(run.err, AllOf(HasSubstr("boundary_error: rho |G| on the surface up to "),
                             HasSubstr("try a smaller --tolerance, --solver layer")));
  EXPECT_THAT(scratch.names(), ElementsAre("spikes.obj"));

  arguments.push_back("--keep-failed");
  run = runTool(arguments);
  EXPECT_EQ(run.exitCode, 6);
  EXPECT_THAT(scratch.names(), ElementsAre("out.pmap", "out.vdb", "spikes.obj"));
  EXPECT_THAT(runTool({"info", scratch / "out.vdb"}).out, HasSubstr("polestar:certificate      failed"));
}

}  // namespace
}  // namespace polestar::testing
