#include "polestar/core/atomic_file.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "polestar/core/error.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(::testing::TempDir()) / (std::string("polestar_atomic_file_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  static void put(const fs::path& path, const std::string& text) { std::ofstream(path) << text; }
  static std::string get(const fs::path& path) {
    std::ifstream in(path);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::ptrdiff_t entries() const { return std::distance(fs::directory_iterator(folder_), {}); }

  fs::path folder_;
};

TEST_F(AtomicFile, WritesTheWholeFile) {
  writeAtomically(folder_ / "a.txt", [](const fs::path& temporary) { put(temporary, "whole"); });
  EXPECT_EQ(get(folder_ / "a.txt"), "whole");
  EXPECT_EQ(entries(), 1);
}

TEST_F(AtomicFile, TheNameAppearsOnlyAtTheEnd) {
  const fs::path path = folder_ / "a.txt";
  writeAtomically(path, [&](const fs::path& temporary) {
    put(temporary, "half");
    EXPECT_FALSE(fs::exists(path));
    EXPECT_EQ(temporary.parent_path(), folder_);  // or the rename could cross filesystems
  });
  EXPECT_TRUE(fs::exists(path));
}

TEST_F(AtomicFile, ReplacesAnOlderFile) {
  put(folder_ / "a.txt", "a much longer old content");
  writeAtomically(folder_ / "a.txt", [](const fs::path& temporary) { put(temporary, "new"); });
  EXPECT_EQ(get(folder_ / "a.txt"), "new");
}

TEST_F(AtomicFile, AFailedWriteLeavesTheOldFileAndNoTemporary) {
  put(folder_ / "a.txt", "old");
  auto half = [](const fs::path& temporary) {
    put(temporary, "half");
    throw std::runtime_error("the disk is full");
  };
  EXPECT_THROW(writeAtomically(folder_ / "a.txt", half), std::runtime_error);
  EXPECT_EQ(get(folder_ / "a.txt"), "old");
  EXPECT_EQ(entries(), 1);
}

void expectIoError(const fs::path& path, const std::string& named) {
  bool called = false;
  try {
    writeAtomically(path, [&](const fs::path& temporary) {
      called = true;
      std::ofstream(temporary) << "x";
    });
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
    EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
  }
}

TEST_F(AtomicFile, AMissingFolderIsNamed) {
  expectIoError(folder_ / "nowhere" / "a.txt", (folder_ / "nowhere").string());
  EXPECT_EQ(entries(), 0);
}

TEST_F(AtomicFile, AFolderInTheWayIsAnErrorAndStays) {
  fs::create_directories(folder_ / "a.txt");
  expectIoError(folder_ / "a.txt", "a.txt");
  EXPECT_TRUE(fs::is_directory(folder_ / "a.txt"));
  EXPECT_EQ(entries(), 1);
}

TEST_F(AtomicFile, AWriterThatWritesNothingIsAnError) {
  EXPECT_THROW(writeAtomically(folder_ / "a.txt", [](const fs::path&) {}), Error);
  EXPECT_EQ(entries(), 0);
}

}  // namespace
}  // namespace polestar
