#pragma once
// The panels of a soccer ball: faces of the truncated icosahedron, projected from its center.

#include "polestar/core/types.h"

namespace polestar {

/// The soccer panel that a direction lies in, and the seam that is nearest.
struct SoccerPanel {
  int index = 0;            ///< 0..11 pentagons, 12..31 hexagons
  int neighbour = 0;        ///< the panel beyond the nearest seam
  double seamDistance = 0;  ///< sine of the angle to the great circle of the nearest seam, >= 0
  Vec3 seamNormal =
      Vec3::Zero();  ///< of that great circle, unit, towards the panel: seamDistance = direction . seamNormal
  bool pentagon() const { return isPentagon(index); }
  static bool isPentagon(int panel) { return panel < 12; }
};

/// Exact: the panels are those of the solid's edges, projected from its center. `direction` need not have
/// unit length.
SoccerPanel soccerPanel(const Vec3& direction);

}  // namespace polestar
