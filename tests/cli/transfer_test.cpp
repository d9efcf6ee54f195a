// polestar transfer: textures by name, from grids and from slices; and what is refused, with nothing left
// behind.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "polestar/io/picture.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "run_tool.h"

namespace polestar::testing {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> gridNames(const std::filesystem::path& vdb) {
  std::vector<std::string> names;
  for (const GridInfo& grid : readGridInfo(vdb)) names.push_back(grid.name);
  return names;
}

Vec3f colorAt(const std::filesystem::path& vdb, const Vec3& point, const std::string& name = "Cd") {
  const SampledGrids grids(vdb);
  Vec3f value = Vec3f::Constant(-1);
  float weight = 0;
  if (const SampledGrid* grid = grids.find(name, true))
    grid->sample({&point, 1}, {}, {&value, 1}, {&weight, 1});
  return value;
}

/// Two maps for the whole suite.
class TransferTool : public ::testing::Test {
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
  static std::string map(const std::string& name) { return *maps_ / name; }

  /// A ball whose color is red where x > 0 and green elsewhere, without a map.
  std::string twoColors() const {
    SolidGrids grids(icosphere(3), {.voxelSize = 0.08});
    grids.addVector("Cd", ValueRole::invariant, [](const VoxelBatch& batch, std::span<Vec3f> values) {
      for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = batch.points[i].x() > 0 ? Vec3f(1, 0, 0) : Vec3f(0, 1, 0);
    });
    grids.write(folder_ / "two.vdb");
    return folder_ / "two.vdb";
  }
  /// A refusal leaves nothing behind.
  void expectRefused(std::vector<std::string> arguments, int code,
                     const ::testing::Matcher<std::string>& message) {
    const std::vector<std::string> before = folder_.names();
    arguments.insert(arguments.begin(), "transfer");
    arguments.insert(arguments.end(), {"-o", folder_ / "refused.vdb"});
    const ToolRun run = runTool(arguments);
    EXPECT_EQ(run.exitCode, code) << run.err;
    EXPECT_THAT(run.err, message);
    EXPECT_EQ(folder_.names(), before);
  }

  ScratchFolder folder_;

 private:
  static inline std::unique_ptr<ScratchFolder> maps_;
  static inline ToolRun made_, madeBall_;
};

TEST_F(TransferTool, FillsASolidWithATextureByName) {
  const ToolRun run = runTool({"transfer", "kiwi", map("star.pmap"), "-o", folder_ / "kiwi.vdb", "--dim",
                               "32", "--dcc", "both", "--half", "--rest", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(gridNames(folder_ / "kiwi.vdb"),
              ElementsAre("surface", "density", "Cd", "color", "fiber", "rest"));
  const nlohmann::json json = run.json();
  EXPECT_GT(json["voxels"], 5000);
  EXPECT_EQ(json["unanswered"], 0);
  for (const GridInfo& grid : readGridInfo(folder_ / "kiwi.vdb")) {
    EXPECT_THAT(grid.metadata, Contains(std::pair<std::string, std::string>("polestar:texture", "kiwi")));
  }
  EXPECT_EQ(json["rest"], "computed");
  // The target's .vdb says how fine; its grids and the new ones lie on one lattice.
  const ToolRun own =
      runTool({"transfer", "soccer", map("star.vdb"), "-o", folder_ / "soccer.vdb", "--json"});
  ASSERT_EQ(own.exitCode, 0) << own.err;
  EXPECT_EQ(own.json()["rest"], "read");
  EXPECT_THAT(gridNames(folder_ / "soccer.vdb"), ElementsAre("surface", "density", "Cd"));
  EXPECT_EQ(readGridInfo(folder_ / "soccer.vdb")[0].voxelSize, readGridInfo(map("star.vdb"))[0].voxelSize);
  const ToolRun other =
      runTool({"transfer", "soccer", map("star.vdb"), "-o", folder_ / "other.vdb", "--dim", "24", "--json"});
  EXPECT_EQ(other.json()["rest"], "computed") << "a size was asked for";
  for (const Vec3& point : {Vec3(0.4, 0, 0), Vec3(-0.1, 0.3, 0.2)}) {
    EXPECT_LT((colorAt(folder_ / "soccer.vdb", point) - colorAt(folder_ / "other.vdb", point)).norm(), 0.05);
  }
}

TEST_F(TransferTool, DrawsFibers) {
  for (const char* strength : {"0", "0.8"}) {
    const ToolRun run =
        runTool({"transfer", "tree-rings", map("star.pmap"), "-o", folder_ / (std::string(strength) + ".vdb"),
                 "--dim", "24", "--fibers", strength});
    ASSERT_EQ(run.exitCode, 0) << run.err;
  }
  double difference = 0;
  for (int i = 0; i < 20; ++i) {
    const Vec3 point(0.02 * i - 0.2, 0.1, 0.015 * i);
    difference += (colorAt(folder_ / "0.vdb", point) - colorAt(folder_ / "0.8.vdb", point)).norm();
  }
  EXPECT_GT(difference, 0.05);
  expectRefused({"marble", map("star.pmap"), "--fibers", "0.5"}, 2, HasSubstr("no grain"));
}

TEST_F(TransferTool, ListsItsTextures) {
  const ToolRun run = runTool({"transfer", "--list"});
  EXPECT_EQ(run.exitCode, 0);
  for (const char* name :
       {"kiwi", "watermelon", "orange", "tree-rings", "agate", "marble", "granite", "soccer"})
    EXPECT_THAT(run.out, HasSubstr(name));
  EXPECT_GE(runTool({"transfer", "--list", "--json"}).json()["textures"].size(), 8U);
}

TEST_F(TransferTool, CarriesColorsOfABodyWithoutAMap) {
  const std::string two = twoColors();
  const ToolRun run = runTool({"transfer", two, map("star.pmap"), "-o", folder_ / "out.vdb", "--dim", "32"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LT((colorAt(folder_ / "out.vdb", Vec3(0.4, 0, 0)) - Vec3f(1, 0, 0)).norm(), 0.05);
  EXPECT_LT((colorAt(folder_ / "out.vdb", Vec3(-0.4, 0, 0)) - Vec3f(0, 1, 0)).norm(), 0.05);
  // A quarter turn about z brings what is along +x to +y.
  ASSERT_EQ(runTool({"transfer", two, map("ball.pmap"), "-o", folder_ / "turned.vdb", "--source",
                     map("ball.pmap"), "--rotate", "0,0,90"})
                .exitCode,
            0);
  EXPECT_LT((colorAt(folder_ / "turned.vdb", Vec3(0, 0.5, 0)) - Vec3f(1, 0, 0)).norm(), 0.05);
  EXPECT_LT((colorAt(folder_ / "turned.vdb", Vec3(0, -0.5, 0)) - Vec3f(0, 1, 0)).norm(), 0.05);
  // The same by landmarks: what is at +x goes to +y, what is at +z stays.
  std::ofstream(folder_ / "pairs.csv") << "# source, target\n1,0,0, 0,1,0\n0,0,1, 0,0,1\n";
  const ToolRun marked = runTool({"transfer", two, map("ball.pmap"), "-o", folder_ / "marked.vdb", "--source",
                                  map("ball.pmap"), "--landmarks", folder_ / "pairs.csv", "--json"});
  ASSERT_EQ(marked.exitCode, 0) << marked.err;
  EXPECT_LT(marked.json()["landmarks"]["worst_degrees"], 1);
  EXPECT_LT((colorAt(folder_ / "marked.vdb", Vec3(0, 0.5, 0)) - Vec3f(1, 0, 0)).norm(), 0.05);
}

TEST_F(TransferTool, MeetsLandmarksAndAligns) {
  const std::string two = twoColors();
  // What is at +x goes to +y, bent: no Moebius motion meets five such places.
  std::ofstream(folder_ / "pairs.csv") << "1,0,0, 0,1,0\n0,1,0, -1,0,0\n0,0,1, 0,0,1\n0,0,-1, 0.3,0,-0.95\n"
                                          "-0.7,-0.7,0, 0.5,-0.8,0.2\n";
  const ToolRun run = runTool({"transfer", two, map("ball.pmap"), "-o", folder_ / "out.vdb", "--source",
                               map("ball.pmap"), "--landmarks", folder_ / "pairs.csv", "--json"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_EQ(run.json()["landmarks"]["refined"], true);
  EXPECT_LT(run.json()["landmarks"]["worst_degrees"], 0.1);
  EXPECT_EQ(run.json()["unanswered"], 0);
  EXPECT_LT((colorAt(folder_ / "out.vdb", Vec3(0, 0.7, 0)) - Vec3f(1, 0, 0)).norm(), 0.05);
  EXPECT_LT((colorAt(folder_ / "out.vdb", Vec3(0.4, -0.6, 0.15)) - Vec3f(0, 1, 0)).norm(), 0.05);
  const ToolRun aligned = runTool({"transfer", two, map("star.pmap"), "-o", folder_ / "aligned.vdb",
                                   "--source", map("ball.pmap"), "--align", "--dim", "24", "--json"});
  ASSERT_EQ(aligned.exitCode, 0) << aligned.err;
  EXPECT_EQ(aligned.json()["alignment"]["ambiguous"], true);
  EXPECT_THAT(aligned.err, HasSubstr("round"));
  expectRefused({"kiwi", map("star.pmap"), "--align"}, 2, HasSubstr("two solids"));
}

TEST_F(TransferTool, ReadsSlices) {
  // Red above (high y), blue below, in a block that holds the ball.
  for (int z = 0; z < 12; ++z) {
    Picture picture(12, 12);
    for (int y = 0; y < 12; ++y) {
      for (int x = 0; x < 12; ++x) {
        float* pixel = picture.pixel(x, y);
        pixel[y < 6 ? 0 : 2] = 0.5f;
        pixel[3] = 1;
      }
    }
    writePicture(folder_ / ("slice." + std::string(z < 10 ? "0" : "") + std::to_string(z) + ".png"), picture);
  }
  const std::string slices = folder_ / "slice.##.png";
  const ToolRun run =
      runTool({"transfer", slices, map("star.pmap"), "-o", folder_ / "out.vdb", "--dim", "24", "--source",
               map("ball.pmap"), "--slice-voxel", "0.2,0.2,0.2", "--slice-origin", "-1.2,-1.2,-1.2"});
  ASSERT_EQ(run.exitCode, 0) << run.err;
  EXPECT_LT((colorAt(folder_ / "out.vdb", Vec3(0, 0.45, 0)) - Vec3f(0.5f, 0, 0)).norm(), 0.05);
  EXPECT_LT((colorAt(folder_ / "out.vdb", Vec3(0, -0.45, 0)) - Vec3f(0, 0, 0.5f)).norm(), 0.05);
  expectRefused({slices, map("star.pmap")}, 2, AllOf(HasSubstr("alpha"), HasSubstr("--source")));
  std::filesystem::remove(folder_ / "slice.05.png");
  expectRefused({slices, map("star.pmap"), "--source", map("ball.pmap")}, 3,
                AllOf(HasSubstr("missing"), HasSubstr("5")));
}

TEST_F(TransferTool, RefusesWithReasons) {
  const std::string two = twoColors();
  const std::string mesh = folder_.obj("mesh.obj", icosphere(2));
  expectRefused({"kiwi", mesh}, 2, AllOf(HasSubstr("no map"), HasSubstr("polestar map")));
  expectRefused({"kiwi", folder_ / "none.pmap"}, 3, HasSubstr("none.pmap"));
  expectRefused({"kiwy", map("star.pmap")}, 2, HasSubstr("kiwi"));
  expectRefused({"kiwi", map("star.pmap"), "--set", "wings=2"}, 2, HasSubstr("wings"));
  expectRefused({"kiwi", map("star.pmap"), "--set", "seeds"}, 2, HasSubstr("name=number"));
  expectRefused({"kiwi", map("star.pmap"), "--source", map("ball.pmap")}, 2, HasSubstr("--source"));
  expectRefused({two, map("star.pmap"), "--grids", "heat"}, 2, AllOf(HasSubstr("heat"), HasSubstr("Cd")));
  expectRefused({map("star.vdb"), map("ball.pmap")}, 3, HasSubstr("no grid to carry"));
  expectRefused({folder_ / "missing.vdb", map("star.pmap")}, 3, HasSubstr("missing.vdb"));
  std::ofstream(folder_ / "bad.csv") << "1,0,0,0,1\n";
  expectRefused({two, map("star.pmap"), "--landmarks", folder_ / "bad.csv"}, 3,
                AllOf(HasSubstr("bad.csv:1"), HasSubstr("six numbers")));
  std::ofstream(folder_ / "off.csv") << "1,0,0, 30,1,0\n";
  expectRefused({two, map("star.pmap"), "--landmarks", folder_ / "off.csv"}, 2,
                AllOf(HasSubstr("landmark 1"), HasSubstr("target")));
  std::ofstream(folder_ / "contrary.csv") << "1,0,0, 0,1,0\n1,0.001,0, 0,-1,0\n";
  expectRefused({two, map("ball.pmap"), "--landmarks", folder_ / "contrary.csv"}, 2, HasSubstr("contradict"));
  SolidGrids cube(icosphere(3), {.voxelSize = 0.1});
  cube.addVector("Cd", ValueRole::invariant, [](const VoxelBatch&, std::span<Vec3f>) {});
  cube.setMetadata("polestar:domain", std::string("cube"));
  cube.write(folder_ / "cube.vdb");
  expectRefused({folder_ / "cube.vdb", map("star.pmap")}, 2,
                AllOf(HasSubstr("cube"), HasSubstr("same domain")));
  // A surface that is not star-shaped has no map: the code says so.
  const TriMesh banana = transformed(icosphere(4), [](const Vec3& v) -> Vec3 {
    const double angle = 1.4 * v.x();
    return {(3 + 0.4 * v.y()) * std::sin(angle), (3 + 0.4 * v.y()) * std::cos(angle), 0.4 * v.z()};
  });
  SolidGrids bent(banana, {.voxelSize = 0.08});
  bent.addVector("Cd", ValueRole::invariant, [](const VoxelBatch&, std::span<Vec3f>) {});
  bent.write(folder_ / "bent.vdb");
  expectRefused({folder_ / "bent.vdb", map("star.pmap")}, 5, HasSubstr("own body"));
}

TEST_F(TransferTool, SaysSizesFirst) {
  const ToolRun run =
      runTool({"transfer", "kiwi", map("star.pmap"), "-o", folder_ / "out.vdb", "--dim", "200", "--dry-run"});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  EXPECT_THAT(run.out, AllOf(HasSubstr("voxels"), HasSubstr("at most"), HasSubstr("star.pmap")));
  EXPECT_THAT(folder_.names(), IsEmpty());
}

}  // namespace
}  // namespace polestar::testing
