#pragma once
// The footprint of a sample: averages over it of edges, lines and noise.

#include <algorithm>
#include <cmath>

#include "polestar/texture/detail/varying.h"

namespace polestar::detail {

class Footprint {
 public:
  explicit Footprint(const Mat3& edges) : edges_(edges) {
    // Invariants of the covariance of a point that is anywhere in the parallelepiped: edges edges^T / 12.
    const Mat3 c = edges * edges.transpose() / 12;
    trace_ = c.trace();
    // What is 0 may come out as a little less.
    minors_ = std::max(0.0, c(0, 0) * c(1, 1) - c(0, 1) * c(0, 1) + c(0, 0) * c(2, 2) - c(0, 2) * c(0, 2) +
                                c(1, 1) * c(2, 2) - c(1, 2) * c(1, 2));
    determinant_ = std::max(0.0, c.determinant());
  }

  /// The same footprint in another domain, in that domain's units.
  Footprint in(const VaryingPoint& domain) const { return Footprint(domain.jacobian() * edges_); }

  /// In a domain that is the same but for a factor.
  Footprint scaled(double factor) const {
    Footprint result = *this;
    const double squared = factor * factor;
    result.edges_ *= factor;
    result.trace_ *= squared;
    result.minors_ *= squared * squared;
    result.determinant_ *= squared * squared * squared;
    return result;
  }

  /// The box that varies as `q` does over the footprint (same variance) has this width.
  double width(const Varying& q) const {
    return std::sqrt((edges_.transpose() * q.gradient).squaredNorm() + 12 * q.variance);
  }

  /// Variance of a point's position in all directions together.
  double variance() const { return trace_; }
  /// Root mean square of a point's distance from the middle, times sqrt(12): the length of a lone edge.
  double size() const { return std::sqrt(12 * trace_); }
  /// Of a point's position along `unit`.
  double varianceAlong(const Vec3& unit) const { return (edges_.transpose() * unit).squaredNorm() / 12; }

  /// What is left, on average, of a random wave pattern when it is averaged over the footprint: 1 to 0. Its
  /// wave vectors (radians per unit) have the density |k|^2 exp(-|k|^2 / 2 spread^2), a band around 1.4
  /// `spread` in all directions; a wave that is averaged over a box with covariance C keeps about exp(-k^T C
  /// k / 2), and the integral of the product is rational in C's invariants.
  double kept(double spread) const {
    const double t = spread * spread;
    const double det = 1 + t * (trace_ + t * (minors_ + t * determinant_));
    return (1 + t * (2 * trace_ + t * minors_) / 3) / (det * std::sqrt(det));
  }

 private:
  Mat3 edges_;
  double trace_, minors_, determinant_;
};

inline double smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

/// Share of the footprint in which `x` is above 0. `softness` is the width of the edge itself.
inline double shareAbove(const Varying& x, double softness, const Footprint& footprint) {
  const double spread = footprint.width(x), width = std::sqrt(softness * softness + spread * spread);
  return width > 0 ? std::clamp(x.value / width + 0.5, 0.0, 1.0) : (x.value > 0);
}

/// Share in which |x| is below `half`: a line or membrane. What it covers stays the same when the footprint
/// grows.
inline double shareWithin(const Varying& x, double half, double softness, const Footprint& footprint) {
  return shareAbove(x + half, softness, footprint) - shareAbove(x - half, softness, footprint);
}

/// Mean of the cosine over the range that `phase` takes.
inline double meanCosine(const Varying& phase, const Footprint& footprint) {
  const double half = footprint.width(phase) / 2;
  if (half >= 3.14159265) return 0;  // a whole turn and more
  return std::cos(phase.value) * (half < 1e-4 ? 1 : std::sin(half) / half);
}

inline Vec3f mix(const Vec3f& a, const Vec3f& b, double share) {
  return a + static_cast<float>(share) * (b - a);
}
inline double mix(double a, double b, double share) { return a + share * (b - a); }

}  // namespace polestar::detail
