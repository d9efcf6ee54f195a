#include "polestar/mesh/read_mesh.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "mesh/mesh_bytes.h"
#include "polestar/core/error.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

using testing::parse;
using testing::raw;

/// A body whose coordinates fill all bits of a double: no reader that goes through floats can return them.
TriMesh fullPrecisionBody() {
  return transformed(icosphere(1), [](const Vec3& v) { return Vec3(v / 3.0 + Vec3(0.1, 1e-7, -12345.678)); });
}

void expectSame(const TriMesh& got, const TriMesh& want) {
  ASSERT_EQ(got.vertices.size(), want.vertices.size());
  ASSERT_EQ(got.triangles, want.triangles);
  for (std::size_t v = 0; v < want.vertices.size(); ++v) {
    for (int k = 0; k < 3; ++k) {
      ASSERT_EQ(std::bit_cast<std::uint64_t>(got.vertices[v][k]),
                std::bit_cast<std::uint64_t>(want.vertices[v][k]))
          << "vertex " << v;
    }
  }
}

TriMesh tetrahedron() {
  return {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};
}
const std::string kTetrahedronObj =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

TEST(ReadMesh, KeepsDoublesToTheLastBitInEveryFormatThatHasThem) {
  const TriMesh body = fullPrecisionBody();
  expectSame(parse("a.obj", testing::objText(body)).mesh, body);
  expectSame(parse("a.off", testing::offText(body)).mesh, body);
  expectSame(parse("a.ply", testing::plyText(body)).mesh, body);
  expectSame(parse("a.ply", testing::plyBinary<double>(body, std::endian::little)).mesh, body);
  expectSame(parse("a.ply", testing::plyBinary<double>(body, std::endian::big)).mesh, body);
  const TriMesh soup = parse("a.stl", testing::stlText(body)).mesh;
  ASSERT_EQ(soup.vertices.size(), 3 * body.triangles.size());
  for (std::size_t t = 0; t < body.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) ASSERT_EQ(soup.corner(t, k), body.corner(t, k));
  }
}

TEST(ReadMesh, FloatsOfEitherByteOrderArriveExactly) {
  TriMesh rounded = fullPrecisionBody();
  for (Vec3& v : rounded.vertices) {
    for (int k = 0; k < 3; ++k) {
      // GCC 12's vectorizer drops a plain conversion to float and back.
      const volatile float single = static_cast<float>(v[k]);
      v[k] = single;
    }
  }
  expectSame(parse("a.ply", testing::plyBinary<float>(rounded, std::endian::little)).mesh, rounded);
  expectSame(parse("a.ply", testing::plyBinary<float>(rounded, std::endian::big)).mesh, rounded);
  const TriMesh soup = parse("a.stl", testing::stlBinary(rounded)).mesh;
  ASSERT_EQ(soup.triangles.size(), rounded.triangles.size());
  for (std::size_t t = 0; t < rounded.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) ASSERT_EQ(soup.corner(t, k), rounded.corner(t, k));
  }
}

TEST(ReadMesh, RecognizesTheContentWhateverTheName) {
  const TriMesh body = tetrahedron();
  EXPECT_EQ(parse("a.obj", testing::plyText(body)).format, "ply");
  EXPECT_EQ(parse("a", testing::offText(body)).format, "off");
  EXPECT_EQ(parse("a.ply", testing::stlText(body)).format, "stl");
  EXPECT_EQ(parse("a.dat", testing::stlBinary(body)).format, "stl");
  EXPECT_EQ(parse("A.OBJ", kTetrahedronObj).format, "obj");
  EXPECT_EQ(parse("a.obj", "\xEF\xBB\xBF" + kTetrahedronObj).format, "obj");
}

TEST(ReadMesh, ReadsFromDisk) {
  const auto path =
      std::filesystem::temp_directory_path() / ("polestar_read_" + std::to_string(::getpid()) + ".obj");
  std::ofstream(path) << kTetrahedronObj;
  const MeshFile file = readMesh(path);
  std::filesystem::remove(path);
  expectSame(file.mesh, tetrahedron());
  EXPECT_EQ(file.polygons, 0u);
}

// OBJ

TEST(ReadObj, CornersWithTextureAndNormalNumbers) {
  const std::string vertices = kTetrahedronObj.substr(0, kTetrahedronObj.find('f'));
  for (const char* faces :
       {"f 1/1 3/2 2/3\nf 1/ 2/ 4/\nf 1/9 4/9 3/9\nf 2/1 3/1 4/1\n",
        "f 1//1 3//2 2//3\nf 1//1 2//1 4//1\nf 1//9 4//9 3//9\nf 2//1 3//1 4//1\n",
        "f 1/1/1 3/2/2 2/3/3\nf 1/1/1 2/2/2 4/4/4\nf 1/1/1 4/4/4 3/3/3\nf 2/1/1 3/1/1 4/1/1\n"}) {
    expectSame(parse("a.obj", "vt 0 0\nvn 0 0 1\n" + vertices + faces).mesh, tetrahedron());
  }
}

TEST(ReadObj, NegativeIndicesCountBackFromTheLatestVertex) {
  expectSame(
      parse("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -1 -2\nv 0 0 1\nf 1 2 -1\nf -4 -1 -2\nf 2 -2 4\n").mesh,
      tetrahedron());
}

TEST(ReadObj, VerticesMayFollowTheirFaces) {
  expectSame(parse("a.obj", "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n" +
                                kTetrahedronObj.substr(0, kTetrahedronObj.find('f')))
                 .mesh,
             tetrahedron());
}

TEST(ReadObj, LineEndsCommentsContinuationsColorsAndSigns) {
  expectSame(
      parse("a.obj",
            "mtllib x.mtl\r\n  v +0 -0.0e0 0 1.0\r\nv\t1 0 0 0.5 0.5 0.5 # red\r\nv 0 1.0E+0 0\r\nv 0 "
            "\\\r\n0 1\r\n"
            "usemtl \\\\share\\m\r\ns off\r\nf 1 3 2 # first\r\nf 1 2 \\\n4\r\nf 1 4 3\r\nl 1 2\r\nf 2 3 4")
          .mesh,
      [] {
        TriMesh body = tetrahedron();
        body.vertices[0][1] = -0.0;
        return body;
      }());
  std::string oldMac = kTetrahedronObj;
  std::replace(oldMac.begin(), oldMac.end(), '\n', '\r');
  expectSame(parse("a.obj", oldMac).mesh, tetrahedron());
}

TEST(ReadObj, PolygonsAreCountedAndCut) {
  const MeshFile cube =
      parse("a.obj",
            "v -1 -1 -1\nv 1 -1 -1\nv 1 1 -1\nv -1 1 -1\nv -1 -1 1\nv 1 -1 1\nv 1 1 1\nv -1 1 1\n"
            "f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n");
  EXPECT_EQ(cube.polygons, 6u);
  EXPECT_EQ(cube.mesh.triangles.size(), 12u);
  EXPECT_NEAR(volumeProperties(cube.mesh).volume, 8, 1e-14);
}

TEST(ReadObj, NumbersTooSmallForADoubleAreZero) {
  EXPECT_EQ(parse("a.obj", "v 1e-999 0 -1e-400\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").mesh.vertices[0],
            Vec3(0, 0, 0));
  const Vec3 denormal = parse("a.obj", "v 5e-324 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").mesh.vertices[0];
  EXPECT_EQ(denormal[0], 5e-324);
}

// OFF

TEST(ReadOff, HeaderVariants) {
  const std::string body = "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";
  for (const char* head :
       {"OFF\n4 4 6\n", "OFF 4 4 6\n", "OFF\n4 4\n", "# made by hand\n\nOFF # here\n\n# counts\n4 4 0\n\n",
        "4 4 6\n", "OFF\r\n4 4 0\r\n"}) {
    expectSame(parse("a.off", head + body).mesh, tetrahedron());
  }
}

TEST(ReadOff, ColorsAndNormalsArePassedOver) {
  expectSame(parse("a.off",
                   "COFF\n4 4 0\n0 0 0 255 0 0 255\n1 0 0 0 0 0 0\n0 1 0 1 1 1 1\n0 0 1 0.5 0.5 0.5 1\n"
                   "3 0 2 1 255 0 0\n3 0 1 3\n3 0 3 2 0.1 0.2 0.3 0.4 # c\n3 1 2 3 7\n")
                 .mesh,
             tetrahedron());
  expectSame(parse("a.off",
                   "STCNOFF 4 4 0\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 1\n0 0 1 0 0 1\n3 0 2 1\n3 0 1 3\n3 0 "
                   "3 2\n3 1 2 3\n")
                 .mesh,
             tetrahedron());
}

// PLY

TEST(ReadPly, ForeignElementsAndPropertiesAreSteppedOver) {
  const std::string header =
      "ply\r\nformat ascii 1.0\r\ncomment by hand\r\nobj_info none\r\nelement material 1\r\nproperty list "
      "uchar float tones\r\n"
      "property int id\r\nelement vertex 4\r\nproperty uchar red\r\nproperty float z\r\nproperty double "
      "y\r\nproperty short x\r\n"
      "property list uint8 int32 rings\r\nelement empty 7\r\nelement face 4\r\nproperty float quality\r\n"
      "property list uint8 uint32 vertex_index\r\nproperty list uchar float texcoord\r\nend_header\r\n";
  expectSame(
      parse("a.ply", header + "2 0.5 0.25 7\r\n9 0 0 0 0\r\n9 0 0 1 2 5 6\r\n\r\n9 0 1 0 0\r\n9 1 0 0 1 5\r\n"
                              "0.5 3 0 2 1 2 0 0\r\n0.5 3 0 1 3 0\r\n0.5 3 0 3 2 0\r\n0.5 3 1 2 3 0\r\n")
          .mesh,
      tetrahedron());
}

/// One value of every type before and behind the coordinates, lists with every count type.
TEST(ReadPly, EveryTypeOfBothByteOrders) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const TriMesh body = tetrahedron();
    std::string bytes =
        std::string("ply\nformat ") +
        (order == std::endian::little ? "binary_little_endian" : "binary_big_endian") +
        " 1.0\nelement extra 2\nproperty char a\nproperty uint16 b\nproperty list ushort double c\n"
        "element vertex 4\nproperty int8 pad\nproperty short x\nproperty uchar y\nproperty list int float d\n"
        "property uint32 z\nelement face 4\nproperty list short ushort vertex_indices\nproperty double "
        "e\nend_header\n";
    for (int i = 0; i < 2; ++i) {
      bytes += raw<std::int8_t>(-3, order) + raw<std::uint16_t>(500, order) + raw<std::uint16_t>(2, order) +
               raw(1.5, order) + raw(2.5, order);
    }
    for (const Vec3& v : body.vertices) {
      bytes += raw<std::int8_t>(1, order) + raw(static_cast<std::int16_t>(v[0]), order) +
               raw(static_cast<std::uint8_t>(v[1]), order) + raw<std::int32_t>(1, order) + raw(7.0F, order) +
               raw(static_cast<std::uint32_t>(v[2]), order);
    }
    for (const Triangle& t : body.triangles) {
      bytes += raw<std::int16_t>(3, order);
      for (const std::int32_t v : t) bytes += raw(static_cast<std::uint16_t>(v), order);
      bytes += raw(0.125, order);
    }
    expectSame(parse("a.ply", bytes).mesh, body);
  }
}

TEST(ReadPly, BinaryDataMayBeginWithALineEnd) {
  // Headers of three kinds of line ends; the first vertex's first byte is an LF in each.
  TriMesh body = tetrahedron();
  const float odd = std::bit_cast<float>(0x3F80000AU);
  body.vertices[0][0] = odd;
  const std::string plain = testing::plyBinary<float>(body, std::endian::little);
  const std::size_t data = plain.find("end_header\n") + 11;
  for (const std::string lineEnd : {"\n", "\r\n", "\r"}) {
    std::string bytes;
    for (std::size_t i = 0; i < data; ++i) bytes += plain[i] == '\n' ? lineEnd : std::string(1, plain[i]);
    expectSame(parse("a.ply", bytes + plain.substr(data)).mesh, body);
  }
}

TEST(ReadPly, TriangleStripsAlternateAndRestart) {
  const std::string head =
      "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
      "element tristrips 2\nproperty list int int vertex_indices\nend_header\n"
      "0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n1 2 0\n";
  // A flat ladder seen from +z: strip 0 1 2 3 4 5, once whole, once cut by -1 (which also restarts the
  // winding), and with a stitched pair 3 3 that makes degenerate triangles.
  const std::vector<Triangle> ladder{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}, {4, 3, 5}};
  EXPECT_EQ(parse("a.ply", head + "6 0 1 2 3 4 5\n0\n").mesh.triangles, ladder);
  EXPECT_EQ(parse("a.ply", head + "6 0 1 2 3 -1 -1\n4 2 3 4 5\n").mesh.triangles, ladder);
  EXPECT_EQ(parse("a.ply", head + "8 0 1 2 -1 2 1 3 -1\n4 2 3 4 5\n").mesh.triangles, ladder);
  const auto stitched = parse("a.ply", head + "9 0 1 2 3 3 2 2 3 4\n0\n").mesh.triangles;
  EXPECT_EQ(stitched, (std::vector<Triangle>{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
}

TEST(ReadPly, BinaryTriangleStrips) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    std::string bytes = std::string("ply\nformat ") +
                        (order == std::endian::little ? "binary_little_endian" : "binary_big_endian") +
                        " 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
                        "element tristrips 1\nproperty list int int vertex_indices\nend_header\n";
    for (const Vec3& v : tetrahedron().vertices) {
      for (int k = 0; k < 3; ++k) bytes += raw(static_cast<float>(v[k]), order);
    }
    const std::vector<std::int32_t> strip{0, 2, 1, 3, -1, 0, 3, 2, -1, 1, 0, 3};
    bytes += raw(static_cast<std::int32_t>(strip.size()), order);
    for (const std::int32_t i : strip) bytes += raw(i, order);
    EXPECT_EQ(parse("a.ply", bytes).mesh.triangles,
              (std::vector<Triangle>{{0, 2, 1}, {1, 2, 3}, {0, 3, 2}, {1, 0, 3}}));
  }
}

// STL

TEST(ReadStl, BinaryThatBeginsWithSolidIsKnownByItsSize) {
  const MeshFile file = parse("a.stl", testing::stlBinary(tetrahedron(), "solid facet normal: a liar"));
  EXPECT_EQ(file.format, "stl");
  EXPECT_EQ(file.mesh.triangles.size(), 4u);
  EXPECT_EQ(file.mesh.corner(3, 2), Vec3(0, 0, 1));
}

TEST(ReadStl, TextWithCapitalsBlanksAndSeveralSolids) {
  const std::string text = testing::stlText(tetrahedron());
  EXPECT_EQ(parse("a.stl", text + "\n" + text).mesh.triangles.size(), 8u);
  std::string capitals = "\n  " + text;
  for (char& c : capitals) c = static_cast<char>(std::toupper(c));
  EXPECT_EQ(parse("a.stl", capitals).mesh.triangles.size(), 4u);
  EXPECT_EQ(parse("a.stl",
                  text.substr(0, text.find('\n')).append(" facet endloop \r") + text.substr(text.find('\n')))
                .mesh.triangles.size(),
            4u);
}

}  // namespace
}  // namespace polestar
