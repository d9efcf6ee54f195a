#pragma once
// Green's functions in closed form: the oracles of the solver. G = 1/|x - a| + h, G = 0 on the boundary.

#include "polestar/core/types.h"

namespace polestar::testing {

/// Unit ball about the origin, pole `a` inside: one image. [Kelvin]
struct BallGreen {
  Vec3 pole;
  double h(const Vec3& x) const;
  double green(const Vec3& x) const;
  double harmonicRadius() const { return 1 - pole.squaredNorm(); }
  /// Density of harmonic measure at a boundary point: the Poisson kernel.
  double harmonicMeasure(const Vec3& x) const;
  /// Constant along field lines: charges 1 at the pole and -1/|a| at its image, seen along their axis
  /// (Stokes).
  double streamFunction(const Vec3& x) const;
};

/// Upper half of the unit ball, z > 0: the ball's function minus that of the pole mirrored at z = 0.
struct HalfBallGreen {
  Vec3 pole;
  double green(const Vec3& x) const;
  double harmonicRadius() const;
};

/// Cube [-1, 1]^3: a lattice of images with alternating signs, summed by cells of eight, whose fields fall
/// off like r^-4.
struct CubeGreen {
  Vec3 pole;
  double h(const Vec3& x) const;
  double green(const Vec3& x) const { return 1 / (x - pole).norm() + h(x); }
  double harmonicRadius() const { return -1 / h(pole); }
};

inline double ballRadius(double green, double harmonicRadius) { return 1 / (1 + harmonicRadius * green); }

}  // namespace polestar::testing
