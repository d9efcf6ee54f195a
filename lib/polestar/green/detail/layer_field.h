#pragma once
// The single layer h(x) = integral of sigma(y)/|x - y| over the surface, sigma continuous and linear on the
// triangles.

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/green/detail/near_field.h"
#include "polestar/green/detail/near_index.h"
#include "polestar/green/detail/potential_sums.h"
#include "polestar/green/green_function.h"

namespace polestar::detail {

/// Geometry and quadrature of the layer, shared by the solver and the evaluation, so that what is solved is
/// what is evaluated.
///
/// Far from a triangle its layer is three point charges at the edge midpoints (exact for quadratic
/// integrands, and edges share them). Near it the charges are exchanged for the closed form, see NearField.
class LayerQuadrature {
 public:
  LayerQuadrature(const TriMesh& mesh, const Context& context);

  std::size_t vertexCount() const { return vertexCount_; }
  std::size_t triangleCount() const { return corners_.size(); }
  const Triangle& corners(std::size_t t) const { return corners_[t]; }
  double area(std::size_t t) const { return near_->area(t); }

  /// Edge midpoints and softening; the charges are 0.
  const PointCharges& places() const { return places_; }
  /// Charges at the edge midpoints for a density given at the vertices.
  std::vector<double> chargesFor(std::span<const double> density) const;

  const NearField& near() const { return *near_; }
  const NearIndex& nearIndex() const { return *nearIndex_; }

  /// Potential at points of the surface or inside it: `far` holds that of the charges, and the full one
  /// afterwards.
  void addNearPotential(std::span<const Vec3> points, const NearField::Density& density,
                        std::span<double> far, const Context& context) const;
  /// The same with the gradient.
  void addNearGradient(std::span<const Vec3> points, const NearField::Density& density, std::span<double> far,
                       std::span<Vec3> gradient, const Context& context) const;

 private:
  std::size_t vertexCount_;
  std::vector<Triangle> corners_;
  std::vector<std::array<std::int32_t, 2>> edgeEnds_;
  std::vector<double> edgeWeight_;  ///< a third of the areas of the edge's two triangles
  PointCharges places_;
  std::unique_ptr<const NearField> near_;
  std::unique_ptr<const NearIndex> nearIndex_;
};

class PairDevice;

/// Sums over the layer's charges at fixed targets, with errors near `accuracy`, relative to the largest
/// potential: pair by pair on `device` (null: none) while it is exact enough and the pairs are not too many,
/// pair by pair on the CPU while that is faster, else by the fast multipole method.
std::unique_ptr<PotentialSums> makeSums(const PointCharges& places, std::span<const Vec3> targets,
                                        double accuracy, const std::shared_ptr<PairDevice>& device);
/// Two of them for the same places and targets, which share what they can.
struct SumsOfTwoAccuracies {
  std::unique_ptr<PotentialSums> cheap, exact;
};
SumsOfTwoAccuracies makeSums(const PointCharges& places, std::span<const Vec3> targets, double cheap,
                             double exact, const std::shared_ptr<PairDevice>& device);
/// The same for a field.
std::unique_ptr<ChargeField> makeField(PointCharges charges, double accuracy, double finest,
                                       double truncation, const Context& context);

/// A surface along axes that turn with it (principalAxes), and its layer's quadrature there.
struct AlignedSurface {
  AlignedSurface(const TriMesh& mesh, const Mat3& axes, const Context& context);
  Mat3 axes;  ///< x along them is axes x
  TriMesh mesh;
  LayerQuadrature quadrature;
};

/// The field of a solved density.
class LayerField final : public HarmonicField {
 public:
  /// @param accuracy of the potential, relative to its largest value.
  /// @param truncation a bound that truncated sums have to keep, if the highest order can do it
  LayerField(std::shared_ptr<const AlignedSurface> surface, std::span<const double> density, double accuracy,
             const Context& context, double truncation = std::numeric_limits<double>::infinity());
  void evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const override;

  /// What it is made of, for proofs. All of it lies along the surface's principal axes: x there is axes() x
  /// here.
  const Mat3& axes() const { return surface_->axes; }
  const TriMesh& mesh() const { return surface_->mesh; }
  std::span<const double> atVertices() const { return atVertices_; }
  const LayerQuadrature& quadrature() const { return surface_->quadrature; }
  const NearField::Density& nearDensity() const { return density_; }
  /// See ChargeField.
  double truncation() const { return far_->truncation(); }

 private:
  std::shared_ptr<const AlignedSurface> surface_;
  std::vector<double> atVertices_;
  NearField::Density density_;
  std::unique_ptr<const ChargeField> far_;
};

struct LayerSolveOptions {
  double residual = 1e-6;                ///< relative, to stop at
  double largestResidual = 1e300;        ///< at any vertex, likewise: a potential
  int maxIterations = 200;               ///< over all restarts
  std::shared_ptr<PairDevice> device{};  ///< that may sum over all pairs; null: the CPU
};

/// Result of the first-kind equation  S sigma = -1/|x|  on a surface around the origin.
struct LayerSolution {
  std::vector<double> density;
  bool converged = false;
  double residual = 0;                  ///< relative, reached
  std::vector<double> residualHistory;  ///< relative, one an iteration
  Eigen::Index worstVertex = 0;         ///< where the residual is largest
  /// 1/|x| + h at the vertices, then at the triangles' centroids: what the equation makes 0 in the mean
  /// around each vertex, not point by point.
  std::vector<double> green;
};

/// The discrete equation, assembled; solves to any residual and again from a better start.
class LayerEquation {
 public:
  LayerEquation(std::shared_ptr<const AlignedSurface> surface, int neighbours, Context& context);
  ~LayerEquation();

  /// GMRES with a SparseInverse, from `initial` (empty: from 0), within a few steps of iterative refinement:
  /// inner iterations use sums of low order, residuals those that `options.residual` asks for. Deterministic
  /// for any number of threads. That the residual stays above the one asked for is told by the result.
  LayerSolution solve(const std::vector<double>& initial, const LayerSolveOptions& options,
                      Context& context) const;

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace polestar::detail
