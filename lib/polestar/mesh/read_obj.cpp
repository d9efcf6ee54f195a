// Wavefront OBJ: lines "v x y z" and "f a/t/n b/t/n ..."; everything else describes no surface and is passed
// over.
#include <algorithm>

#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/detail/surface_builder.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar::detail {
namespace {

/// Index from 0 of a corner: OBJ counts from 1, or backwards from the latest vertex.
std::int64_t cornerIndex(TextLines& lines, const Item& face, std::size_t vertexCount) {
  const std::int64_t index = lines.integer(face, true);
  if (index > 0) return index - 1;
  const auto count = static_cast<std::int64_t>(vertexCount);
  if (index == 0 || index < -count) {
    lines.fail("face " + std::to_string(face.number) + ": a corner names vertex " + std::to_string(index) +
               ", but " + std::to_string(count) +
               " vertices stand above it (1 is the first, -1 the last); export the file again");
  }
  return index + count;
}

}  // namespace

MeshFile parseObj(const MeshSource& source) {
  SurfaceBuilder builder(source, {"obj", 1, "line"});
  TextLines lines(source, {.comment = '#', .continuation = true});
  std::vector<std::int64_t> corners;
  std::size_t faces = 0;
  while (lines.nextLine()) {
    const std::string_view keyword = lines.word();
    if (keyword == "v") {
      const Item vertex{"vertex", builder.vertexCount() + 1};
      const double x = lines.number(vertex), y = lines.number(vertex), z = lines.number(vertex);
      builder.addVertex({x, y, z});
    } else if (keyword == "f") {
      ++faces;
      corners.clear();
      while (!lines.atLineEnd())
        corners.push_back(cornerIndex(lines, {"face", faces}, builder.vertexCount()));
      if (corners.empty())
        lines.fail("face " + std::to_string(faces) + " has no corners; export the file again");
      builder.addFace(corners, lines.line());
    }
  }
  return builder.finish();
}

}  // namespace polestar::detail
