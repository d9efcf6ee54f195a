// Files that must end in a message: with the place, the reason and without an allocation by claimed counts.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "mesh/mesh_bytes.h"
#include "polestar/core/error.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::parseError;
using testing::raw;

std::string readError(const std::filesystem::path& path) {
  try {
    readMesh(path);
  } catch (const Error& error) {
    return error.code() == Errc::io ? error.what() : "";
  }
  return {};
}

const std::string kVertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";

TEST(ReadErrors, NoFileFolderEmptyPipe) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("polestar_errors_" + std::to_string(::getpid()));
  std::filesystem::create_directory(folder);
  EXPECT_THAT(readError(folder / "none.obj"), AllOf(HasSubstr("none.obj"), HasSubstr("no such file")));
  EXPECT_THAT(readError(folder), HasSubstr("is a folder"));
  std::ofstream(folder / "empty.stl").close();
  EXPECT_THAT(readError(folder / "empty.stl"), HasSubstr("empty"));
  EXPECT_THAT(readError("/dev/zero"), HasSubstr("no regular file"));
  std::filesystem::remove_all(folder);
}

TEST(ReadErrors, NumbersThatAreNone) {
  EXPECT_THAT(parseError("a.obj", kVertices + "v 0 nan 1\nf 1 2 3\n"),
              AllOf(HasSubstr("a.obj"), HasSubstr("line 4"), HasSubstr("vertex 4"), HasSubstr("'nan'")));
  EXPECT_THAT(parseError("a.obj", kVertices + "v 0 -inf 1\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("'-inf'")));
  EXPECT_THAT(parseError("a.obj", kVertices + "v 0 1e999 1\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("double")));
  EXPECT_THAT(parseError("a.obj", kVertices + "v 0 1,5 1\n"), AllOf(HasSubstr("line 4"), HasSubstr("'1,5'")));
  EXPECT_THAT(parseError("a.obj", kVertices + "v 0 1\nf 1 2 3\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("line ends")));
  EXPECT_THAT(parseError("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0x1\n3 0 1 2\n"),
              AllOf(HasSubstr("line 5"), HasSubstr("vertex 3")));
  EXPECT_THAT(parseError("a.stl", "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 NaN\n"),
              HasSubstr("line 5"));
  // Lines count on through continuations.
  EXPECT_THAT(parseError("a.obj", "v 0 \\\n0 \\\n0\nv 1 2 x\n"), HasSubstr("line 4"));
}

TEST(ReadErrors, BinaryNotANumberIsNamedByItsByte) {
  TriMesh body = icosphere(0);
  body.vertices[2][1] = std::numeric_limits<double>::quiet_NaN();
  const std::string little = testing::plyBinary<double>(body, std::endian::little);
  const std::size_t data = little.find("end_header\n") + 11;
  EXPECT_THAT(parseError("a.ply", little),
              AllOf(HasSubstr("byte " + std::to_string(data + 48)), HasSubstr("vertex 3"), HasSubstr("NaN")));
  EXPECT_THAT(parseError("a.ply", testing::plyBinary<float>(body, std::endian::big)), HasSubstr("vertex 3"));
  EXPECT_THAT(parseError("a.stl", testing::stlBinary(body)),
              AllOf(HasSubstr("byte"), HasSubstr("triangle"), HasSubstr("NaN")));
}

TEST(ReadErrors, Indices) {
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2 3\nf 1 2 4\nf 1 2 3\n"),
              AllOf(HasSubstr("line 5"), HasSubstr("vertex 4"), HasSubstr("from 1 to 3")));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 0 1 2\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("vertex 0")));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2 -4\n"),
              AllOf(HasSubstr("line 4"), HasSubstr("vertex -4")));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2 99999999999999999999\n"), HasSubstr("line 4"));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2 9223372036854775807\n"), HasSubstr("line 4"));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2 -9223372036854775808\n"), HasSubstr("line 4"));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2 3.5\n"), HasSubstr("'3.5'"));
  EXPECT_THAT(parseError("a.obj", kVertices + "f\n"), HasSubstr("line 4"));
  EXPECT_THAT(parseError("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
              AllOf(HasSubstr("line 6"), HasSubstr("vertex 3"), HasSubstr("from 0 to 2")));
  EXPECT_THAT(parseError("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 -1\n"),
              AllOf(HasSubstr("line 6"), HasSubstr("vertex -1")));
  TriMesh body = icosphere(0);
  body.triangles[1][1] = 1'000'000;
  EXPECT_THAT(parseError("a.ply", testing::plyBinary<float>(body, std::endian::little)),
              AllOf(HasSubstr("byte"), HasSubstr("vertex 1000000")));
}

TEST(ReadErrors, NoSurface) {
  EXPECT_THAT(parseError("a.obj", kVertices), HasSubstr("no faces"));
  EXPECT_THAT(parseError("a.obj", "\n\n"), HasSubstr("neither"));
  EXPECT_THAT(parseError("a.obj", std::string(1000, '\xF3')), HasSubstr("neither"));
  EXPECT_THAT(parseError("a.off", "OFF\n0 0 0\n"), HasSubstr("neither"));
  EXPECT_THAT(parseError("a.stl", "solid nothing\nendsolid nothing\n"), HasSubstr("neither"));
  EXPECT_THAT(parseError("a.obj", kVertices + "f 1 2\n"), HasSubstr("no faces"));
}

TEST(ReadErrors, WrongMagic) {
  EXPECT_THAT(parseError("a.ply", "plu\nformat ascii 1.0\n"), HasSubstr("'ply'"));
  EXPECT_THAT(parseError("a.off", "COFFEE\n1 1 1\n"), HasSubstr("'COFFEE'"));
  EXPECT_THAT(parseError("a.off", "4OFF\n1 1 1\n"), HasSubstr("4OFF"));
  EXPECT_THAT(parseError("a.off", "OFF BINARY\n"), HasSubstr("binary"));
  EXPECT_THAT(parseError("a.txt", "hello"), HasSubstr("OBJ, PLY, STL or OFF"));
  EXPECT_THAT(parseError("a.stl", "neither text nor binary"), HasSubstr("23 bytes"));
  EXPECT_THAT(parseError("a.obj", "\x1F\x8B\x08 zipped"), HasSubstr("compressed"));
}

/// Every proper prefix must be an error: nothing truncated is taken for whole.
TEST(ReadErrors, EveryTruncationIsNoticed) {
  const TriMesh body = icosphere(0);
  const std::vector<std::pair<std::string, std::string>> files{
      {"a.off", testing::offText(body)},
      {"a.ply", testing::plyText(body)},
      {"b.ply", testing::plyBinary<float>(body, std::endian::little)},
      {"c.ply", testing::plyBinary<double>(body, std::endian::big)},
      {"a.stl", testing::stlText(body)},
      {"b.stl", testing::stlBinary(body)},
  };
  for (const auto& [name, bytes] : files) {
    const bool text = bytes.find('\0') == bytes.npos;
    ASSERT_EQ(parseError(name, bytes), "") << name;
    // The last line's text may lose digits and stay a number: the cut then lies inside the last word.
    const std::size_t last = bytes.size() - (text ? 16 : 1);
    for (std::size_t size = 1; size <= last; ++size) {
      ASSERT_NE(parseError(name, bytes.substr(0, size)), "")
          << name << " cut to " << size << " of " << bytes.size();
    }
  }
  EXPECT_THAT(parseError("a.stl", testing::stlText(body).substr(0, 3000)), HasSubstr("line "));
  EXPECT_THAT(parseError("b.ply", files[2].second.substr(0, 500)),
              AllOf(HasSubstr("byte"), HasSubstr("truncated")));
  EXPECT_THAT(parseError("b.stl", files[5].second.substr(0, 500)),
              AllOf(HasSubstr("claims 20 triangles"), HasSubstr("500")));
}

TEST(ReadErrors, MoreThanTheHeaderSays) {
  const TriMesh body = icosphere(0);
  EXPECT_THAT(parseError("a.off", testing::offText(body) + "3 0 1 2\n"), HasSubstr("more lines"));
  EXPECT_THAT(parseError("a.ply", testing::plyText(body) + "3 0 1 2\n"), HasSubstr("more lines"));
  EXPECT_THAT(parseError("a.ply", testing::plyBinary<float>(body, std::endian::little) + "xyz"),
              HasSubstr("3 bytes"));
  EXPECT_EQ(parseError("a.ply", testing::plyBinary<float>(body, std::endian::little) + "\r\n"), "");
  EXPECT_THAT(parseError("a.stl", testing::stlBinary(body) + "x"), HasSubstr("claims 20"));
}

/// Claims of 10^18 elements or list entries in small files: an allocation by them would fail or take the
/// machine down.
TEST(ReadErrors, HugeClaimsCostNothing) {
  EXPECT_THAT(parseError("a.off", "OFF\n1000000000000000000 2 0\n0 0 0\n"),
              HasSubstr("after 1 of 1000000000000000000"));
  EXPECT_THAT(parseError("a.off", "OFF\n3 1000000000000000000 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
              HasSubstr("after 1 of"));
  EXPECT_THAT(parseError("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n1000000000000000000 0 1 2\n"),
              HasSubstr("line ends"));
  EXPECT_THAT(parseError("a.off", "OFF\n99999999999999999999999 1 0\n"), HasSubstr("line 2"));
  EXPECT_THAT(parseError("a.off", "OFF\n-3 1 0\n"), HasSubstr("negative"));
  const std::string vertexHead = "property float x\nproperty float y\nproperty float z\n";
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string head = std::string("ply\nformat ") + format + " 1.0\n";
    EXPECT_THAT(parseError("a.ply", head + "element vertex 18446744073709551615\n" + vertexHead +
                                        "end_header\n0 0 0\n0 0 0\n"),
                HasSubstr("18446744073709551615"));
    // Rows without a property take no bytes: their number must not be counted through.
    EXPECT_THAT(parseError("a.ply", head + "element ghost 18446744073709551615\nend_header\n"),
                HasSubstr("neither"));
    EXPECT_THAT(
        parseError("a.ply",
                   head + "element other 18446744073709551615\nproperty double a\nend_header\n1 2 3 4"),
        HasSubstr("other"));
  }
  const std::string lists =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list uint int "
      "vertex_indices\nend_header\n";
  EXPECT_THAT(parseError("a.ply", lists + raw<std::uint32_t>(0xFFFFFFFF) + raw<std::int32_t>(0)),
              HasSubstr("truncated"));
  const std::string skipped =
      "ply\nformat binary_little_endian 1.0\nelement other 1\nproperty list uint double a\nend_header\n";
  EXPECT_THAT(parseError("a.ply", skipped + raw<std::uint32_t>(0xFFFFFFFF) + raw<std::int32_t>(0)),
              HasSubstr("truncated"));
  const std::string negative =
      "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list char int "
      "vertex_indices\nend_header\n";
  EXPECT_THAT(parseError("a.ply", negative + raw<std::int8_t>(-2) + raw<std::int32_t>(0)),
              HasSubstr("list of -2"));
  std::string stl(84, ' ');
  stl.replace(80, 4, raw<std::uint32_t>(0xFFFFFFFF));
  EXPECT_THAT(parseError("a.stl", stl), HasSubstr("4294967295 triangles"));
}

TEST(ReadErrors, PlyHeaders) {
  const auto error = [](const std::string& header) {
    return parseError("a.ply", "ply\n" + header + "end_header\n");
  };
  EXPECT_THAT(error("format ascii 1.0\nelement vertex many\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("'many'")));
  EXPECT_THAT(error("format ascii 1.0\nelement vertex -1\n"), HasSubstr("line 3"));
  EXPECT_THAT(error("format runes 1.0\n"), AllOf(HasSubstr("line 2"), HasSubstr("'runes'")));
  EXPECT_THAT(error("element vertex 1\n"), HasSubstr("no line 'format'"));
  EXPECT_THAT(error("format ascii 1.0\nproperty float x\n"), HasSubstr("before the first element"));
  EXPECT_THAT(error("format ascii 1.0\nelement vertex 1\nproperty quad x\n"), HasSubstr("'quad'"));
  EXPECT_THAT(error("format ascii 1.0\nelement vertex 1\nproperty list float int x\n"), HasSubstr("integer"));
  EXPECT_THAT(error("format ascii 1.0\nelement vertex 1\nproperty float x\nproperty float z\n"),
              HasSubstr("'y'"));
  EXPECT_THAT(error("format ascii 1.0\nelement face 1\nproperty int vertex_indices\n"),
              HasSubstr("vertex_indices"));
  EXPECT_THAT(error("format ascii 1.0\nnonsense\n"), AllOf(HasSubstr("line 3"), HasSubstr("'nonsense'")));
  EXPECT_THAT(parseError("a.ply", "ply\nformat ascii 1.0\n"), HasSubstr("inside its header"));
}

TEST(ReadErrors, StlText) {
  const auto error = [](const std::string& body) {
    return parseError("a.stl", "solid x\n" + body + "endsolid x\n");
  };
  EXPECT_THAT(error("facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"),
              AllOf(HasSubstr("line 6"), HasSubstr("2 vertices")));
  EXPECT_THAT(error("facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 "
                    "0\nendloop\n"),
              HasSubstr("line 7"));
  EXPECT_THAT(error("vertex 0 0 0\n"), HasSubstr("line 2"));
  EXPECT_THAT(error("endloop\n"), HasSubstr("line 2"));
  EXPECT_THAT(error("vortex 0 0 0\n"), HasSubstr("'vortex'"));
  EXPECT_THAT(error("facet\nouter loop\n"), HasSubstr("inside a loop"));
}

TEST(ReadErrors, MessagesStayPrintableAndShort) {
  const std::string garbage = std::string("v 1 2 ") + std::string(100'000, '\x01') + "\n";
  const std::string message = parseError("a.obj", garbage);
  EXPECT_LT(message.size(), 200u);
  for (const char c : message) EXPECT_TRUE(c >= ' ' && c <= '~');
}

}  // namespace
}  // namespace polestar
