#pragma once
// How far the potential of a layer can leave its values at the corners of a flat piece of the surface: the
// step from samples to all points between them. The formulas are derived in docs/method.md, "From samples to
// a bound".

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/detail/edge_table.h"
#include "polestar/green/detail/flat_piece.h"
#include "polestar/green/detail/layer_majorants.h"

namespace polestar::detail {

/// What the surroundings of one triangle of the surface contribute to the variation on pieces of it.
class Patch;

class FlatVariation {
 public:
  FlatVariation(const TriMesh& mesh, std::span<const double> density, const LayerJumps& jumps,
                const LayerMajorants& majorants);

  /// The terms of triangle t. Those of triangles nearer than `kReach` of its diameter are taken apart edge by
  /// edge, so that what neighbours cancel is not counted; farther ones by their magnitudes alone.
  Patch patch(std::size_t t) const;

  static constexpr double kReach = 1.5;

 private:
  void addEdge(std::size_t t, std::uint32_t s, std::size_t e, const std::vector<std::uint32_t>& patch,
               Patch& result) const;

  const TriMesh& mesh_;
  std::span<const double> density_;
  const LayerMajorants& majorants_;
  const LayerJumps& jumps_;
};

class Patch {
 public:
  /// Bound for |G(x) - sum l_i G(p_i)| at any x = sum l_i p_i of the piece, where G = 1/|x| + the layer's
  /// potential.
  double variation(const Piece& piece) const;
  /// The same for pieces of this piece alone, in less time: what is far from it is summed up once and for
  /// all.
  Patch narrowed(const Piece& piece) const;
  /// Bound for what charges and near field miss of the layer's potential on the triangle.
  double quadratureError() const { return quadratureError_; }

 private:
  friend class FlatVariation;
  struct Edge {
    Vec3 a, b;
    double length = 0;
    double jump = 0;             // largest |sigma| times the sum of conormals, along the plane
    double slopeJump = 0;        // the same of grad sigma times conormal
    Vec3 across = Vec3::Zero();  // own edges: the triangle's conormal
    bool own = false;
  };
  struct Side : FlatTriangle {
    double tilt = 0;     // |normal| along the plane
    double slope = 0;    // |grad sigma| along the plane
    double density = 0;  // largest |sigma|
    bool oneSign = false;
  };
  static double alongPaths(const Edge& edge, const Piece& piece, double length);

  double quadratureError_ = 0, bend_ = 0;
  std::vector<Edge> edges_;
  std::vector<Side> sides_;
};

}  // namespace polestar::detail
