#pragma once
// Green's function of a star-shaped solid with its pole at the center. [Xia 2010, sec. 4.1, step 2; normalization,
// solver and error measures: docs/method.md]
//
//     G(x) = 1/|x| + h(x),   h harmonic inside,   G = 0 on the surface      (inner frame: the center is the origin)
//     harmonic radius  rho = -1/h(0);      ball radius  R = 1/(1 + rho G), 0 at the center, 1 on the surface

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/star/star_shape.h"

namespace polestar {

/// A harmonic function and its gradient, evaluated together from a plan that is built once. Inner frame. Thread-safe.
class HarmonicField {
 public:
  virtual ~HarmonicField() = default;
  /// h and grad h at points inside the solid and on its surface (there: the gradient's limit from inside).
  virtual void evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const = 0;
};

/// How far rho |G| is from 0 on the surface. By the maximum principle its maximum bounds rho |G~ - G| everywhere inside.
struct BoundaryError {
  double max = 0, rms = 0;
  std::size_t points = 0;
  Vec3 worst = Vec3::Zero();  ///< where the maximum was seen, inner frame
  bool bound = false;         ///< true only for an enclosure that includes every error of the evaluation; else sampled
};

struct GreenOptions {
  double tolerance = 1e-6;   ///< relative residual at which GMRES stops
  int maxIterations = 80;    ///< GMRES, no restarts
  int neighbours = 30;       ///< size of the local inverses of the preconditioner

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// What the solver did.
struct GreenSummary {
  std::string solver;  ///< "layer"
  int iterations = 0;
  double residual = 0;                   ///< relative, at the end
  std::vector<double> residualHistory;
  double seconds = 0;
};

/// Cheap to copy. All lengths in the inner unit.
class GreenFunction {
 public:
  /// Wraps a field that vanishes with 1/|x| on the surface, measures its boundary error and harmonic radius.
  /// For solvers; users call solveGreen.
  GreenFunction(StarShape shape, std::shared_ptr<const HarmonicField> field, std::vector<double> density,
                GreenSummary summary, Context& context);

  const StarShape& shape() const { return data_->shape; }
  const HarmonicField& field() const { return *data_->field; }
  double harmonicRadius() const { return data_->harmonicRadius; }
  const BoundaryError& boundaryError() const { return data_->boundaryError; }
  /// Total charge of the layer: -1 for the exact solution.
  double charge() const { return data_->charge; }
  /// Single-layer density at the vertices, per unit area; -density is the density of harmonic measure, so positive.
  std::span<const double> density() const { return data_->density; }
  /// Share of the surface's area around vertices whose density has the wrong sign: there G has run out of digits.
  double wrongSignArea() const { return data_->wrongSignArea; }
  const GreenSummary& summary() const { return data_->summary; }

  /// G and grad G. At the center G is +infinity and the gradient NaN.
  void evaluate(std::span<const Vec3> points, std::span<double> green, std::span<Vec3> gradient) const;

  /// R = 1/(1 + rho G) for a value of G; clamped to [0, 1].
  double ballRadius(double green) const;

 private:
  struct Data {
    StarShape shape;
    std::shared_ptr<const HarmonicField> field;
    std::vector<double> density;
    GreenSummary summary;
    double harmonicRadius = 0, charge = 0, wrongSignArea = 0;
    BoundaryError boundaryError{};
  };
  std::shared_ptr<const Data> data_;
};

/// Green's function by a single layer on the surface's own triangles: h = S sigma, sigma continuous and linear on the
/// triangles, first-kind equation tested by the vertex-and-centroid rule, analytic integrals near and edge midpoints
/// far, GMRES with local inverses as preconditioner.
///
/// Direct sums: time O(n^2) per iteration (10k vertices: about 0.5 s on two cores), memory O(n).
/// @throws Error{Errc::notConverged} with the residual history when GMRES does not reach `options.tolerance`.
GreenFunction solveGreen(const StarShape& shape, const GreenOptions& options = {}, Context& context = Context::quiet());

}  // namespace polestar
