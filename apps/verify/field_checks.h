#pragma once
// What Green's function has to do with `rest`, measured at voxels: by finite differences, quantiles over many
// places, and identities that hold point by point.

#include "voxel_solid.h"

namespace polestar::verify {

struct PoleFit {
  bool inside = false;    ///< a voxel within one step of the center is inside
  double restOffset = 0;  ///< how far from the center |rest| has its least value, voxels
  double ratio = 0;       ///< rho by h = G - 1/r around the center, over the rho of the file
};
/// Both by least squares over a few voxels around the center.
PoleFit fitPole(const VoxelSolid& solid);

struct BoundaryFit {
  std::size_t rim = 0;         ///< inside voxels beside an outside one
  std::size_t tooDeep = 0;     ///< of them: `surface` says farther below the surface than they can be
  double median = 0, low = 0;  ///< |rest| continued to the surface; `low` is exceeded by 99 %
};
/// |rest| at two neighbours at different depths by `surface`, continued linearly to where that is 0.
BoundaryFit fitBoundary(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth);

struct RadiusFit {
  std::size_t voxels = 0;
  double worst = 0;  ///< of | |rest| - 1/(1 + rho G) |, or for other radii of how far |rest| falls as G falls
  std::size_t at = 0;
};
/// Voxels where G is cut at the pole only need to be near it.
RadiusFit fitRadius(const VoxelSolid& solid);

struct HarmonicFit {
  std::size_t places = 0;
  double median = 0, most = 0;  ///< the latter exceeded at 2 % of the places
};
/// rho |mean of h over 26 points around - h|, with weights for which harmonic polynomials of degree below 8
/// cancel, on cubes that reach half way to the surface: the table of a map interpolates by cells, and second
/// differences over single voxels would see its kinks and little else.
HarmonicFit fitHarmonic(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth);

struct LineFit {
  std::size_t places = 0;
  /// Medians of angles in degrees to grad G: of the iso-curves of rest/|rest|, and of straight rays;
  /// everywhere, and at the tenth of the places where straight rays are worst.
  double median = 0, straight = 0, bentMedian = 0, bentStraight = 0;
};
/// Outside the core and farther than four voxels from the pole; central
/// differences.
LineFit fitLines(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth);

}  // namespace polestar::verify
