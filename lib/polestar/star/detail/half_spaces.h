#pragma once
// The half-spaces whose intersection is the kernel of a polyhedron, laid out for fast scans.

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "polestar/core/frame.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

/// Points c with normal . c <= offset; |normal| = 1. A face without a normal (zero area) has normal 0 and an
/// offset that no point violates: what it says about star-ness is for the exact predicates.
struct HalfSpace {
  Vec3 normal;
  double offset;
  double slack(const Vec3& c) const { return offset - normal.dot(c); }
};

/// A face and the signed distance of a point to its plane, positive inside.
struct FaceSlack {
  std::int32_t face = -1;
  double slack = 0;
};

/// Frame about the center of the bounding box whose unit is the power of two at or above its diagonal:
/// scaling by it rounds nothing, and no tolerance depends on the user's units.
Frame workingFrame(const TriMesh& mesh);

/// One half-space a face, in the coordinates of `frame`, as separate arrays of components.
class HalfSpaces {
 public:
  /// Every `stride`-th face. Normals come from differences of the original coordinates at the corner between
  /// the two shortest sides, in doubled precision for needles. O(n), parallel.
  HalfSpaces(const TriMesh& mesh, const Frame& frame, std::size_t stride = 1);

  std::size_t size() const { return static_cast<std::size_t>(offset_.size()); }
  HalfSpace operator[](std::size_t i) const { return {Vec3(x_[i], y_[i], z_[i]), offset_[i]}; }
  double area(std::size_t i) const { return area_[i]; }  ///< of face i, in squared units of the frame
  double totalArea() const { return totalArea_; }

  /// The face with the smallest slack, the first one of several.
  FaceSlack tightest(const Vec3& c) const;
  /// The tightest face of every chunk of kChunk faces: good cuts from many places for the price of one scan.
  std::vector<FaceSlack> tightestPerChunk(const Vec3& c) const;
  /// Area of the faces with slack <= 0, by rounded arithmetic; serial, so that callers can evaluate many
  /// points at once.
  double areaBehind(const Vec3& c) const;

  static constexpr std::size_t kChunk = 4096;

 private:
  FaceSlack tightestIn(std::size_t begin, std::size_t end, const Vec3& c) const;

  // Not std::vector: first touched in parallel, not zeroed by one thread.
  Eigen::ArrayXd x_, y_, z_, offset_, area_;
  double totalArea_ = 0;
};

}  // namespace polestar::detail
