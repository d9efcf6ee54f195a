#pragma once
// How far the gradient of a layer's potential can leave its values at the corners of a flat piece that lies
// anywhere off the surface: the step from samples to all points between them. The formulas are derived in
// docs/method.md, "The signs".

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/green/detail/flat_piece.h"
#include "polestar/green/detail/layer_majorants.h"

namespace polestar::detail {

/// What the layer contributes to the variation of the gradient on pieces of one flat piece.
class SlopePatch {
 public:
  /// Bound for |grad G(x) - sum l_i grad G(p_i)| at any x = sum l_i p_i of the piece, where G = 1/|x| + the
  /// layer's potential. Infinite where the piece touches an edge that is counted.
  double variation(const Piece& piece) const;
  /// The same for pieces of this piece alone, in less time: what is far from it is summed up once and for
  /// all.
  SlopePatch narrowed(const Piece& piece) const;

 private:
  friend class SlopeVariation;
  struct Edge {
    Vec3 a, b;
    double length = 0;
    double jump = 0;       // largest |sigma| times what the normals jump by
    double slopeJump = 0;  // the same of what grad sigma contributes
  };
  struct Side : FlatTriangle {
    double slope = 0;  // |grad sigma|
  };
  static double alongPaths(const Edge& edge, const Piece& piece);

  double bend_ = 0;  // times the squared radius: of all that is summed up
  std::vector<Edge> edges_;
  std::vector<Side> sides_;
};

class SlopeVariation {
 public:
  SlopeVariation(const TriMesh& mesh, std::span<const double> density, const LayerJumps& jumps,
                 const LayerMajorants& majorants);

  /// For the piece. Triangles nearer than `kReach` of its diameter are taken by parts, so that what
  /// neighbours cancel is not counted; farther ones by their charges alone.
  SlopePatch patch(const Piece& piece) const;

  static constexpr double kReach = 1;

 private:
  void addEdge(const Vec3& normal, std::uint32_t s, std::size_t e, const std::vector<std::uint32_t>& patch,
               SlopePatch& result) const;

  const TriMesh& mesh_;
  std::span<const double> density_;
  const LayerMajorants& majorants_;
  const LayerJumps& jumps_;
};

}  // namespace polestar::detail
