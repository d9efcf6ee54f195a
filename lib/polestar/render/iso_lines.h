#pragma once
// Curves of constant coordinates, drawn over whatever the solid looks like: constant in width on the screen,
// thinner and then gone where they would come too close.

#include "polestar/core/types.h"

namespace polestar {

struct IsoLines {
  bool radius = false;     ///< on cuts: R = k/10, and finer ones where those lie far apart
  bool graticule = false;  ///< on the skin: longitudes and latitudes of the ball, every 15 degrees
  bool skinSeams = false, cutSeams = false;        ///< of the soccer ball's panels
  Vec3f color = Vec3f(0.0110f, 0.0144f, 0.0331f);  ///< scene-linear
  double pixels = 2;                               ///< their width on the screen, > 0

  bool any() const { return radius || graticule || skinSeams || cutSeams; }
};

/// Ball coordinates around a place on the solid, as a pixel sees it.
struct BallFootprint {
  Vec3 ball = Vec3::Zero();
  Vec3 overFirst = Vec3::Zero(), overSecond = Vec3::Zero();  ///< change over the pixel along two tangents
  bool skin = true;
};

/// The share of what is seen that the lines cover, in [0, 1]. `share`: the part of the pixel, in length, that
/// is to be averaged over.
double isoLineCoverage(const IsoLines& lines, const BallFootprint& at, double share);

}  // namespace polestar
