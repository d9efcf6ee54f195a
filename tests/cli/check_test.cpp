// polestar check, as scripts and people use it: verdicts, exit codes, messages, JSON.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <regex>

#include "polestar/core/version.h"
#include "polestar/mesh/shapes.h"
#include "run_tool.h"
#include "support/meshes.h"

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

/// The exit code that the meaning of a manifest line asks for.
int expectedExit(const ManifestEntry& entry) {
  if (entry.star == "yes") return 0;
  if (entry.star == "n/a" || entry.star.starts_with("unreadable")) return 3;
  const bool closedNoSolid = entry.note.find("nonmanifold") != std::string::npos ||
                             entry.genus.value_or(0) != 0 || entry.components != 1;
  if ((entry.star == "no" || entry.star == "borderline") && !closedNoSolid) return 5;
  return 4;
}

/// Words that a message must hold, one of them, to name the defect.
std::string defectPattern(const ManifestEntry& entry, int exitCode) {
  if (exitCode == 5) return "star";
  if (entry.star == "n/a") return "NaN|nan|finite";
  if (exitCode == 3) return "vertices run from 0 to 385";
  if (entry.genus.value_or(0) > 0) return "genus|handle";
  if (entry.star == "open") return "open|hole|boundary|shared by|edge|manifold|component";
  if (entry.components > 1) return "component|bodies|parts|pieces";
  return "manifold|edge|vert";
}

class RealMeshes : public ::testing::Test {
 protected:
  void SetUp() override {
    POLESTAR_REQUIRE_MESHES();
    entries_ = manifest();
    ASSERT_GT(entries_.size(), 50U);
  }
  std::vector<ManifestEntry> entries_;
};

void expectStar(const nlohmann::json& json, const ManifestEntry& entry) {
  ASSERT_TRUE(entry.marginRelative.has_value());
  EXPECT_NEAR(json["margin_relative"].get<double>(), *entry.marginRelative, 1e-4);
  EXPECT_GT(json["center_margin"].get<double>(), 0);
  EXPECT_LE(json["center_margin"].get<double>(), json["margin"].get<double>() * (1 + 1e-9));
  EXPECT_EQ(json["euler"], 2);
  EXPECT_EQ(json["components"], 1);
  EXPECT_THAT(json["witness_faces"], IsEmpty());
  EXPECT_EQ(json["bad_area_fraction"], 0);
  EXPECT_GT(json["rays"]["count"].get<int>(), 0);
}

/// The message names the file, the defect and, by some number, its place.
void expectMessage(const std::string& text, const ManifestEntry& entry, int exitCode) {
  const std::string name = entry.path.filename().string();
  EXPECT_THAT(text, StartsWith("polestar check: "));
  ASSERT_THAT(text, HasSubstr(name));
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 2) << text;
  const std::string message = text.substr(text.find(name) + name.size());
  EXPECT_TRUE(std::regex_search(message, std::regex(defectPattern(entry, exitCode)))) << text;
  EXPECT_TRUE(std::regex_search(message, std::regex("[0-9]"))) << "no place is named: " << text;
}

TEST_F(RealMeshes, VerdictsAgreeWithTheManifestAndMessagesNameDefects) {
  for (const ManifestEntry& entry : entries_) {
    SCOPED_TRACE(entry.path.filename().string());
    const ToolRun run = runTool({"check", entry.path.string(), "--json"});
    ASSERT_FALSE(run.hung);
    const int expected = expectedExit(entry);
    ASSERT_EQ(run.exitCode, expected) << run.err;
    const auto json = run.json();
    EXPECT_EQ(json["schema"], "polestar/1");
    EXPECT_EQ(json["valid"], expected == 0 || expected == 5);
    EXPECT_EQ(json["star"], expected == 0);
    EXPECT_EQ(json.contains("error"), expected != 0);
    if (expected == 0) {
      expectStar(json, entry);
    } else {
      expectMessage(run.err, entry, expected);
    }
  }
}

TEST_F(RealMeshes, MapRefusesWhatCheckRefusesAndLeavesNothing) {
  const ScratchFolder scratch;
  for (const ManifestEntry& entry : entries_) {
    const int expected = expectedExit(entry);
    if (expected == 0) continue;
    SCOPED_TRACE(entry.path.filename().string());
    const ToolRun run =
        runTool({"map", entry.path.string(), "-o", scratch / "out.vdb", "--dim", "16", "--json"});
    EXPECT_EQ(run.exitCode, expected) << run.err;
    EXPECT_EQ(run.json()["star"], false);
    EXPECT_THAT(scratch.names(), IsEmpty());
  }
}

class Check : public ::testing::Test {
 protected:
  ScratchFolder scratch_;
  std::string ball_ = scratch_.obj("ball.obj", icosphere(2));
};

TEST_F(Check, JsonHasTheMembersOfTheSchemaInTheirOrder) {
  const ToolRun run = runTool({"check", ball_, "--json", "-j", "2"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.err, "");
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1);
  const auto json = nlohmann::ordered_json::parse(run.out);
  std::vector<std::string> names;
  for (const auto& [name, value] : json.items()) names.push_back(name);
  EXPECT_THAT(names, ElementsAre("schema", "version", "command", "inputs", "threads", "units", "valid",
                                 "star", "center", "center_margin", "margin", "margin_relative", "vertices",
                                 "triangles", "euler", "components", "witness_faces", "bad_area_fraction",
                                 "rays", "repair", "timings"));
  EXPECT_EQ(json["version"], kVersion);
  EXPECT_EQ(json["command"], "check");
  EXPECT_EQ(json["inputs"], nlohmann::ordered_json::array({ball_}));
  EXPECT_EQ(json["threads"], 2);
  EXPECT_EQ(json["units"], "mesh");
  EXPECT_EQ(json["vertices"], 162);
  EXPECT_EQ(json["triangles"], 320);
}

TEST_F(Check, TheBallsMarginIsTheDistanceToItsNearestFace) {
  const TriMesh mesh = icosphere(2);
  double inradius = 1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 area = areaVector(mesh, t);
    inradius = std::min(inradius, area.normalized().dot(mesh.corner(t, 0)));
  }
  const auto json = runTool({"check", ball_, "--json"}).json();
  EXPECT_NEAR(json["margin"].get<double>(), inradius, 1e-9);
  EXPECT_NEAR(json["margin_relative"].get<double>(), inradius / boundingBox(mesh).diagonal(), 1e-9);
}

TEST_F(Check, PeopleGetAFewLines) {
  const ToolRun run = runTool({"check", ball_});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.err, "");
  EXPECT_THAT(run.out,
              AllOf(StartsWith("ball.obj is star-shaped\n"), HasSubstr("162 vertices, 320 triangles")));
  EXPECT_LE(std::count(run.out.begin(), run.out.end(), '\n'), 8);
}

TEST_F(Check, TheAnswerIsTheSameForAnyNumberOfThreads) {
  auto one = runTool({"check", ball_, "--json", "-j", "1"}).json();
  auto four = runTool({"check", ball_, "--json", "-j", "4"}).json();
  for (auto* json : {&one, &four}) {
    json->erase("threads");
    json->erase("timings");
  }
  EXPECT_EQ(one, four);
}

TEST_F(Check, ThreadsComeFromTheFarmWhereNobodySaysOtherwise) {
  const auto threads = [&](const std::string& value, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"check", ball_, "--json"});
    return runTool(more, {.environment = {{"SLURM_CPUS_PER_TASK", value}}}).json()["threads"].get<int>();
  };
  const int own = runTool({"check", ball_, "--json"}).json()["threads"];
  EXPECT_EQ(threads("3"), 3);
  EXPECT_EQ(threads("3", {"-j", "2"}), 2);
  EXPECT_EQ(threads("many"), own);
  EXPECT_EQ(threads("-2"), own);
}

TEST_F(Check, AGivenCenterIsVerified) {
  ToolRun run = runTool({"check", ball_, "--json", "--center", "-0.25,0.1,1e-1"});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.json()["center"], nlohmann::json::array({-0.25, 0.1, 0.1}));

  run = runTool({"check", ball_, "--json", "--center", "2,0,0"});
  EXPECT_EQ(run.exitCode, 5);
  EXPECT_EQ(run.json()["star"], false);
  EXPECT_EQ(run.json()["error"]["code"], "not_star_shaped");
}

TEST_F(Check, AnswersCanGoToAFile) {
  const std::string report = scratch_ / "report.json";
  const ToolRun run = runTool({"check", ball_, "--json", "-o", report});
  EXPECT_EQ(run.exitCode, 0);
  EXPECT_EQ(run.out, "");
  EXPECT_EQ(nlohmann::json::parse(readFile(report))["star"], true);
  EXPECT_THAT(scratch_.names(), ElementsAre("ball.obj", "report.json"));
  EXPECT_EQ(runTool({"check", ball_, "-o", report}).exitCode, 3);
  EXPECT_EQ(runTool({"check", ball_, "-o", report, "--overwrite"}).exitCode, 0);
  EXPECT_THAT(readFile(report), StartsWith("ball.obj is star-shaped"));
  EXPECT_THAT(runTool({"check", ball_, "-o", "-"}).out, StartsWith("ball.obj is star-shaped"));
}

TEST_F(Check, FullDisksAreNoticed) {
  const ToolRun run = runTool({"check", ball_}, {.output = "/dev/full"});
  EXPECT_EQ(run.exitCode, 3);
  EXPECT_THAT(run.err, HasSubstr("standard output"));
}

TEST_F(Check, NamesMayHoldAnything) {
  for (const std::string& name :
       {std::string("two words.obj"), std::string("it's \"quoted\".obj"),
        std::string("gr\xC3\xB6\xC3\x9F"
                    "e.obj"),
        std::string("latin\xF6.obj"), std::string("-dash.obj"), std::string("$(touch x);.obj")}) {
    SCOPED_TRACE(name);
    fs::copy_file(ball_, scratch_.path() / name);
    const ToolRun run = runTool({"check", "--json", "--", name}, {.folder = scratch_.path()});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.json()["star"], true);
    fs::remove(scratch_.path() / name);
  }
  EXPECT_THAT(scratch_.names(), ElementsAre("ball.obj"));
}

TEST_F(Check, WhatCannotBeReadEndsWith3AndIsNamed) {
  std::vector<std::string> inputs{scratch_ / "missing.obj",
                                  scratch_.path().string(),
                                  scratch_.file("empty.obj", ""),
                                  scratch_.file("words.ply", "these are no polygons"),
                                  scratch_.file("cut.off", "OFF\n8 12 0\n0 0 0\n1 0"),
                                  "/dev/null"};
  if (geteuid() != 0) {
    inputs.push_back(scratch_.obj("secret.obj", icosphere(0)));
    chmod(inputs.back().c_str(), 0);
  }
  for (const std::string& input : inputs) {
    SCOPED_TRACE(input);
    const ToolRun run = runTool({"check", input, "--json"});
    EXPECT_FALSE(run.hung);
    EXPECT_EQ(run.exitCode, 3) << run.err;
    EXPECT_THAT(run.err, AllOf(StartsWith("polestar check: "), HasSubstr(input)));
    const auto json = run.json();
    EXPECT_EQ(json["error"]["code"], "io");
    EXPECT_EQ(run.err, "polestar check: " + json["error"]["message"].get<std::string>() + "\n");
    EXPECT_EQ(json["star"], false);
  }
}

TEST_F(Check, RepairsAreCounted) {
  TriMesh inward = icosphere(1);
  for (Triangle& t : inward.triangles) std::swap(t[0], t[1]);
  inward.triangles.push_back(inward.triangles[0]);
  const auto json = runTool({"check", scratch_.obj("inward.obj", inward), "--json"}).json();
  EXPECT_EQ(json["star"], true);
  EXPECT_EQ(json["repair"]["turned_inside_out"], true);
  EXPECT_EQ(json["repair"]["duplicate_triangles"], 1);
}

}  // namespace
}  // namespace polestar::testing
