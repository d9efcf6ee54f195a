// Reading .pmap files, and refusing damaged ones.
#include "verify/pmap_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "pmap_maps.h"
#include "polestar/map/map_file.h"
#include "support/scratch_folder.h"
#include "verify/judge_pmap.h"

namespace polestar::testing {
namespace {

using ::testing::HasSubstr;

class PmapFile : public ::testing::Test {
 protected:
  void SetUp() override { writeMapFile(path_, smallMap()); }
  std::string complaint() const {
    try {
      verify::readPmap(path_);
    } catch (const verify::Unreadable& error) {
      return error.what();
    }
    return "";
  }
  /// The complaint about a file whose header was changed and signed again.
  std::string complaintAfter(const std::function<void(nlohmann::json&)>& change) const {
    PmapBytes file(path_);
    auto header = nlohmann::json::parse(file.header);
    change(header);
    file.header = header.dump();
    file.write(path_);
    return complaint();
  }
  static nlohmann::json& array(nlohmann::json& header, const std::string& name) {
    for (auto& entry : header["arrays"]) {
      if (entry["name"] == name) return entry;
    }
    throw std::runtime_error(name + " is missing");
  }

  const test::ScratchFolder folder_;
  const std::filesystem::path path_ = folder_ / "map.pmap";
};

TEST_F(PmapFile, HoldsWhatTheLibraryWrote) {
  const verify::PmapContents map = verify::readPmap(path_);
  const Foliation& foliation = smallMap().chart().foliation();
  ASSERT_EQ(map.nodes.size(), foliation.nodes.size());
  ASSERT_EQ(map.ball.size(), foliation.nodes.size());
  EXPECT_EQ(map.levels, foliation.levels.size());
  for (std::size_t i = 0; i < map.nodes.size(); ++i) {
    const Vec3& node = foliation.nodes[i];
    EXPECT_EQ(std::memcmp(&map.nodes[i], node.data(), sizeof(verify::Vec3)), 0);
  }
  EXPECT_EQ(map.notFinite, 0u);
}

TEST_F(PmapFile, SignedCopiesAreTheFileItself) {
  const std::string bytes = test::bytesOf(path_);
  PmapBytes(path_).write(folder_ / "copy.pmap");
  EXPECT_EQ(verify::readPmap(folder_ / "copy.pmap").nodes.size(), verify::readPmap(path_).nodes.size());
}

TEST_F(PmapFile, EveryDamageIsFound) {
  const std::string bytes = test::bytesOf(path_);
  for (std::size_t size : {std::size_t{0}, std::size_t{7}, std::size_t{15}, std::size_t{40},
                           std::size_t{2000}, bytes.size() / 2, bytes.size() - 1}) {
    test::writeBytes(path_, bytes.substr(0, size));
    EXPECT_NE(complaint(), "") << size;
  }
  for (std::size_t at = 3; at < bytes.size(); at += bytes.size() / 97) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    test::writeBytes(path_, damaged);
    EXPECT_NE(complaint(), "") << at;
  }
  test::writeBytes(path_, bytes);
  EXPECT_EQ(complaint(), "");
}

TEST_F(PmapFile, HeadersThatPromiseWhatIsNotThere) {
  EXPECT_THAT(complaintAfter([](auto& h) { h.erase("unit"); }), HasSubstr("unit"));
  writeMapFile(path_, smallMap());
  EXPECT_THAT(complaintAfter([](auto& h) { h["levels"].push_back(0.01); }), HasSubstr("nodes_inner"));
  writeMapFile(path_, smallMap());
  EXPECT_THAT(complaintAfter([](auto& h) { h["levels"] = nlohmann::json::array(); }), HasSubstr("no levels"));
  writeMapFile(path_, smallMap());
  EXPECT_THAT(complaintAfter([](auto& h) { array(h, "ball")["name"] = "bowl"; }),
              HasSubstr("'ball' is missing"));
  for (const std::size_t rows : {std::size_t{1} << 30, std::numeric_limits<std::size_t>::max() / 24}) {
    writeMapFile(path_, smallMap());
    EXPECT_THAT(complaintAfter([&](auto& h) { array(h, "ball")["shape"][0] = rows; }), HasSubstr("larger"));
    writeMapFile(path_, smallMap());
    EXPECT_THAT(complaintAfter([&](auto& h) { array(h, "omega")["offset"] = rows; }), HasSubstr("larger"));
  }
}

TEST_F(PmapFile, NumbersThatAreNoneAreCountedInEveryArray) {
  for (const char* name : {"ball", "harmonic", "phi", "density"}) {
    writeMapFile(path_, smallMap());
    PmapBytes file(path_);
    for (const PmapBytes::Array& array : file.arrays) {
      if (array.name != name) continue;
      const double nan = std::numeric_limits<double>::quiet_NaN();
      std::memcpy(file.data.data() + array.offset + 8 * (array.count / 2), &nan, sizeof nan);
    }
    file.write(path_);
    const verify::Report report = judgePmap(verify::readPmap(path_));
    ASSERT_FALSE(report.holds()) << name;
    EXPECT_EQ(report.firstFailure()->name, "finite");
    EXPECT_THAT(report.firstFailure()->detail, HasSubstr(name));
  }
}

}  // namespace
}  // namespace polestar::testing
