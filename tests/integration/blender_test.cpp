// The .vdb opens in Blender, headless, and `rest` is seen where it belongs.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "cli/run_tool.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

const Vec3 kCenter(0.3, -0.2, 0.1);
const Vec3 kAxes(1.0, 0.7, 0.5);

TriMesh ellipsoid(int levels) {
  return transformed(icosphere(levels),
                     [](const Vec3& v) -> Vec3 { return kCenter + v.cwiseProduct(kAxes); });
}

// Ball coordinates of an ellipsoid, by the affine map: known everywhere, and different on every axis.
Vec3 restAt(const Vec3& p) { return (p - kCenter).cwiseQuotient(kAxes); }

void writeEllipsoid(const std::filesystem::path& path, const std::function<Vec3(const Vec3&)>& rest) {
  const TriMesh mesh = ellipsoid(4);
  SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, 48)});
  grids.addVector("rest", ValueRole::invariant, [&](const VoxelBatch& batch, std::span<Vec3f> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = rest(batch.points[i]).cast<float>();
  });
  grids.write(path);
}

// A lattice of points well inside the ellipsoid, on a plane across z and one across x, both off the center.
void writeExpected(const std::filesystem::path& path) {
  const std::array<std::pair<int, double>, 2> planes{{{2, 0.25}, {0, -0.35}}};
  nlohmann::json json = {{"planes", nlohmann::json::array()},
                         {"points", nlohmann::json::array()},
                         {"ball", nlohmann::json::array()}};
  for (const auto& [axis, value] : planes) {
    json["planes"].push_back({std::string(1, "xyz"[axis]), kCenter[axis] + value * kAxes[axis]});
    for (int i = -4; i <= 4; ++i) {
      for (int j = -4; j <= 4; ++j) {
        Vec3 ball;
        ball[axis] = value;
        ball[(axis + 1) % 3] = 0.2 * i;
        ball[(axis + 2) % 3] = 0.2 * j;
        if (ball.norm() > 0.85) continue;
        const Vec3 point = kCenter + ball.cwiseProduct(kAxes);
        json["points"].push_back({point.x(), point.y(), point.z()});
        json["ball"].push_back({ball.x(), ball.y(), ball.z()});
      }
    }
  }
  std::ofstream(path) << json;
}

struct Outcome {
  int exitCode;
  std::string log;
};

Outcome runBlender(const test::ScratchFolder& folder, const std::string& vdb) {
  const std::string log = (folder / "blender.log").string();
  const std::string command =
      "blender -b --factory-startup --python-exit-code 3 --python '" POLESTAR_INTEGRATION_FOLDER
      "/blender_rest.py' -- '" +
      (folder / vdb).string() + "' '" + (folder / "expected.json").string() + "' '" + folder.path().string() +
      "' > '" + log + "' 2>&1";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, test::bytesOf(log)};
}

#define POLESTAR_REQUIRE_BLENDER() \
  if (std::system("command -v blender > /dev/null 2>&1") != 0) GTEST_SKIP() << "blender is not installed"

TEST(Blender, ShowsRestWhereItBelongs) {
  POLESTAR_REQUIRE_BLENDER();
  const test::ScratchFolder folder;
  writeExpected(folder / "expected.json");
  writeEllipsoid(folder / "right.vdb", restAt);
  const Outcome right = runBlender(folder, "right.vdb");
  EXPECT_EQ(right.exitCode, 0) << right.log;

  // The check can fail: by a wrong axis, and by half a voxel.
  writeEllipsoid(folder / "swapped.vdb", [](const Vec3& p) {
    const Vec3 rest = restAt(p);
    return Vec3(rest.y(), rest.x(), rest.z());
  });
  EXPECT_EQ(runBlender(folder, "swapped.vdb").exitCode, 3);
  const double halfVoxel = 1.0 / 48;
  writeEllipsoid(folder / "shifted.vdb", [&](const Vec3& p) { return restAt(p + Vec3(halfVoxel, 0, 0)); });
  EXPECT_EQ(runBlender(folder, "shifted.vdb").exitCode, 3);
}

// The same for a map that the tool made, against what `polestar eval` says of the points.
TEST(Blender, ShowsAMapMadeByTheTool) {
  POLESTAR_REQUIRE_BLENDER();
  const test::ScratchFolder folder;
  const TriMesh mesh = ellipsoid(3);
  std::ofstream obj(folder / "body.obj");
  obj.precision(17);
  for (const Vec3& v : mesh.vertices) obj << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const Triangle& t : mesh.triangles)
    obj << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  obj.close();
  const std::string map = (folder / "body.vdb").string();
  const testing::ToolRun mapped =
      testing::runTool({"map", (folder / "body.obj").string(), "-o", map, "--dim", "48"});
  ASSERT_EQ(mapped.exitCode, 0) << mapped.err;

  const double height = kCenter.z() + 0.2;
  std::ostringstream points;
  for (int i = -4; i <= 4; ++i) {
    for (int j = -4; j <= 4; ++j) {
      if (std::hypot(i, j) > 4.5) continue;
      points << kCenter.x() + 0.17 * i << ' ' << kCenter.y() + 0.12 * j << ' ' << height << '\n';
    }
  }
  const testing::ToolRun evaluated =
      testing::runTool({"eval", map, "--points", "-", "--json"}, {.input = points.str()});
  ASSERT_EQ(evaluated.exitCode, 0) << evaluated.err;
  nlohmann::json expected = evaluated.json();
  expected["planes"] = nlohmann::json::array({nlohmann::json::array({"z", height})});
  std::ofstream(folder / "expected.json") << expected;
  const Outcome outcome = runBlender(folder, "body.vdb");
  EXPECT_EQ(outcome.exitCode, 0) << outcome.log;
}

}  // namespace
}  // namespace polestar
