// readGridInfo on good files and on every kind of broken one.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "polestar/core/error.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::HasSubstr;
using ::testing::Pair;

std::string writtenBytes(const test::ScratchFolder& folder) {
  SolidGrids grids(icosphere(3), {.voxelSize = 0.125});
  grids.addVector("rest", ValueRole::invariant, [](const VoxelBatch& batch, std::span<Vec3f> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = batch.points[i].cast<float>();
  });
  grids.setMetadata("polestar:domain", std::string("ball"));
  grids.write(folder / "good.vdb");
  return test::bytesOf(folder / "good.vdb");
}

std::string refusal(const std::filesystem::path& path) {
  try {
    readGridInfo(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    return error.what();
  }
  return "";
}

TEST(GridInfo, TellsWhatAFileHolds) {
  const test::ScratchFolder folder;
  writtenBytes(folder);
  const std::vector<GridInfo> infos = readGridInfo(folder / "good.vdb");
  ASSERT_EQ(infos.size(), 3u);
  EXPECT_EQ(infos[0].name, "surface");
  EXPECT_EQ(infos[0].valueType, "float");
  EXPECT_EQ(infos[0].gridClass, "level set");
  EXPECT_EQ(infos[1].name, "density");
  EXPECT_EQ(infos[1].gridClass, "fog volume");
  const GridInfo& rest = infos[2];
  EXPECT_EQ(rest.name, "rest");
  EXPECT_EQ(rest.valueType, "vec3s");
  EXPECT_DOUBLE_EQ(rest.voxelSize, 0.125);
  EXPECT_GT(rest.activeVoxels, 2000u);
  EXPECT_GT(rest.memoryBytes, rest.activeVoxels * 12);
  // The ball fills 0 .. 15 on each axis (16 voxels), the padding reaches less than 3 further.
  EXPECT_EQ(rest.indexMin, (std::array<int, 3>{-3, -3, -3}));
  EXPECT_EQ(rest.indexMax, (std::array<int, 3>{18, 18, 18}));
  for (const GridInfo& info : infos) {
    EXPECT_THAT(info.metadata, ::testing::Contains(Pair("polestar:domain", "ball"))) << info.name;
  }
  const std::vector<GridHeader> headers = readGridHeaders(folder / "good.vdb");
  ASSERT_EQ(headers.size(), infos.size());
  for (const GridHeader& header : headers) {
    const auto same = [&](const GridInfo& info) {
      return info.name == header.name && info.metadata == header.metadata;
    };
    EXPECT_TRUE(std::any_of(infos.begin(), infos.end(), same)) << header.name;
  }
}

TEST(GridInfo, RefusesEveryTruncation) {
  const test::ScratchFolder folder;
  const std::string bytes = writtenBytes(folder);
  std::vector<std::size_t> lengths;
  for (std::size_t n = 0; n < 200; ++n) lengths.push_back(n);
  for (std::size_t k = 0; k < 60; ++k) lengths.push_back(200 + k * (bytes.size() - 200) / 60);
  for (std::size_t k = 1; k < 40; ++k) lengths.push_back(bytes.size() - k);
  for (const std::size_t length : lengths) {
    test::writeBytes(folder / "cut.vdb", bytes.substr(0, length));
    EXPECT_NE(refusal(folder / "cut.vdb"), "") << length << " of " << bytes.size();
    EXPECT_THROW(readGridHeaders(folder / "cut.vdb"), Error) << length << " of " << bytes.size();
  }
  test::writeBytes(folder / "cut.vdb", bytes.substr(0, bytes.size() / 2));
  EXPECT_THAT(refusal(folder / "cut.vdb"), HasSubstr("truncated"));
}

TEST(GridInfo, RefusesWhatIsNoVdb) {
  const test::ScratchFolder folder;
  EXPECT_THAT(refusal(folder / "missing.vdb"), HasSubstr("No such file"));
  EXPECT_THAT(refusal(folder.path()), HasSubstr("not a regular file"));
  test::writeBytes(folder / "text.vdb", "solid cube\n facet normal 0 0 1\n" + std::string(1000, 'x'));
  EXPECT_NE(refusal(folder / "text.vdb"), "");
  test::writeBytes(folder / "zeros.vdb", std::string(5000, '\0'));
  EXPECT_NE(refusal(folder / "zeros.vdb"), "");
}

// Damage inside the header and the descriptors: an answer or an Error, never a crash or a hang.
TEST(GridInfo, SurvivesDamagedBytes) {
  const test::ScratchFolder folder;
  const std::string bytes = writtenBytes(folder);
  for (std::size_t at = 0; at < std::min<std::size_t>(bytes.size(), 900); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0xFF);
    test::writeBytes(folder / "damaged.vdb", damaged);
    refusal(folder / "damaged.vdb");
  }
}

}  // namespace
}  // namespace polestar
