#include "integration/kiwi_solid.h"

#include <gtest/gtest.h>

#include <array>

namespace polestar::test {
namespace {

// Pixels this near to another surface are not compared: the filters of the renderers blend them differently.
constexpr int kRim = 2;

void tool(const std::vector<std::string>& arguments) {
  const testing::ToolRun run = testing::runTool(arguments);
  ASSERT_EQ(run.exitCode, 0) << run.err;
}

}  // namespace

KiwiSolid::KiwiSolid(const std::filesystem::path& mesh) {
  tool({"map", mesh.string(), "-o", folder_ / "body.vdb", "--dim", "48", "--tolerance", "5e-3"});
}

std::string KiwiSolid::fill(const std::string& name, const std::vector<std::string>& options) {
  const std::string vdb = folder_ / (name + ".vdb");
  std::vector<std::string> arguments{"transfer", "kiwi", folder_ / "body.vdb", "-o", vdb, "--json"};
  arguments.insert(arguments.end(), options.begin(), options.end());
  const testing::ToolRun run = testing::runTool(arguments);
  EXPECT_EQ(run.exitCode, 0) << run.err;
  voxelSize_ = run.json()["voxel_size"].get<double>();
  return vdb;
}

Exr KiwiSolid::cut(const std::string& vdb, const Vec3& normal) const {
  std::array<std::string, 2> directions;
  for (int k = 0; k < 3; ++k) {
    directions[0] += (k ? "," : "") + std::to_string(normal[k]);
    directions[1] += (k ? "," : "") + std::to_string(-normal[k]);
  }
  const std::string exr = folder_ / "ours.exr";
  tool({"render", vdb, "-o", exr, "--overwrite", "--flat", "--cut", directions[0], "--view", directions[1],
        "--up", "0,1,0", "--fov", "2", "--size", "240x200", "--samples", "32"});
  return readExr(exr);
}

BlenderJob KiwiSolid::job(const std::string& vdb, const std::map<std::string, std::string>& grids) const {
  BlenderJob job;
  job.folder = folder_.path();
  job.vdb = vdb;
  job.voxelSize = voxelSize_;
  job.grids = grids;
  return job;
}

bool isDeep(const Exr& ours, int x, int y, int rim) {
  if (x < rim || y < rim || x >= ours.width - rim || y >= ours.height - rim) return false;
  for (int dy = -rim; dy <= rim; ++dy) {
    for (int dx = -rim; dx <= rim; ++dx) {
      if (ours.id[ours.at(x + dx, y + dy)] != kFirstCut) return false;
    }
  }
  return true;
}

PixelColor colors(Exr picture) {
  return [p = std::move(picture)](int x, int y) { return p.color[p.at(x, y)].cast<double>(); };
}

PixelColor straightColors(Exr picture) {
  return [p = std::move(picture)](int x, int y) -> std::optional<Vec3> {
    const std::size_t pixel = p.at(x, y);
    if (!(p.alpha[pixel] > 0)) return std::nullopt;
    return p.color[pixel].cast<double>() / static_cast<double>(p.alpha[pixel]);
  };
}

Difference differenceOf(const PixelColor& found, const Exr& ours) {
  const auto expected = [&](int x, int y) -> std::optional<Vec3> {
    if (!isDeep(ours, x, y, kRim)) return std::nullopt;
    return ours.color[ours.at(x, y)].cast<double>();
  };
  return difference(ours.width, ours.height, found, expected);
}

void expectSame(const PixelColor& found, const Exr& ours) {
  const Difference difference = differenceOf(found, ours);
  EXPECT_GT(difference.pixels, 5000U);
  EXPECT_LT(difference.mean, kSame);
  EXPECT_LT(difference.worst, kSameWorst);
}

}  // namespace polestar::test
