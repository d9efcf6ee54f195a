#pragma once
// A quantity and how it varies over the footprint of a sample. Textures compute with these instead of plain
// numbers; at the end a ramp or an edge is averaged over the range that the quantity takes, which is all the
// filtering there is.

#include <algorithm>
#include <cmath>

#include "polestar/core/types.h"

namespace polestar::detail {

/// First order: value and gradient (forward differentiation); and the variance of what was averaged out of
/// the value, such as octaves of noise finer than the footprint, which still spreads it.
struct Varying {
  double value = 0;
  Vec3 gradient = Vec3::Zero();  ///< by ball coordinates
  double variance = 0;           ///< of what the gradient does not tell

  Varying() = default;
  Varying(double constant) : value(constant) {}  // NOLINT: constants mix freely with what varies
  Varying(double v, const Vec3& g, double unresolved = 0) : value(v), gradient(g), variance(unresolved) {}
};

/// f(a), given f and its derivative there.
inline Varying chain(const Varying& a, double f, double derivative) {
  return {f, derivative * a.gradient, derivative * derivative * a.variance};
}

inline Varying operator+(const Varying& a, const Varying& b) {
  return {a.value + b.value, a.gradient + b.gradient, a.variance + b.variance};
}
inline Varying operator-(const Varying& a, const Varying& b) {
  return {a.value - b.value, a.gradient - b.gradient, a.variance + b.variance};
}
inline Varying operator-(const Varying& a) { return {-a.value, -a.gradient, a.variance}; }
inline Varying operator*(const Varying& a, const Varying& b) {
  return {a.value * b.value, a.value * b.gradient + b.value * a.gradient,
          a.value * a.value * b.variance + b.value * b.value * a.variance};
}
inline Varying operator*(double a, const Varying& b) { return chain(b, a * b.value, a); }
inline Varying operator*(const Varying& a, double b) { return b * a; }
inline Varying operator+(const Varying& a, double b) { return {a.value + b, a.gradient, a.variance}; }
inline Varying operator-(const Varying& a, double b) { return {a.value - b, a.gradient, a.variance}; }

/// Where a divisor, root or angle has no derivative a large one stands in: everything stays finite.
constexpr double kTiny = 1e-9;

inline Varying operator/(const Varying& a, const Varying& b) {
  const double inverse = 1 / std::copysign(std::max(std::abs(b.value), kTiny), b.value);
  return a * chain(b, inverse, -inverse * inverse);
}
inline Varying operator/(const Varying& a, double b) { return (1 / b) * a; }

inline Varying sqrt(const Varying& a) {
  const double root = std::sqrt(std::max(a.value, 0.0));
  return chain(a, root, 0.5 / std::max(root, kTiny));
}
inline Varying hypot(const Varying& a, const Varying& b) { return sqrt(a * a + b * b); }
inline Varying abs(const Varying& a) { return chain(a, std::abs(a.value), a.value < 0 ? -1 : 1); }
inline Varying sin(const Varying& a) { return chain(a, std::sin(a.value), std::cos(a.value)); }
inline Varying cos(const Varying& a) { return chain(a, std::cos(a.value), -std::sin(a.value)); }
inline Varying exp(const Varying& a) { return chain(a, std::exp(a.value), std::exp(a.value)); }
inline Varying log(const Varying& a) {
  const double safe = std::max(a.value, kTiny);
  return chain(a, std::log(safe), 1 / safe);
}
inline Varying atan2(const Varying& y, const Varying& x) {
  const double squared = std::max(x.value * x.value + y.value * y.value, kTiny * kTiny);
  return {std::atan2(y.value, x.value), (x.value * y.gradient - y.value * x.gradient) / squared,
          (x.value * x.value * y.variance + y.value * y.value * x.variance) / (squared * squared)};
}
inline Varying min(const Varying& a, const Varying& b) { return a.value < b.value ? a : b; }
inline Varying max(const Varying& a, const Varying& b) { return a.value < b.value ? b : a; }

/// A point whose coordinates vary: the ball's own, or those of a domain in which a pattern is simple.
struct VaryingPoint {
  Varying x, y, z;

  VaryingPoint() = default;
  VaryingPoint(const Varying& px, const Varying& py, const Varying& pz) : x(px), y(py), z(pz) {}
  /// Ball coordinates themselves.
  explicit VaryingPoint(const Vec3& ball)
      : x(ball[0], Vec3::UnitX()), y(ball[1], Vec3::UnitY()), z(ball[2], Vec3::UnitZ()) {}

  Vec3 value() const { return {x.value, y.value, z.value}; }
  /// d point / d ball.
  Mat3 jacobian() const {
    Mat3 result;
    result << x.gradient.transpose(), y.gradient.transpose(), z.gradient.transpose();
    return result;
  }
  /// Of the scalar with value `f` and gradient `slope` in this domain, by ball coordinates.
  Varying pull(double f, const Vec3& slope) const {
    return {f, slope[0] * x.gradient + slope[1] * y.gradient + slope[2] * z.gradient,
            slope[0] * slope[0] * x.variance + slope[1] * slope[1] * y.variance +
                slope[2] * slope[2] * z.variance};
  }
};

inline VaryingPoint operator+(const VaryingPoint& a, const VaryingPoint& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline VaryingPoint operator*(const Varying& a, const VaryingPoint& b) { return {a * b.x, a * b.y, a * b.z}; }
inline VaryingPoint operator*(double a, const VaryingPoint& b) { return {a * b.x, a * b.y, a * b.z}; }
inline VaryingPoint operator/(const VaryingPoint& a, const Varying& b) { return (Varying(1) / b) * a; }
inline Varying norm(const VaryingPoint& a) { return sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }

}  // namespace polestar::detail
