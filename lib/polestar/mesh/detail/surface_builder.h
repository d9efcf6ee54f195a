#pragma once
// Collects what a reader finds and turns it into triangles: the place where indices are checked and polygons
// are cut.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "polestar/mesh/detail/mesh_source.h"
#include "polestar/mesh/read_mesh.h"

namespace polestar::detail {

/// How a format counts and how its places are named, for messages.
struct FormatHabits {
  const char* format;
  int firstIndex;     ///< index of the first vertex in the file's own counting
  const char* place;  ///< "line" or "byte"
};

class SurfaceBuilder {
 public:
  SurfaceBuilder(const MeshSource& source, FormatHabits habits) : source_(source), habits_(habits) {}

  void reserve(std::size_t vertices, std::size_t triangles);
  void addVertex(const Vec3& v) { vertices_.push_back(v); }
  std::size_t vertexCount() const { return vertices_.size(); }

  /// A face by vertex indices counted from 0, found at line or byte `place`; it may name vertices that follow
  /// later. Corners repeated in succession count once; what has fewer than three corners then bounds no area
  /// and is passed over, except that a face written with three corners is kept for repairMesh to count.
  /// @throws Error{Errc::io} for an index below 0 or beyond 31 bits.
  void addFace(std::span<const std::int64_t> corners, std::size_t place);

  /// Checks the indices and cuts the polygons. @throws Error{Errc::io}
  MeshFile finish();

 private:
  struct Polygon {
    std::size_t before;  ///< triangles ahead of it in the file
    std::size_t begin, size;
    std::size_t place;
  };
  std::int32_t checked(std::int64_t index, std::size_t place);
  void addPolygon(std::span<const std::int64_t> corners, std::size_t place);
  [[noreturn]] void failIndex(std::int64_t index, std::size_t place) const;

  const MeshSource& source_;
  FormatHabits habits_;
  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<std::int32_t> polygonCorners_;
  std::vector<Polygon> polygons_;
  std::int32_t largestIndex_ = -1;
  std::size_t largestIndexPlace_ = 0;
};

}  // namespace polestar::detail
