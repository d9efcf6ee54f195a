// Stereolithography files, text and binary: a soup of triangles, each with three vertices of its own.
#include <algorithm>
#include <cstdint>

#include "polestar/mesh/detail/raw_bytes.h"
#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/detail/surface_builder.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kHeaderBytes = 84, kTriangleBytes = 50;

void addOwnTriangle(SurfaceBuilder& builder, std::size_t place) {
  const auto count = static_cast<std::int64_t>(builder.vertexCount());
  builder.addFace(std::array<std::int64_t, 3>{count - 3, count - 2, count - 1}, place);
}

MeshFile parseBinary(const MeshSource& source) {
  const std::string& bytes = source.bytes;
  if (bytes.size() < kHeaderBytes) {
    source.fail("its " + std::to_string(bytes.size()) +
                " bytes are fewer than a binary STL's header of 84, and it is no text STL either");
  }
  const std::uint64_t triangles = fromBytes<std::uint32_t>(bytes.data() + 80);
  if (!hasBinaryStlSize(bytes)) {
    source.failAtByte(80, "the header claims " + std::to_string(triangles) + " triangles, which take " +
                              std::to_string(kHeaderBytes + kTriangleBytes * triangles) +
                              " bytes, but the file has " + std::to_string(bytes.size()) +
                              "; it is truncated or no STL file, export or copy it again");
  }
  SurfaceBuilder builder(source, {"stl", 0, "byte"});
  builder.reserve(3 * triangles, triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const std::size_t offset = kHeaderBytes + kTriangleBytes * t;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t at = offset + 12 * (k + 1);
      const Vec3 v(fromBytes<float>(bytes.data() + at), fromBytes<float>(bytes.data() + at + 4),
                   fromBytes<float>(bytes.data() + at + 8));
      if (!v.allFinite()) {
        source.failAtByte(at, "vertex " + std::to_string(k + 1) + " of triangle " + std::to_string(t + 1) +
                                  " has a NaN or infinite coordinate; mend the mesh and export it again");
      }
      builder.addVertex(v);
    }
    addOwnTriangle(builder, offset);
  }
  return builder.finish();
}

/// Text STL as a stream of words; only `solid` and `endsolid` swallow the rest of their line.
class TextStl {
 public:
  explicit TextStl(const MeshSource& source)
      : source_(source), lines_(source, {}), builder_(source, {"stl", 0, "line"}) {
    builder_.reserve(source.bytes.size() / 80, source.bytes.size() / 240);
  }

  /// Whether the word is `keyword`, in capitals or not.
  static bool is(std::string_view word, std::string_view keyword) {
    return word.size() == keyword.size() && std::equal(word.begin(), word.end(), keyword.begin(),
                                                       [](char a, char b) { return (a | 0x20) == b; });
  }

  MeshFile parse() {
    while (lines_.nextFullLine()) {
      while (!lines_.atLineEnd()) statement(lines_.word());
    }
    if (inSolid_) {
      lines_.fail("the file ends after " + std::to_string(triangles_) +
                  " triangles without 'endsolid'; it is truncated, export or copy it again");
    }
    return builder_.finish();
  }

 private:
  void statement(std::string_view word) {
    if (is(word, "vertex")) {
      addVertex();
    } else if (is(word, "endloop")) {
      endLoop();
    } else if (is(word, "facet")) {
      // The normal is the triangle's own business; exporters write anything there, NaN included.
      lines_.skipLine();
    } else if (is(word, "outer")) {
      lines_.word();
      corners_ = 0;
      inLoop_ = true;
    } else if (is(word, "solid") || is(word, "endsolid")) {
      if (inLoop_) lines_.fail(excerpt(word) + " inside a loop; the file is damaged, export it again");
      inSolid_ = is(word, "solid");
      lines_.skipLine();
    } else if (!is(word, "endfacet")) {
      lines_.fail(excerpt(word) + " is no word of a text STL; the file is damaged, export it again");
    }
  }

  void addVertex() {
    const Item vertex{"triangle", triangles_ + 1};
    const double x = lines_.number(vertex), y = lines_.number(vertex), z = lines_.number(vertex);
    if (!inLoop_ || ++corners_ > 3) {
      lines_.fail("triangle " + std::to_string(triangles_ + 1) +
                  ": a vertex that is not one of three inside a loop; the file is damaged, export it again");
    }
    builder_.addVertex({x, y, z});
  }

  void endLoop() {
    if (!inLoop_ || corners_ != 3) {
      lines_.fail("triangle " + std::to_string(triangles_ + 1) + " has " + std::to_string(corners_) +
                  " vertices instead of 3; the file is damaged, export it again");
    }
    inLoop_ = false;
    ++triangles_;
    addOwnTriangle(builder_, lines_.line());
  }

  const MeshSource& source_;
  TextLines lines_;
  SurfaceBuilder builder_;
  std::size_t triangles_ = 0, corners_ = 0;
  bool inLoop_ = false, inSolid_ = false;
};

}  // namespace

bool hasBinaryStlSize(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes) return false;
  return bytes.size() ==
         kHeaderBytes + kTriangleBytes * std::uint64_t{fromBytes<std::uint32_t>(bytes.data() + 80)};
}

MeshFile parseStl(const MeshSource& source) {
  // Binary files may begin with "solid" too: their size tells, and so does a zero byte, which no text has.
  const std::string_view bytes = source.bytes;
  const bool binary = hasBinaryStlSize(bytes) || bytes.substr(0, 1024).find('\0') != bytes.npos;
  const std::string_view start = bytes.substr(0, bytes.find_first_not_of(" \t\r\n"));
  const bool text = TextStl::is(bytes.substr(start.size(), 5), "solid");
  return !binary && text ? TextStl(source).parse() : parseBinary(source);
}

}  // namespace polestar::detail
