#pragma once
// Ways from shape to shape: where the nodes of the complex lie at given weights, and how fast they move.

#include <memory>
#include <span>
#include <vector>

#include "polestar/morph/morph_complex.h"
#include "polestar/morph/morph_timeline.h"

namespace polestar {

enum class PathKind {
  /// Every point runs straight from shape to shape, but for the blend of their rotations.
  straight,
  /// x = g(h): g the radial map of the star-shaped solid whose radius in every direction is the geometric
  /// mean
  /// of the shapes' radii, h the mean of the balls that the shapes are by their own radial maps. Surfaces are
  /// star-shaped all the way, and the mean is taken in a convex ball, of maps that are near each other.
  radial
};
/// "straight" or "radial".
const char* toString(PathKind kind);

/// The complex at some weights.
struct MorphPose {
  Vec3 center = Vec3::Zero();  ///< mesh units
  std::vector<Vec3> nodes;     ///< from the center, mesh units
};

/// A pose, and its motion.
struct MorphFrame {
  std::vector<double> weights;
  MorphPose pose;
  Mending mending;                     ///< of the pose
  Vec3 centerVelocity = Vec3::Zero();  ///< mesh units a second
  std::vector<Vec3> velocity;          ///< of the nodes: dx/dt where the ball coordinates stay
};

/// Cheap to copy, immutable, safe from many threads.
class MorphPath {
 public:
  MorphPath(MorphComplex complex, PathKind kind);

  PathKind kind() const;
  const MorphComplex& complex() const;

  /// One weight a shape. Straight: some ns a node and shape; radial: a look-up in the surface of every shape
  /// that has a weight, about 0.5 us.
  MorphPose pose(std::span<const double> weights) const;
  /// The pose with its cells mended where few are inverted, and its derivative (of the pose as it was), by
  /// symmetric differences of a thousandth of a frame: to 1e-6 of the velocity. Where weights turn from one
  /// passage into the next, the mean of both sides.
  /// @throws Error{Errc::cancelled}
  MorphFrame frame(const MorphTimeline& timeline, double frame, double framesPerSecond,
                   const Context& context = Context::quiet()) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

/// The surface of a pose: the same triangles, in the same order, at all weights. Mesh units.
TriMesh surfaceOf(const MorphComplex& complex, const MorphPose& pose);

}  // namespace polestar
