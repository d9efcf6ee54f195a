#include "shapes.h"

#include "polestar/mesh/shapes.h"
#include "support/solids.h"

namespace polestar::testing {

const BallMap& lobes() {
  static const BallMap map = ballMap(starShape(smoothStar(3), Vec3(0, 0, 0)));
  return map;
}

const BallMap& waist() {
  static const BallMap map = [] {
    TriMesh mesh =
        radialShape(3, [](const Vec3& d) { return 0.7 + 0.5 * d.x() * d.x() + 0.1 * d.y() * d.z(); });
    for (Vec3& vertex : mesh.vertices) vertex += Vec3(3, 1, 0);
    return ballMap(starShape(mesh, Vec3(3, 1, 0)));
  }();
  return map;
}

BallMap movedLobes(const Mat3& turn, double scale, const Vec3& shift) {
  return ballMap(starShape(
      transformed(smoothStar(3), [&](const Vec3& x) { return Vec3(scale * (turn * x) + shift); }), shift));
}

MorphOptions coarse() { return {.surfaceTolerance = 0.02, .largestAngle = 0.3}; }

Mat3 skewTurn() { return Eigen::AngleAxisd(1.75, Vec3(1, 2, -1).normalized()).toRotationMatrix(); }

}  // namespace polestar::testing
