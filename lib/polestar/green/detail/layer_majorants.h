#pragma once
// Sums over the triangles of a layer from above: what its edge-midpoint charges miss, and how fast the
// potential of far triangles can bend. All terms are positive, so that a tree with crude factors gives bounds
// that hold.

#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/detail/edge_table.h"
#include "polestar/green/detail/flat_piece.h"
#include "polestar/green/detail/layer_field.h"

namespace polestar::detail {

/// A layer as its integrals are taken by parts: what jumps across the edges.
struct LayerJumps {
  LayerJumps(const TriMesh& mesh, std::span<const double> density);

  EdgeTable edges;
  std::vector<Vec3> normal, slope;  ///< of triangles: unit normal, gradient of the density
  std::vector<Vec3> conormal;       ///< of sides: in the triangle's plane, across the edge, outward
  struct Edge {
    Vec3 a, b;
    double length = 0, density = 0;  ///< the largest |sigma| on it
    Vec3 jump = Vec3::Zero();        ///< sum of the conormals: 0 where the surface is flat
  };
  Edge edge(std::size_t e) const;
  /// The triangle that an edge is counted with.
  std::uint32_t owner(std::size_t e) const { return static_cast<std::uint32_t>(edges.sides(e)[0] / 3); }

 private:
  std::vector<Vec3> vertices_;
  std::span<const double> density_;
};

FlatTriangle flatTriangle(const TriMesh& mesh, const LayerJumps& jumps, std::size_t t);

class LayerMajorants {
 public:
  /// @param mesh as the quadrature has it, `density` at its vertices. O(n log n).
  LayerMajorants(const TriMesh& mesh, const LayerQuadrature& quadrature, std::span<const double> density,
                 const LayerJumps& jumps);

  /// What the layer's potential by charges and near field, as NearField::potential corrects them, may differ
  /// from that of the layer itself, anywhere in the ball.
  ///
  /// The charges have the moments of the linear density up to degree 2. Degrees 3 to 5 differ by what is
  /// computed for each triangle (moments in solid harmonics m: sum over m of M_m R_m(x)/|x|^(2n+1) is at most
  /// |M| / |x|^(n+1)), degrees from 6 on by less than sum |q| |y|^6 / (|x|^7 (1 - |y|/|x|)). Where the closed
  /// form is blended in, its weight takes its share off.
  double quadratureError(const Ball& ball) const;

  /// The same for the gradient off the surface, of NearField::addPotentialAndGradient. A moment of degree n
  /// counts (n + 1)/|x| times as much: value and slopes at a point are orthogonal forms in the moments, of
  /// norms 1, n + 1 along x and sqrt(n (n + 1)/2) across, at |x| = 1. The slope of the blend's weight takes
  /// its share of the potential's error.
  double slopeQuadratureError(const Ball& ball) const;

  struct Reached {
    std::vector<std::uint32_t> triangles;  ///< with the point within `reach` times their near radius, >= 1
    double slopeError = 0;                 ///< of the gradient of the others' charges
  };
  Reached reachedFrom(const Vec3& x, double reach) const;

  /// An upper bound for quadratureError over the whole cube, within `slack` (a factor above 1) of the truth
  /// when `boxes` suffice to get there.
  double largestQuadratureError(const Cube& cube, double slack, std::size_t boxes) const;

  struct Surroundings {
    double quadratureError = 0;
    /// Second derivatives, at right angles to `normal`, of the potential of all triangles but those in
    /// `patch` and of the edges that are counted with them.
    double bend = 0;
    std::vector<std::uint32_t> patch;  ///< triangles that come closer than `reach` to the ball
  };
  Surroundings around(const Ball& ball, const Vec3& normal, double reach) const;

  struct Charges {
    /// Sum of |q|/r^4 over the triangles that are not in `patch`: a sixth of it bounds their third
    /// derivatives.
    double fourth = 0;
    std::vector<std::uint32_t> patch;  ///< triangles that come closer than `reach` to the ball
  };
  Charges chargesAround(const Ball& ball, double reach) const;

 private:
  // Sums of w |P v| over vectors v, P a projection onto a plane, from above: by Cauchy and Schwarz at most
  // the root of (sum of w |v|) (sum of w |P v|^2/|v|), of which the second is a quadratic form in the plane's
  // normal.
  struct Tilts {
    double weight = 0;
    Mat3 form = Mat3::Zero();
    void add(double w, const Vec3& v);
    void add(const Tilts& other);
    double along(const Vec3& normal) const;
  };
  // What bends the potential, by the powers of the distance that it falls with.
  struct Bend {
    Tilts charge;       // third: double layers
    Tilts jump, slope;  // second: jumps of conormals along the edges; slopes of the density
    void add(const Bend& other);
    double at(double distance, const Vec3& normal) const;
  };
  // Positive weights that fall like a power of the distance: their sum, center and spread.
  struct Cluster {
    double weight = 0, spread = 0;
    Vec3 center = Vec3::Zero();
    template <int power>
    double at(const Ball& ball, double nearest) const;
  };
  // A triangle as a source of positive terms.
  struct Item {
    Vec3 centroid;
    double radius = 0;  // of the triangle
    Bend bend;
    double defect = 0;       // quadrature error <= defect / |x - centroid|^4
    double slopeDefect = 0;  // of the gradient: <= slopeDefect / |x - centroid|^5
    double nearRadius = 0;
    Cluster charge;
  };
  struct Node {
    std::uint32_t begin = 0, end = 0, right = 0;  // children: the next node and `right`; 0 for leaves
    Vec3 middle = Vec3::Zero();                   // all triangles lie within `radius`
    double radius = 0, nearRadius = 0;
    Cluster defect, slopeDefect, charge;
    Bend bend;
  };
  Item itemOf(const TriMesh& mesh, std::size_t t, const LayerQuadrature& quadrature,
              std::span<const double> density, const LayerJumps& jumps) const;
  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  double defectOf(const Item& item, const Ball& ball) const;
  double slopeDefectOf(const Item& item, const Ball& ball) const;
  template <class Member>
  Cluster clustered(std::uint32_t begin, std::uint32_t end, const Vec3& middle, Member&& member) const;
  // Of nodes that are far enough from the ball, at their least distance, and of the triangles of the others.
  template <class OfNode, class OfItem>
  double sumOver(const Ball& ball, OfNode&& ofNode, OfItem&& ofItem) const;
  template <class OpenNode, class TakeNode, class TakeItem>
  void visit(OpenNode&& open, TakeNode&& takeNode, TakeItem&& takeItem) const;

  std::vector<Item> items_;
  std::vector<std::uint32_t> order_;
  std::vector<Node> nodes_;
};

}  // namespace polestar::detail
