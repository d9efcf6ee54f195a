// Geomview's Object File Format: "[ST][C][N]OFF", the counts, a line a vertex, a line a face.
#include <algorithm>

#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/detail/surface_builder.h"
#include "polestar/mesh/detail/text_lines.h"

namespace polestar::detail {
namespace {

struct Counts {
  std::int64_t vertices, faces;
};

[[noreturn]] void failTruncated(TextLines& lines, const char* kind, std::int64_t found,
                                std::int64_t claimed) {
  lines.fail("the file ends after " + std::to_string(found) + " of " + std::to_string(claimed) + " " + kind +
             "; it is truncated, export or copy it again");
}

/// Leaves `lines` behind the counts. The keyword may be missing; the counts may stand beside it or below.
Counts readHeader(const MeshSource& source, TextLines& lines) {
  if (!lines.nextFullLine()) source.fail("it holds no data; export it again");
  TextLines afterKeyword = lines;
  const std::string_view keyword = afterKeyword.word();
  if (isOffKeyword(keyword)) {
    if (keyword.find_first_of("4n") != keyword.npos) {
      lines.fail(excerpt(keyword) + " has points of other than three coordinates; export a surface in space");
    }
    lines = afterKeyword;
    if (lines.atLineEnd() && !lines.nextFullLine())
      source.fail("it ends after its first line; export it again");
    TextLines ahead = lines;
    if (ahead.word() == "BINARY") lines.fail("binary OFF is not read; export it as text, or as PLY");
  } else if (keyword.find_first_not_of("0123456789") != keyword.npos) {
    lines.fail("begins with " + excerpt(keyword) + " where OFF or the counts are due; is it an OFF file?");
  }
  const std::int64_t vertices = lines.integer({"number of vertices", 1}),
                     faces = lines.integer({"number of faces", 1});
  if (vertices < 0 || faces < 0) lines.fail("negative counts; the file is damaged, export it again");
  return {vertices, faces};  // the number of edges may follow; nobody fills it in reliably
}

}  // namespace

bool isOffKeyword(std::string_view word) {
  if (!word.ends_with("OFF")) return false;
  word.remove_suffix(3);
  if (word.starts_with("ST")) word.remove_prefix(2);
  for (const char letter : {'C', 'N', '4', 'n'}) {
    if (word.starts_with(letter)) word.remove_prefix(1);
  }
  return word.empty();
}

MeshFile parseOff(const MeshSource& source) {
  TextLines lines(source, {.comment = '#'});
  const Counts claimed = readHeader(source, lines);
  SurfaceBuilder builder(source, {"off", 0, "line"});
  // A line has two bytes at least: no claim reserves more than the file can fill.
  const auto most = static_cast<std::int64_t>(source.bytes.size() / 6);
  builder.reserve(std::min(claimed.vertices, most), std::min(claimed.faces, most));
  for (std::int64_t i = 0; i < claimed.vertices; ++i) {
    if (!lines.nextFullLine()) failTruncated(lines, "vertices", i, claimed.vertices);
    const Item vertex{"vertex", static_cast<std::size_t>(i) + 1};
    const double x = lines.number(vertex), y = lines.number(vertex), z = lines.number(vertex);
    builder.addVertex({x, y, z});  // normal, color and texture coordinates may follow
  }
  std::vector<std::int64_t> corners;
  for (std::int64_t i = 0; i < claimed.faces; ++i) {
    if (!lines.nextFullLine()) failTruncated(lines, "faces", i, claimed.faces);
    const Item face{"face", static_cast<std::size_t>(i) + 1};
    const std::int64_t count = lines.integer(face);
    if (count < 1)
      lines.fail("face " + std::to_string(face.number) + " has " + std::to_string(count) + " corners");
    corners.clear();
    // Each corner is read before the next is made room for: a claimed count costs nothing.
    for (std::int64_t k = 0; k < count; ++k) corners.push_back(lines.integer(face));
    builder.addFace(corners, lines.line());  // a color may follow
  }
  if (lines.nextFullLine()) {
    lines.fail("more lines than the header's " + std::to_string(claimed.vertices) + " vertices and " +
               std::to_string(claimed.faces) + " faces; correct the counts or export the file again");
  }
  return builder.finish();
}

}  // namespace polestar::detail
