// The .vdb opens in Blender, headless, and `rest` is seen where it belongs.

#include <gtest/gtest.h>

#include <array>
#include <sstream>

#include "cli/run_tool.h"
#include "integration/blender.h"
#include "integration/difference.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

const Vec3 kCenter(0.3, -0.2, 0.1);
const Vec3 kAxes(1.0, 0.7, 0.5);
constexpr int kPixels = 160;
constexpr double kDeepest = 0.85;  // of the ball coordinates that are compared: away from the skin
const std::map<std::string, std::string> kGrids{
    {"surface", "FLOAT"}, {"density", "FLOAT"}, {"rest", "VECTOR_FLOAT"}};

// In ball coordinates, whose range is 2. Found are means of 0.0007 to 0.0009, of half floats in Cycles and
// the slab's few samples; half a voxel of shift makes 0.0076 and more.
constexpr double kMean = 0.002, kWorst = 0.01;
constexpr double kOther = 3 * kMean;

TriMesh ellipsoid(int levels) {
  return transformed(icosphere(levels),
                     [](const Vec3& v) -> Vec3 { return kCenter + v.cwiseProduct(kAxes); });
}

// Ball coordinates of an ellipsoid, by the affine map: known everywhere, and different on every axis.
Vec3 restAt(const Vec3& p) { return (p - kCenter).cwiseQuotient(kAxes); }

test::BlenderCut restCut(const std::string& name, int axis, double value) {
  Vec3 through = kCenter;
  through[axis] = value;
  test::BlenderCut cut;
  cut.out = name;
  cut.attribute = "rest";
  cut.view = test::CutView::ofAxis(axis, through, 2.2, kPixels);
  cut.scale = cut.offset = 0.5;
  return cut;
}

/// Ball coordinates of points.
using Rest = std::function<std::vector<Vec3>(const std::vector<Vec3>&)>;

Rest eachBy(const std::function<Vec3(const Vec3&)>& rest) {
  return [rest](const std::vector<Vec3>& points) {
    std::vector<Vec3> balls;
    for (const Vec3& p : points) balls.push_back(rest(p));
    return balls;
  };
}

/// Over every `step`-th pixel in x and y.
test::Difference restDifference(const test::BlenderJob& job, const test::BlenderCut& cut, int step,
                                const Rest& rest) {
  const test::Exr picture = test::readExr(job.folder / cut.out);
  std::vector<Vec3> points;
  std::vector<std::optional<std::size_t>> pointOf(picture.color.size());
  for (int y = 0; y < picture.height; y += step) {
    for (int x = 0; x < picture.width; x += step) {
      const Vec3 point = cut.view.pointAt(x, y);
      if (restAt(point).norm() > kDeepest) continue;
      pointOf[picture.at(x, y)] = points.size();
      points.push_back(point);
    }
  }
  const std::vector<Vec3> balls = rest(points);
  const auto shown = [&](int x, int y) -> std::optional<Vec3> {
    return 2 * picture.color[picture.at(x, y)].cast<double>() - Vec3::Ones();
  };
  const auto expected = [&](int x, int y) -> std::optional<Vec3> {
    const std::optional<std::size_t> point = pointOf[picture.at(x, y)];
    return point ? std::optional(balls.at(*point)) : std::nullopt;
  };
  return test::difference(picture.width, picture.height, shown, expected);
}

void expectSame(const test::Difference& difference, std::size_t pixels) {
  EXPECT_GE(difference.pixels, pixels);
  EXPECT_LT(difference.mean, kMean);
  EXPECT_LT(difference.worst, kWorst);
}

TEST(Blender, ShowsRestWhereItBelongs) {
  POLESTAR_REQUIRE_BLENDER();
  const test::ScratchFolder folder;
  const TriMesh mesh = ellipsoid(4);
  test::BlenderJob job{folder.path(), folder / "body.vdb", voxelSizeFor(mesh, 48), kGrids, {}};
  SolidGrids grids(mesh, {.voxelSize = job.voxelSize});
  grids.addVector("rest", ValueRole::invariant, [&](const VoxelBatch& batch, std::span<Vec3f> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = restAt(batch.points[i]).cast<float>();
  });
  grids.write(job.vdb);

  // Both off the center.
  job.cuts = {restCut("z.exr", 2, kCenter.z() + 0.25 * kAxes.z()),
              restCut("x.exr", 0, kCenter.x() - 0.35 * kAxes.x())};
  const test::BlenderOutcome outcome = test::runBlender(job);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.log;
  for (const test::BlenderCut& cut : job.cuts) {
    SCOPED_TRACE(cut.out);
    expectSame(restDifference(job, cut, 1, eachBy(restAt)), 2000);

    // The check can fail: by a wrong axis, and by half a voxel.
    const auto swapped = [](const Vec3& p) -> Vec3 { return restAt(p)({1, 0, 2}); };
    EXPECT_GT(restDifference(job, cut, 1, eachBy(swapped)).mean, kOther);
    for (int axis = 0; axis < 3; ++axis) {
      const auto shifted = [&](const Vec3& p) -> Vec3 {
        return restAt(p + 0.5 * job.voxelSize * Vec3::Unit(axis));
      };
      EXPECT_GT(restDifference(job, cut, 1, eachBy(shifted)).mean, kOther);
    }
  }
}

TEST(Blender, FindsAFileThatLacksAGrid) {
  POLESTAR_REQUIRE_BLENDER();
  const test::ScratchFolder folder;
  const TriMesh mesh = ellipsoid(2);
  const test::BlenderJob job{
      folder.path(), folder / "body.vdb", voxelSizeFor(mesh, 16), kGrids, {restCut("z.exr", 2, kCenter.z())}};
  SolidGrids(mesh, {.voxelSize = job.voxelSize}).write(job.vdb);
  EXPECT_EQ(test::runBlender(job).exitCode, 3);
}

// The same for a map that the tool made, against what `polestar eval` says of the pixels' points.
TEST(Blender, ShowsAMapMadeByTheTool) {
  POLESTAR_REQUIRE_BLENDER();
  const testing::ScratchFolder folder;
  const std::string map = folder / "body.vdb";
  const testing::ToolRun mapped =
      testing::runTool({"map", folder.obj("body.obj", ellipsoid(3)), "-o", map, "--dim", "48", "--json"});
  ASSERT_EQ(mapped.exitCode, 0) << mapped.err;

  test::BlenderJob job{folder.path(), map, voxelSizeFor(ellipsoid(3), 48), kGrids, {}};
  job.cuts = {restCut("z.exr", 2, kCenter.z() + 0.2)};
  const test::BlenderOutcome outcome = test::runBlender(job);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.log;

  const Rest evaluated = [&](const std::vector<Vec3>& points) {
    std::ostringstream text;
    text.precision(17);
    for (const Vec3& p : points) text << p.transpose() << '\n';
    const testing::ToolRun run =
        testing::runTool({"eval", map, "--points", "-", "--json"}, {.input = text.str()});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    std::vector<Vec3> balls;
    for (const auto& b : run.json()["ball"].get<std::vector<std::array<double, 3>>>())
      balls.emplace_back(b[0], b[1], b[2]);
    return balls;
  };
  expectSame(restDifference(job, job.cuts[0], 4, evaluated), 200);
}

}  // namespace
}  // namespace polestar
