#pragma once
// The single layer h(x) = integral of sigma(y)/|x - y| over the surface, sigma continuous and linear on the
// triangles.

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/detail/aabb_tree.h"
#include "polestar/green/detail/point_charges.h"
#include "polestar/green/detail/triangle_layer.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

/// Geometry and quadrature of the layer, shared by the solver and the evaluation, so that what is solved is
/// what is evaluated.
///
/// Far from a triangle its layer is three point charges at the edge midpoints (exact for quadratic
/// integrands, and edges share them). Within kNear diameters the charges are exchanged for the closed form,
/// blended smoothly so that the field stays differentiable for the tracer.
class LayerQuadrature {
 public:
  static constexpr double kNear = 2.5;        ///< radius of the near field, in diameters of the triangle
  static constexpr double kBlendFrom = 0.75;  ///< share of that radius where the blend begins

  explicit LayerQuadrature(const TriMesh& mesh);

  std::size_t vertexCount() const { return vertexCount_; }
  std::size_t triangleCount() const { return triangles_.size(); }
  const Triangle& corners(std::size_t t) const { return corners_[t]; }
  double area(std::size_t t) const { return 0.5 * triangles_[t].twiceArea; }

  /// Charges at the edge midpoints for a density given at the vertices.
  void chargesFor(std::span<const double> density, PointCharges& charges) const;
  PointCharges emptyCharges() const;

  /// Sparse row that turns the far field at `x` into the full potential: potential(x) = far(x) + sum row_j
  /// sigma_j. Appends (vertex, coefficient), each vertex once, ascending.
  struct Entry {
    std::int32_t vertex;
    double coefficient;
  };
  void nearRow(const Vec3& x, std::vector<Entry>& row) const;

  /// What the far field misses at `x` for this density.
  double nearPotential(const Vec3& x, std::span<const double> density) const;
  /// Adds the same to potential and gradient.
  void addNear(const Vec3& x, std::span<const double> density, double& potential, Vec3& gradient) const;

 private:
  struct NearWeight {
    double value;
    Vec3 gradient;
  };
  /// Weight of the closed form of triangle t at x; false when x is outside its near field.
  bool nearWeight(std::size_t t, const Vec3& x, NearWeight& weight) const;

  std::size_t vertexCount_;
  std::vector<Triangle> corners_;
  std::vector<LayerTriangle> triangles_;
  std::vector<Vec3> centroids_;
  std::vector<double> nearRadius_;
  std::vector<std::array<std::int32_t, 3>>
      edgeOf_;  ///< of triangle t: its edges, edge k from corner k to k + 1
  std::vector<std::array<std::int32_t, 2>> edgeEnds_;
  std::vector<double> edgeWeight_;  ///< a third of the areas of the edge's two triangles
  std::vector<Vec3> midpoints_;
  double squaredSoftening_;
  AabbTree nearTree_;  ///< over the spheres of the near fields
};

class PairDevice;

/// The field of a solved density.
class LayerField final : public HarmonicField {
 public:
  LayerField(std::shared_ptr<const LayerQuadrature> quadrature, std::vector<double> density);
  void evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const override;
  /// h alone, at half the price.
  void evaluatePotential(std::span<const Vec3> points, std::span<double> h, const Context& context) const;

 private:
  std::shared_ptr<const LayerQuadrature> quadrature_;
  std::vector<double> density_;
  PointCharges charges_;
};

/// Result of the first-kind equation  S sigma = -1/|x|  on a surface around the origin.
struct LayerSolution {
  std::vector<double> density;
  std::vector<double> residualHistory;  ///< relative, one an iteration
};

/// GMRES with local inverses, from `initial` (empty: from 0), the far field summed on `device` (null: the
/// CPU); see solveGreen. Deterministic for any number of threads.
/// @throws Error{Errc::notConverged}
LayerSolution solveLayer(const TriMesh& mesh, const LayerQuadrature& quadrature,
                         const std::vector<double>& initial, const GreenOptions& options,
                         const std::shared_ptr<PairDevice>& device, Context& context);

}  // namespace polestar::detail
