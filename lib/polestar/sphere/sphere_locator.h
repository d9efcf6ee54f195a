#pragma once
// Which triangle of a triangulated sphere does a direction meet? Asked of the surface seen from its center
// (is a point inside; where does a ray leave), of phi (inverse map) and of omega (exact forward map).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// Triangles that cover the sphere of directions once. Vertices may have any positive length.
class SphereLocator {
 public:
  /// Copies directions and triangles. Triangles that are not positively oriented are never found.
  SphereLocator(std::span<const Vec3> directions, std::vector<Triangle> triangles);
  ~SphereLocator();
  SphereLocator(SphereLocator&&) noexcept;
  SphereLocator& operator=(SphereLocator&&) noexcept;

  struct Hit {
    std::size_t triangle;
    Vec3 weights;  ///< barycentric: sum_i weights_i direction_i is parallel to the query; they sum to 1
  };
  /// Nearest triangle within rounding; nothing where the triangles leave a gap. O(log n). Thread-safe.
  std::optional<Hit> locate(const Vec3& direction) const;

  /// sum_i weights_i direction_i of a hit.
  Vec3 point(const Hit& hit) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace polestar
