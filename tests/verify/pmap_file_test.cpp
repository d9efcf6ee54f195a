// Reading .pmap files, and refusing damaged ones.
#include "verify/pmap_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <nlohmann/json.hpp>

#include "pmap_maps.h"
#include "polestar/core/error.h"
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

/// Without what format 3 added.
void makeOlder(const std::filesystem::path& path) {
  PmapBytes file(path);
  auto header = nlohmann::json::parse(file.header);
  auto& arrays = header["arrays"];
  for (const std::string name : {"slope_trust", "straight_nodes"}) {
    arrays.erase(
        std::find_if(arrays.begin(), arrays.end(), [&](const auto& entry) { return entry["name"] == name; }));
  }
  file.header = header.dump();
  file.format = 2;
  file.write(path);
}

TEST_F(PmapFile, OfFormatTwoHoldsTheSameMap) {
  makeOlder(path_);
  EXPECT_EQ(complaint(), "");
  const NodeBends found = readMapFile(path_).map.nodeBends();
  EXPECT_EQ(found.trust, smallMap().nodeBends().trust);
  EXPECT_EQ(found.straight, smallMap().nodeBends().straight);
}

TEST_F(PmapFile, OfOtherFormatsIsRefused) {
  for (const std::uint32_t format : {1u, 2u, 4u}) {
    PmapBytes file(path_);
    file.format = format;
    file.write(path_);
    EXPECT_THAT(complaint(), HasSubstr("format")) << format;
    EXPECT_THROW(readMapFile(path_), Error);
    writeMapFile(path_, smallMap());
  }
}

TEST_F(PmapFile, BendsThatMeanNothingAreRefusedByBothReaders) {
  const auto withTrust = [&](float trust) {
    writeMapFile(path_, smallMap());
    PmapBytes file(path_);
    for (const PmapBytes::Array& array : file.arrays) {
      if (array.name == "slope_trust") std::memcpy(&file.data[array.offset + 40], &trust, sizeof trust);
    }
    file.write(path_);
  };
  for (const float trust : {-0.25f, 1.5f, std::numeric_limits<float>::infinity()}) {
    withTrust(trust);
    EXPECT_THAT(complaint(), HasSubstr("slope_trust of node 10"));
    EXPECT_THROW(readMapFile(path_), Error);
  }
  withTrust(std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(judgePmap(verify::readPmap(path_)).firstFailure()->name, "finite");
  EXPECT_THROW(readMapFile(path_), Error);

  writeMapFile(path_, smallMap());
  EXPECT_THAT(complaintAfter([](auto& h) { array(h, "slope_trust")["shape"][0] = 1; }),
              HasSubstr("slope_trust"));
  EXPECT_THROW(readMapFile(path_), Error);
  // A list that lies where other numbers do names nodes that are not there.
  writeMapFile(path_, smallMap());
  EXPECT_THAT(complaintAfter([](auto& h) {
                array(h, "straight_nodes")["shape"][0] = 3;
                array(h, "straight_nodes")["offset"] = array(h, "ball")["offset"];
              }),
              HasSubstr("straight_nodes"));
  EXPECT_THROW(readMapFile(path_), Error);
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
