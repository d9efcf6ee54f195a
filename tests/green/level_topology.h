#pragma once
// The topology of a sampled function, counted exactly: values at the points of a cubic lattice, every cube
// cut into six tetrahedra around its diagonal (Freudenthal, Kuhn), linear on each of them. Level sets of such
// a function are closed polyhedra whose vertices, edges and faces lie in the lattice's edges, triangles and
// tetrahedra, and its critical points are vertices. [Banchoff 1970]
//
// Equal values are told apart by the order of the points (simulation of simplicity), so no case is left out.

#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::testing {

class Lattice {
 public:
  static constexpr double kOutside = -std::numeric_limits<double>::infinity();

  /// Points origin + spacing (i, j, k), i < size[0] and so on.
  Lattice(const Vec3& origin, double spacing, const std::array<int, 3>& size);

  /// Covers the ball of that radius about the origin, which is one of the points, `steps` of them on its
  /// radius.
  static Lattice aroundOrigin(double radius, int steps);

  std::size_t size() const { return values_.size(); }
  Vec3 point(std::size_t index) const;
  /// Values of a function where `inside`; elsewhere kOutside.
  void fill(const std::function<bool(const Vec3&)>& inside,
            const std::function<void(std::span<const Vec3>, std::span<double>)>& values);

  /// Of the set where the function is `level` or more; that must not reach the lattice's rim.
  struct LevelSurface {
    std::size_t vertices = 0, edges = 0, faces = 0;
    std::size_t components = 0;
    long eulerCharacteristic() const;
  };
  LevelSurface levelSurface(double level) const;

  /// A point where the level sets change, and by how much: its index is that of an isolated zero of the
  /// gradient, -1 for a maximum, +1 for a minimum and for saddles that join two parts of a superlevel set, -1
  /// for those that close a ring of one.
  struct CriticalPoint {
    std::size_t index = 0;
    std::size_t lowerParts = 0, upperParts = 0;  ///< of its neighbours, by value; 1 and 1 where it is regular
    long gradientIndex() const { return static_cast<long>(upperParts) - static_cast<long>(lowerParts); }
    bool maximum() const { return upperParts == 0; }
  };
  /// Of the points all of whose neighbours have values.
  std::vector<CriticalPoint> criticalPoints() const;

 private:
  std::array<int, 3> coordinates(std::size_t index) const;
  std::size_t indexOf(const std::array<int, 3>& at) const;
  bool onRim(const std::array<int, 3>& at) const;
  bool changes(const std::array<int, 3>& at, double level) const;
  bool higher(std::size_t a, std::size_t b) const;

  Vec3 origin_;
  double spacing_;
  std::array<int, 3> size_;
  std::vector<double> values_;
};

/// How often the directions of a vector field cover the sphere along a closed, outward-oriented surface: the
/// sum of the indices of its zeros and poles inside. Exact for the field's values at the vertices.
int degreeOfField(std::span<const Vec3> field, const std::vector<Triangle>& triangles);

}  // namespace polestar::testing
