#pragma once
// Rational arithmetic as the judge of exact predicates: slow, and beyond doubt.

#include <array>
#include <boost/multiprecision/cpp_int.hpp>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

using Rational = boost::multiprecision::cpp_rational;
using Rational3 = std::array<Rational, 3>;

inline Rational3 exact(const Vec3& v) { return {Rational(v[0]), Rational(v[1]), Rational(v[2])}; }

inline Rational3 difference(const Rational3& a, const Rational3& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

inline Rational dot(const Rational3& a, const Rational3& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline Rational3 cross(const Rational3& a, const Rational3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

inline Rational determinant(const Rational3& a, const Rational3& b, const Rational3& c) {
  return dot(a, cross(b, c));
}

/// Whether `c` lies strictly inside the half-space of every face, by the definition.
inline bool seesEveryFace(const TriMesh& mesh, const Vec3& c) {
  const Rational3 center = exact(c);
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    const Rational3 v = exact(mesh.corner(f, 0));
    const Rational3 normal =
        cross(difference(exact(mesh.corner(f, 1)), v), difference(exact(mesh.corner(f, 2)), v));
    if (dot(normal, difference(v, center)) <= 0) return false;
  }
  return true;
}

}  // namespace polestar::testing
