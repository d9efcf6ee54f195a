#pragma once
// Expansions of potentials in real solid harmonics: the alphabet of the fast multipole method.
//
// Basis, for degree n, order m: r^n sqrt((2 - [m = 0]) (n - m)!/(n + m)!) P_n^m(cos theta) times cos(m phi)
// or sin(m phi) (Racah's normalization; P without the sign of Condon and Shortley). With it
//
//     1/|x - y| = sum_i R_i(y) R_i(x) / |x|^(2n+1)   for |y| < |x|,
//
// rotations act by orthogonal matrices on each degree, and no factorial ever overflows. Coefficients of
// degree n lie at n^2: first cos for m = 0 .. n, then sin for m = 1 .. n.

#include <cstddef>
#include <span>

#include "polestar/core/types.h"

namespace polestar::detail {

constexpr int kMaxOrder = 28;

/// Coefficients of an expansion up to degree `order`.
constexpr std::size_t expansionSize(int order) { return static_cast<std::size_t>((order + 1) * (order + 1)); }

/// Points as separate coordinates, as SIMD loops want them.
struct PointView {
  const double *x, *y, *z;
  std::size_t count;
};

/// The unit cube of an expansion: coordinates in it are (p - center) / scale.
struct ExpansionFrame {
  Vec3 center;
  double scale;
};

/// Adds the multipole coefficients of charges near the center: sum of q R_i. Potential of them far away:
/// (1/scale) sum_i M_i R_i(x)/|x|^(2n+1).
void addMultipole(int order, const ExpansionFrame& frame, const PointView& points, const double* charge,
                  double* multipole);

/// Adds the local coefficients of charges away from the center: their potential near it is
/// (1/scale) sum_i L_i R_i(x).
void addLocal(int order, const ExpansionFrame& frame, const PointView& points, const double* charge,
              double* local);

/// Adds the potential of a local expansion at points.
void addLocalPotential(int order, const ExpansionFrame& frame, const double* local, const PointView& points,
                       double* potential);

/// The same with the gradient.
void addLocalPotentialAndGradient(int order, const ExpansionFrame& frame, const double* local,
                                  std::span<const Vec3> points, double* potential, Vec3* gradient);

/// All R_i at a point, by the definition; for building operators and for tests.
void solidHarmonics(int order, const Vec3& point, double* values);

}  // namespace polestar::detail
