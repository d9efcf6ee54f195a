#pragma once
// A picture of ball coordinates: the panels of a soccer ball (truncated icosahedron) along directions, times
// bands between the spheres R = k/10 along radii. A direction keeps its panel all the way to the center, so
// on a cut the panels' seams are the curves of constant direction, and the bands' edges those of constant
// radius.

#include "polestar/core/types.h"

namespace polestar {

/// Colors of the pattern and its surroundings, scene-linear.
struct Palette {
  Palette();
  Vec3f hexagon, pentagon;            ///< skin
  Vec3f hexagonRim, pentagonRim;      ///< the outermost band of a cut
  Vec3f hexagonCore, pentagonCore;    ///< what they turn into towards the center
  Vec3f hexagonShade, pentagonShade;  ///< of which every other band gets a touch
  Vec3f core;                         ///< the ball R < 1/10
  Vec3f pole;                         ///< a dot at the center
  Vec3f line;                         ///< seams and iso-lines
  Vec3f background;
  Vec3f unmapped;  ///< where the map gives NaN
};

/// Where the pattern is asked for: ball coordinates and how they change along two perpendicular unit tangents
/// of the surface or cut that is seen. Lengths in any one unit.
struct PatternPoint {
  Vec3 ball = Vec3::Zero();
  Vec3 alongFirst = Vec3::Zero(), alongSecond = Vec3::Zero();  ///< d ball / d length
  double pixel = 0;                                            ///< size of a pixel there, same unit of length
  double lineWidth = 0;                                        ///< of the iso-lines, same unit
};

struct PatternValue {
  Vec3f albedo = Vec3f::Zero();
  double slopeFirst = 0,
         slopeSecond = 0;  ///< of the groove along a seam, height over length along the tangents
};

/// Color of the outer surface: panels and their seams, which are grooves too.
PatternValue skinPattern(const PatternPoint& point, const Palette& palette);

/// Color on a cut: panels x bands, seams and iso-lines at R = k/10, finer ones where those lie far apart.
/// Lines get thinner, then the pattern gives way to its
/// mean color, where bands or panels come to lie closer than a few pixels.
PatternValue cutPattern(const PatternPoint& point, const Palette& palette);

}  // namespace polestar
