#pragma once
// The sphere map and the radius that distort cells least, iso-surfaces of G and field lines untouched.
//
// f = s(R) A(omega) has two freedoms: a monotone radius s and the sphere map A. Over the cells of the
// foliation, weighted by their volume in the solid, both are chosen to minimize
//
//     |J|^2 / (3 det J^(2/3))  +  volumeWeight (ln(det J V / V_ball))^2,
//
// the volumetric MIPS measure (1 where f is a similarity) and the spread of the volume ratio. The core, where
// A turns into a rotation, is left out of account: it holds a hundredth of the volume.

#include "polestar/chart/green_chart.h"
#include "polestar/map/radius_profile.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar {

struct BalanceOptions {
  double volumeWeight = 0.03;  ///< 0: angles alone; 0.03 to 0.1 even volumes out at little cost in angles
  int rounds = 3;              ///< of the sphere map and the radius in turn; 0: the radius alone
  int stepsPerRound = 8;       ///< of the descent of the sphere map

  void validate() const;  ///< @throws Error{Errc::usage}
};

struct BalancedMap {
  SphereMap sphere;  ///< kind `balanced`; the start where that has flips or nothing could be moved
  RadiusProfile radius;
  double before = 0, after = 0;  ///< the energy, with s = R or the fixed radius at the start
};

/// Minimizes over both freedoms, from `start`; over the radius alone when the start has flips or
/// `options.rounds` is 0, over the sphere map alone when `fixedRadius` is given.
///
/// At fixed s every column of cells under a triangle of the surface is a function of that triangle's image
/// with a dozen coefficients, at fixed A every layer a function of two values of s: the foliation is read
/// once a half round, about 0.1 us a cell, and everything else is small. Inverted and flat cells do not
/// count. Same bytes for any number of threads.
/// @throws Error{Errc::cancelled}
BalancedMap balanceMap(const GreenChart& chart, const SphereMap& start, const RadiusProfile* fixedRadius,
                       const BalanceOptions& options = {}, const Context& context = Context::quiet());

}  // namespace polestar
