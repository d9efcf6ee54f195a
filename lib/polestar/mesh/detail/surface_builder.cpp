#include "polestar/mesh/detail/surface_builder.h"

#include <limits>
#include <utility>

#include "polestar/mesh/detail/triangulate.h"

namespace polestar::detail {
namespace {

constexpr std::int64_t kMostVertices = std::numeric_limits<std::int32_t>::max();

}  // namespace

void SurfaceBuilder::reserve(std::size_t vertices, std::size_t triangles) {
  vertices_.reserve(vertices);
  triangles_.reserve(triangles);
}

void SurfaceBuilder::addFace(std::span<const std::int64_t> corners, std::size_t place) {
  if (corners.size() == 3) {
    triangles_.push_back(
        {checked(corners[0], place), checked(corners[1], place), checked(corners[2], place)});
  } else {
    addPolygon(corners, place);
  }
}

void SurfaceBuilder::addPolygon(std::span<const std::int64_t> corners, std::size_t place) {
  const std::size_t begin = polygonCorners_.size();
  for (const std::int64_t corner : corners) {
    const std::int32_t index = checked(corner, place);
    if (polygonCorners_.size() == begin || polygonCorners_.back() != index) polygonCorners_.push_back(index);
  }
  while (polygonCorners_.size() > begin + 1 && polygonCorners_.back() == polygonCorners_[begin]) {
    polygonCorners_.pop_back();
  }
  const std::size_t size = polygonCorners_.size() - begin;
  if (size > 3) {
    polygons_.push_back({triangles_.size(), begin, size, place});
    return;
  }
  const std::int32_t* kept = polygonCorners_.data() + begin;
  if (size == 3) triangles_.push_back({kept[0], kept[1], kept[2]});
  polygonCorners_.resize(begin);
}

std::int32_t SurfaceBuilder::checked(std::int64_t index, std::size_t place) {
  if (index < 0 || index >= kMostVertices) failIndex(index, place);
  const auto narrow = static_cast<std::int32_t>(index);
  if (narrow > largestIndex_) {
    largestIndex_ = narrow;
    largestIndexPlace_ = place;
  }
  return narrow;
}

void SurfaceBuilder::failIndex(std::int64_t index, std::size_t place) const {
  const std::int64_t first = habits_.firstIndex, count = static_cast<std::int64_t>(vertices_.size());
  std::string range =
      count == 0 ? "there are no vertices"
                 : "vertices run from " + std::to_string(first) + " to " + std::to_string(first + count - 1);
  // While the file is being read more vertices may follow; then only what no file can hold is an error.
  if (index < 0 || index >= kMostVertices) range = "no vertex can have that number";
  const std::int64_t shown = index < kMostVertices ? index + first : index;
  source_.fail(std::string(habits_.place) + " " + std::to_string(place) + ": a face names vertex " +
               std::to_string(shown) + ", but " + range + "; the file is damaged, export it again");
}

MeshFile SurfaceBuilder::finish() {
  if (largestIndex_ >= 0 && static_cast<std::size_t>(largestIndex_) >= vertices_.size()) {
    failIndex(largestIndex_, largestIndexPlace_);
  }
  if (triangles_.empty() && polygons_.empty()) {
    source_.fail(vertices_.empty() ? "it holds neither vertices nor faces; is it a surface mesh (" +
                                         std::string(habits_.format) + ")?"
                                   : "it holds " + std::to_string(vertices_.size()) +
                                         " vertices but no faces; export the surface, not its points");
  }
  MeshFile file;
  file.format = habits_.format;
  file.polygons = polygons_.size();
  if (!polygons_.empty()) {
    std::vector<Triangle> all;
    all.reserve(triangles_.size() + polygonCorners_.size());
    std::size_t copied = 0;
    Triangulator cut(vertices_);
    for (const Polygon& polygon : polygons_) {
      all.insert(all.end(), triangles_.begin() + copied, triangles_.begin() + polygon.before);
      copied = polygon.before;
      if (!cut({polygonCorners_.data() + polygon.begin, polygon.size}, all)) {
        source_.fail(
            std::string(habits_.place) + " " + std::to_string(polygon.place) + ": a polygon of " +
            std::to_string(polygon.size) +
            " corners is too intricate to be cut into triangles; triangulate the mesh before exporting it");
      }
    }
    all.insert(all.end(), triangles_.begin() + copied, triangles_.end());
    triangles_ = std::move(all);
  }
  file.mesh.vertices = std::move(vertices_);
  file.mesh.triangles = std::move(triangles_);
  return file;
}

}  // namespace polestar::detail
