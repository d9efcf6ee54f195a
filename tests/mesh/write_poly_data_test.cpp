// Surfaces and curves with data: what other programs read back. The .vtp is taken apart here by its own
// rules.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "polestar/core/error.h"
#include "polestar/mesh/poly_data.h"
#include "polestar/mesh/read_mesh.h"
#include "support/scratch_folder.h"

namespace polestar {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// A quad and a triangle on it, a closed curve and an open one.
PolyData house() {
  PolyData data;
  data.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 1.0 / 3}, {0, 1, 0}, {0.5, 1.5, -1e-300}};
  data.parts.resize(2);
  data.parts[0].name = "walls";
  data.parts[0].triangles = {{3, 2, 4}};
  data.parts[0].quads = {{0, 1, 2, 3}};
  data.parts[1].name = "ropes";
  data.parts[1].lines = {{0, 1, 2, 0}, {3, 4}};
  MeshData height, wind;
  height.name = "height";
  height.values = {0, 1.0 / 7, 2, 3, -5e300};
  wind.name = "wind";
  wind.components = 3;
  for (int i = 0; i < 15; ++i) wind.values.push_back(i / 3.0);
  data.pointData = {height, wind};
  return data;
}

std::string written(const std::string& name, const PolyData& data, const std::string& comment = {}) {
  const test::ScratchFolder folder;
  writePolyData(folder / name, data, comment);
  return test::bytesOf(folder / name);
}

std::string decodeBase64(const std::string& text) {
  static const std::string kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t group = 0;
  int bits = 0;
  for (const char c : text) {
    if (c == '=') break;
    group = group << 6 | static_cast<std::uint32_t>(kDigits.find(c));
    bits += 6;
    if (bits >= 8) bytes += static_cast<char>(group >> (bits -= 8) & 255);
  }
  return bytes;
}

/// The numbers of one DataArray.
template <class Number>
std::vector<Number> arrayOf(const std::string& vtp, const std::string& name) {
  std::smatch match;
  const std::regex element("<DataArray [^>]*Name=\"" + name + "\"[^>]*format=\"binary\">([^<]*)</DataArray>");
  if (!std::regex_search(vtp, match, element)) return {};
  const std::string bytes = decodeBase64(match[1]);
  std::uint64_t count = 0;
  std::memcpy(&count, bytes.data(), sizeof count);
  EXPECT_EQ(count + sizeof count, bytes.size());
  std::vector<Number> numbers(count / sizeof(Number));
  std::memcpy(numbers.data(), bytes.data() + sizeof count, count);
  return numbers;
}

TEST(WritePolyData, VtpHoldsEveryNumber) {
  const PolyData data = house();
  const std::string vtp = written("a.vtp", data, "made --by <us> & \"others\"");
  const std::vector<double> points = arrayOf<double>(vtp, "Points");
  ASSERT_EQ(points.size(), 15u);
  for (std::size_t i = 0; i < 5; ++i) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(points[3 * i + static_cast<std::size_t>(k)], data.points[i][k]);
  }
  EXPECT_EQ(arrayOf<double>(vtp, "height"), data.pointData[0].values);
  EXPECT_EQ(arrayOf<double>(vtp, "wind"), data.pointData[1].values);
  // Lines first, then faces: that is how VTK counts cells.
  EXPECT_THAT(arrayOf<std::int32_t>(vtp, "part"), ElementsAre(1, 1, 0, 0));
  const std::size_t lines = vtp.find("<Lines>"), polys = vtp.find("<Polys>");
  EXPECT_THAT(arrayOf<std::int64_t>(vtp.substr(lines), "connectivity"), ElementsAre(0, 1, 2, 0, 3, 4));
  EXPECT_THAT(arrayOf<std::int64_t>(vtp.substr(lines), "offsets"), ElementsAre(4, 6));
  EXPECT_THAT(arrayOf<std::int64_t>(vtp.substr(polys), "connectivity"), ElementsAre(3, 2, 4, 0, 1, 2, 3));
  EXPECT_THAT(arrayOf<std::int64_t>(vtp.substr(polys), "offsets"), ElementsAre(3, 7));
  EXPECT_THAT(vtp, HasSubstr("NumberOfPoints=\"5\" NumberOfVerts=\"0\" NumberOfLines=\"2\" "
                             "NumberOfStrips=\"0\" NumberOfPolys=\"2\""));
  // Nothing of the comment can end an element.
  EXPECT_THAT(vtp, ::testing::Not(HasSubstr("<us>")));
  EXPECT_THAT(vtp, HasSubstr("119 97 108 108 115 0 114 111 112 101 115 0"));
}

TEST(WritePolyData, ObjHasAnObjectAPart) {
  EXPECT_EQ(written("a.obj", house(), "two\nlines"),
            "# two\n# lines\nv 0 0 0\nv 1 0 0\nv 1 1 0.3333333333333333\nv 0 1 0\nv 0.5 1.5 -1e-300\n"
            "o walls\nf 4 3 5\nf 1 2 3 4\no ropes\nl 1 2 3 1\nl 4 5\n");
}

TEST(WritePolyData, PlyIsReadBack) {
  const test::ScratchFolder folder;
  writePolyData(folder / "a.ply", house(), "a comment");
  const MeshFile back = readMesh(folder / "a.ply");
  EXPECT_EQ(back.mesh.vertices, house().points);
  ASSERT_EQ(back.mesh.triangles.size(), 3u);
  EXPECT_EQ(back.mesh.triangles[0], (Triangle{3, 2, 4}));
  const std::string bytes = test::bytesOf(folder / "a.ply");
  for (const char* line : {"comment a comment\n", "comment part 1 ropes\n", "property double height\n",
                           "property double wind_z\n", "element face 2\n", "element edge 4\n"})
    EXPECT_THAT(bytes, HasSubstr(line));
  const std::int32_t last[] = {3, 4, 1};
  EXPECT_EQ(bytes.substr(bytes.size() - sizeof last),
            std::string(reinterpret_cast<const char*>(last), sizeof last));
}

TEST(WritePolyData, SaysWhyItCannot) {
  const auto codeOf = [](const std::filesystem::path& path) {
    try {
      writePolyData(path, house());
    } catch (const Error& error) {
      return error.code();
    }
    return Errc::cancelled;
  };
  EXPECT_EQ(codeOf("/nonexistent/a.vtp"), Errc::io);
  EXPECT_EQ(codeOf(std::filesystem::path(::testing::TempDir()) / "a.stl"), Errc::usage);
}

}  // namespace
}  // namespace polestar
