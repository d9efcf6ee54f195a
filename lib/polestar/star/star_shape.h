#pragma once
// Star-ness and the center. [Xia 2010, sec. 4.1, step 1 and lemma 1, with face normals instead of vertex
// normals and strict inequalities: see docs/method.md]
//
// A solid is star-shaped about c when c lies strictly inside the half-space of every face. The set of all
// such c is the kernel of the polyhedron. Verdicts are exact (orient3d of every face with c), candidates for
// c come from a linear program (largest margin) and a quadratic one (closest to the centroid at a share of
// that margin).

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/frame.h"
#include "polestar/mesh/closed_surface.h"

namespace polestar {

struct StarOptions {
  /// Use this center (mesh units) instead of searching; it is verified like any other.
  std::optional<Vec3> center;
  /// The chosen center keeps at least this share of the largest possible margin, in (0, 1]: a center on the
  /// kernel's rim makes a degenerate map.
  double marginShare = 0.25;
  /// Rays over the sphere for the independent count by Embree, besides one through every face; 0: none at
  /// all.
  int rays = 10000;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Lengths and points in mesh units.
struct StarReport {
  /// Exact: `center` is strictly inside every face's half-space, for the given coordinates and for those of
  /// StarShape::mesh(), and the surface winds around it once.
  bool star = false;
  Vec3 center = Vec3::Zero();  ///< the chosen center; when not star: the least bad one found
  double centerMargin = 0;     ///< smallest distance from `center` to a face's plane (negative: behind it)
  double margin = 0;  ///< largest such distance over all points: radius of the kernel's inscribed ball
  double marginRelative = 0;  ///< margin over the diagonal of the bounding box
  /// When no point is a center: at most 4 faces whose half-spaces share no point. Empty when only the given
  /// center fails, and when the largest margin is 0 up to rounding.
  std::vector<std::int32_t> witnessFaces;
  double badAreaFraction = 0;  ///< share of the surface that `center` does not see from inside
  /// Where to look: of the largest patch of such faces, the centroid of the face that `center` lies farthest
  /// behind.
  Vec3 badPlace = Vec3::Zero();
  struct Rays {
    std::size_t count = 0;   ///< rays from `center`, whole length
    std::size_t failed = 0;  ///< rays that did not meet the surface exactly once (single precision: evidence)
  } rays;

  std::string reason;  ///< when not star: what, where and what to do, on one or two lines
};

/// Decides star-ness and finds the center. "No" is data, not an exception.
/// Cost O(n) for a few dozen passes over the faces; 1M faces well under a second besides the rays.
StarReport inspectStar(const ClosedSurface& surface, const StarOptions& options = {},
                       Context& context = Context::quiet());

/// A solid with a verified center. Cheap to copy.
class StarShape {
 public:
  /// Surface in the inner frame: the center is the origin, the farthest vertex has distance 1. The exact star
  /// test holds for these very coordinates.
  const TriMesh& mesh() const { return data_->mesh; }
  const Frame& frame() const { return data_->frame; }
  const StarReport& report() const { return data_->report; }
  /// The verified input, mesh units.
  const ClosedSurface& surface() const { return data_->surface; }

 private:
  struct Data {
    TriMesh mesh;
    Frame frame;
    StarReport report;
    ClosedSurface surface;
  };
  friend StarShape verifyStarShape(const ClosedSurface&, const StarOptions&, Context&);
  explicit StarShape(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

/// The only way to a StarShape.
/// @throws Error{Errc::notStarShaped} with StarReport::reason as its message.
StarShape verifyStarShape(const ClosedSurface& surface, const StarOptions& options = {},
                          Context& context = Context::quiet());

}  // namespace polestar
