#pragma once
// Curves of constant coordinates, drawn over whatever the solid looks like: constant in width on the screen,
// thinner and then gone where they would come too close.

#include "polestar/core/types.h"
#include "polestar/render/lattice.h"

namespace polestar {

struct IsoLines {
  bool radius = false;     ///< on cuts: R = k/10, and finer ones where those lie far apart
  bool graticule = false;  ///< on the skin: longitudes and latitudes of the ball, every 15 degrees
  bool skinSeams = false, cutSeams = false;  ///< of the soccer ball's panels
  bool lattice = false;  ///< of a domain of cells: its planes, and bolder ones where the domain has edges
  Vec3f color = Vec3f(0.0110f, 0.0144f, 0.0331f);  ///< scene-linear
  double pixels = 2;                               ///< their width on the screen, > 0

  bool ofBall() const { return radius || graticule || skinSeams || cutSeams; }
};

/// Coordinates around a place on the solid, as a pixel sees it.
struct CoordinateFootprint {
  Vec3 place = Vec3::Zero();                                 ///< in the ball or in another domain
  Vec3 overFirst = Vec3::Zero(), overSecond = Vec3::Zero();  ///< change over the pixel along two tangents
  bool skin = true;
};

/// The share of what is seen that the lines of the ball cover, in [0, 1]. `share`: the part of the pixel, in
/// length, that is to be averaged over.
double isoLineCoverage(const IsoLines& lines, const CoordinateFootprint& at, double share);

/// The same for the planes of a lattice, `at` in the domain's frame; on the skin a place of its surface.
double latticeLineCoverage(const IsoLines& lines, const Lattice& lattice, const CoordinateFootprint& at,
                           double share);

}  // namespace polestar
