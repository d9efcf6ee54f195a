#pragma once
// The loops of the near field: closed forms of many triangles at one point. near_field.h says what they add
// up.

#include <cstddef>

namespace polestar::detail {

// Triangles are laid out field by field: field f of triangle i is fields[f * kNearBlock + i], aligned to 64
// bytes. Whole lanes are computed, so that `count` is rounded up to a multiple of kNearLanes and the rest
// padded.
constexpr std::size_t kNearLanes = 8, kNearBlock = 32;

// First the record of a triangle: its corners, and the triangle in a plane frame of its own, scaled so that
// the longest edge, edge 0, has length 1. There the corners are (0, 0), (1, 0) and (apex, height), 0 <= apex
// <= 1. Edge k goes from corner k to k + 1; u = (a1 - a0)/length, normal = u x v.
namespace near_layout {
enum Field : std::size_t {
  kCorner = 0,  // 9
  kAxisV = 9,   // 3
  kApex = 12,
  kHeight,
  kLength1,  // of edges 1 and 2, in units of edge 0
  kLength2,
  kInverse1,
  kInverse2,
  kLength,  // of edge 0
  kInverseLength,
  kRecordEnd,
  // Beside the record:
  kValue = kRecordEnd,  // of the density, at corner 0
  kSlopeU,              // of the density, in the scaled frame
  kSlopeV,
  kUnused,
  kDensityEnd,
  kRatio = kDensityEnd,  // squared distance from the centroid over the squared near radius
  // Written by the loops, one stage for the next:
  kX,  // of the point in the scaled frame; z > 0 on the outer side
  kY,
  kZ,
  kR0,  // distances of the corners
  kR1,
  kR2,
  kLog0,  // integrals of 1/|x - y| along the edges; before that, their logarithms' numerators
  kLog1,
  kLog2,
  kDenominator0,
  kDenominator1,
  kDenominator2,
  kHalfAngle,  // half the solid angle, absolute; before that, its sine up to a factor
  kCosine,     // its cosine times the same factor
  kFieldEnd
};
}  // namespace near_layout
constexpr std::size_t kNearRecord = near_layout::kRecordEnd;
constexpr std::size_t kNearDensity = near_layout::kDensityEnd - near_layout::kValue;

struct NearPoint {
  double x, y, z;
};

/// Lays out `count` records and, where `density` is not null, densities.
void layOutNear(const double* const* record, const double* const* density, std::size_t count, double* fields);

/// Sum of the corrections. As in all of these, `fields` is scratch beyond what its caller filled in.
double sumNearPotential(double* fields, std::size_t count, const NearPoint& point, double squaredSoftening);

/// Adds potential and gradient to result[0] and result[1..3].
void sumNearPotentialAndGradient(double* fields, std::size_t count, const NearPoint& point,
                                 double squaredSoftening, double* result);

/// coefficient[k * kNearBlock + i]: of the density at corner k of triangle i.
void nearCoefficients(double* fields, std::size_t count, const NearPoint& point, double squaredSoftening,
                      double* coefficient);

/// ratio[i]: squared distance of the point from (x, y, z)[i], times inverseSquaredRadius[i].
void squaredDistanceRatios(const double* x, const double* y, const double* z,
                           const double* inverseSquaredRadius, std::size_t count, const NearPoint& point,
                           double* ratio);

}  // namespace polestar::detail
