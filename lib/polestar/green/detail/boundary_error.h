#pragma once
// How far a computed Green's function is from 0 on the surface: the error measure that all solvers share.

#include <functional>
#include <span>
#include <vector>

#include "polestar/green/green_function.h"

namespace polestar::detail {

/// Sets the harmonic part h at points of the surface, inner frame.
using HarmonicPotential = std::function<void(std::span<const Vec3> points, std::span<double> h)>;

struct MeasuredBoundary {
  BoundaryError error;
  /// The largest rho |G| that each triangle sees on itself, its edges and corners.
  std::vector<double> byTriangle;
};

/// rho |1/|x| + h| on a mesh around the origin, sampled in all vertices, in two points of every edge and
/// three of every triangle. No solver takes its equation from the points on edges and in triangles, so that
/// none can be good at them alone.
MeasuredBoundary measureBoundary(const TriMesh& mesh, const HarmonicPotential& h, double harmonicRadius);

/// The same points, of the triangles that `look` marks alone: raises byTriangle[t] to what is seen there.
void measureTriangles(const TriMesh& mesh, const std::vector<char>& look, const HarmonicPotential& h,
                      double harmonicRadius, std::vector<double>& byTriangle);

/// rho = -1/h(0).
double harmonicRadiusOf(const HarmonicField& field);

}  // namespace polestar::detail
