// Files appear whole or not at all, and the same bytes every time.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"
#include "vdb/read_vdb.h"

namespace polestar {
namespace {

using test::bytesOf;

SolidGrids someGrids(int dim = 20) {
  const TriMesh mesh = smoothStar(4);
  SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, dim)});
  grids.addVector("rest", ValueRole::invariant, [](const VoxelBatch& batch, std::span<Vec3f> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = batch.points[i].cast<float>();
  });
  grids.addScalar("green", [](const VoxelBatch& batch, std::span<float> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<float>(1 / batch.points[i].norm());
  });
  grids.setMetadata("polestar:domain", std::string("ball"));
  return grids;
}

Errc codeOfWriting(const SolidGrids& grids, const std::filesystem::path& path) {
  try {
    grids.write(path);
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos) << error.what();
    return error.code();
  }
  ADD_FAILURE() << "written";
  return Errc::usage;
}

TEST(Write, GivesTheSameBytesForAnyNumberOfThreads) {
  const test::ScratchFolder folder;
  std::string first;
  for (const int threads : {1, 2, 2}) {
    withThreads(threads, [&] { someGrids(64).write(folder / "a.vdb"); });
    const std::string bytes = bytesOf(folder / "a.vdb");
    if (first.empty()) first = bytes;
    EXPECT_GT(bytes.size(), 100'000u);
    EXPECT_TRUE(bytes == first) << threads << " threads";
  }
  // Another content has another identifier (36 characters behind the versions).
  auto grids = someGrids(64);
  grids.setMetadata("polestar:domain", std::string("cube"));
  grids.write(folder / "b.vdb");
  EXPECT_NE(bytesOf(folder / "b.vdb").substr(21, 36), first.substr(21, 36));
  EXPECT_EQ(first[21 + 14], '8');
}

TEST(Write, ReplacesAFileAndLeavesNothingElse) {
  const test::ScratchFolder folder;
  test::writeBytes(folder / "a.vdb", "old");
  someGrids().write(folder / "a.vdb");
  EXPECT_EQ(test::readVdb(folder / "a.vdb").size(), 4u);
  EXPECT_EQ(folder.entries(), 1u);
}

TEST(Write, LeavesAnExistingFileAloneWhenItFails) {
  const test::ScratchFolder folder;
  const SolidGrids grids = someGrids();
  test::writeBytes(folder / "a.vdb", "old");

  EXPECT_EQ(codeOfWriting(grids, folder / "missing/a.vdb"), Errc::io);
  if (geteuid() != 0) {  // root may write anywhere
    std::filesystem::permissions(folder.path(),
                                 std::filesystem::perms::owner_read | std::filesystem::perms::owner_exec);
    EXPECT_EQ(codeOfWriting(grids, folder / "a.vdb"), Errc::io);
    std::filesystem::permissions(folder.path(), std::filesystem::perms::owner_all);
  }
  std::filesystem::create_directory(folder / "folder.vdb");
  EXPECT_EQ(codeOfWriting(grids, folder / "folder.vdb"), Errc::io) << "a folder has the name";

  EXPECT_EQ(bytesOf(folder / "a.vdb"), "old");
  EXPECT_EQ(folder.entries(), 2u) << "no temporary is left";
}

// A file that cannot grow is what a full disk looks like.
TEST(Write, NoticesAFullDisk) {
  const test::ScratchFolder folder;
  const SolidGrids grids = someGrids();
  test::writeBytes(folder / "a.vdb", "old");
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  for (const rlim_t size : {rlim_t{0}, rlim_t{100}, rlim_t{20'000}}) {
    const rlimit small{size, before.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
    const Errc code = codeOfWriting(grids, folder / "a.vdb");
    setrlimit(RLIMIT_FSIZE, &before);
    EXPECT_EQ(code, Errc::io) << size;
    EXPECT_EQ(bytesOf(folder / "a.vdb"), "old");
    EXPECT_EQ(folder.entries(), 1u);
  }
  std::signal(SIGXFSZ, handler);
}

TEST(Write, SendsTheSameBytesToStandardOutput) {
  const test::ScratchFolder folder;
  const SolidGrids grids = someGrids();
  grids.write(folder / "a.vdb");
  testing::internal::CaptureStdout();
  grids.write("-");
  EXPECT_TRUE(testing::internal::GetCapturedStdout() == bytesOf(folder / "a.vdb"));
}

}  // namespace
}  // namespace polestar
