#pragma once
// Green's function of a star-shaped solid with its pole at the center. [Xia 2010, sec. 4.1, step 2;
// normalization, solver and error measures: docs/method.md]
//
//     G(x) = 1/|x| + h(x),   h harmonic inside,   G = 0 on the surface      (inner frame: the center is the
//     origin) harmonic radius  rho = -1/h(0);      ball radius  R = 1/(1 + rho G), 0 at the center, 1 on the
//     surface

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "polestar/core/compute_device.h"
#include "polestar/core/context.h"
#include "polestar/green/mfs_options.h"
#include "polestar/star/star_shape.h"

namespace polestar {

/// A harmonic function and its gradient, evaluated together from a plan that is built once. Inner frame.
/// Thread-safe.
class HarmonicField {
 public:
  virtual ~HarmonicField() = default;
  /// h and grad h at points inside the solid and on its surface (there: the gradient's limit from inside).
  virtual void evaluate(std::span<const Vec3> points, std::span<double> h,
                        std::span<Vec3> gradient) const = 0;
};

/// How far rho |G| is from 0 on the surface. By the maximum principle its maximum bounds rho |G~ - G|
/// everywhere inside.
struct BoundaryError {
  double max = 0, rms = 0;  ///< rms is always that of samples
  std::size_t points = 0;
  Vec3 worst = Vec3::Zero();  ///< where the maximum was seen, or can be least excluded, inner frame
  /// True only for an enclosure: `max` then bounds rho |G~ - G| everywhere, on the surface and inside, G~
  /// being what `evaluate` gives, up to rounding (some 1e-12 of the largest 1/|x| on the surface). Else `max`
  /// is sampled.
  bool bound = false;
  double sampled = 0;  ///< of an enclosure: the largest value that was seen
  /// Of an enclosure: the part of `max` that truncated sums may have. The field's order keeps it.
  double truncation = 0;
};

/// Signs of the gradient of G~ = 1/|x| + the layer's potential on S_delta = (1 - delta) S, enclosed.
///
/// x . grad G~ is harmonic inside but at the center, where it goes to -infinity: negative on all of S_delta
/// it is so within, and G~ has no critical point there but the center. n . grad G~ < 0, n the normal of the
/// face above, says that field lines leave S_delta through every face outwards. Values are x . grad G~ / (|x|
/// |grad G~|) and n . grad G~ / |grad G~|, from above.
struct SignProof {
  static constexpr std::size_t kWeakest = 8;
  double delta = 0;
  std::size_t faces = 0;  ///< triangles of the layer, shrunk
  struct Sign {
    std::size_t failed = 0;   ///< faces on which it could not be shown everywhere
    std::size_t refuted = 0;  ///< of these: where some sample has the other one, beyond all errors
    double worst = -1;        ///< the largest value over all faces; below 0 when shown
  };
  Sign radial, normal;
  struct Face {
    std::uint32_t triangle = 0;  ///< of the layer
    Vec3 place = Vec3::Zero();   ///< middle of its weakest piece, inner frame
    double radial = 0, normal = 0;
    double seen = 0;  ///< the largest radial value of samples
  };
  std::vector<Face> weakest;  ///< up to kWeakest of those where the radial sign failed, worst first
  std::size_t points = 0;     ///< at which the gradient was evaluated
  double seconds = 0;
  /// No critical point in (1 - delta) M but the center.
  bool proved() const { return faces > 0 && radial.failed == 0; }
};

enum class GreenSolver {
  layer,  ///< a single layer on the surface
  mfs     ///< point charges outside, the paper's way: see mfs_options.h
};

/// All but `solver` and `mfs` are the layer's.
struct GreenOptions {
  GreenSolver solver = GreenSolver::layer;
  MfsOptions mfs;
  /// rho |G| aimed at on the surface: the layer's triangles are split, and the equation solved again, until
  /// all samples are below it or a limit is reached. Creases and corners need it.
  double tolerance = 1e-3;
  int maxPasses = 8;  ///< solves
  /// The budget: the layer may have `growth` times the vertices of the surface, and `spareVertices` more.
  double growth = 2;
  int spareVertices = 30000;
  /// Where the sums over all pairs of a solve run. Devices round differently: results agree to 1e-6, on one
  /// without doubles to 1e-5. One that is absent or fails is replaced by the CPU, and the log says so.
  DeviceChoice device;
  /// Relative, at which GMRES stops, and to which sums are exact. Narrow parts, where the density is small,
  /// tighten it by themselves, down to 1e-10.
  double residual = 1e-6;
  int maxIterations = 200;  ///< of GMRES in one pass
  int neighbours = 30;      ///< entries of a column of the preconditioner's factor, at most 64
  /// Enclose the boundary error instead of sampling it: BoundaryError::bound, as tight as about ten more
  /// points a triangle make it. And the signs that leave G no critical point but the center:
  /// GreenRecord::signs. The first costs four to seven times the solve, the second three times, and that much
  /// again for each depth that is tried where they fail.
  bool prove = false;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// What the solver did.
struct GreenSummary {
  std::string solver;  ///< "layer" or "mfs"
  std::string device;  ///< that summed to the end: "cpu" or an OpenCL device's name; not kept in map files
  int iterations = 0;  ///< over all passes
  int passes = 0;
  double residual = 0;  ///< relative, at the end
  std::vector<double> residualHistory;
  std::string stop;  ///< why splitting ended: "tolerance reached", "budget spent" or "passes spent"
  double seconds = 0;
  double secondsOfProof = 0;  ///< beyond these, for GreenOptions::prove
};

/// What was measured of a solved Green's function. Lengths in the inner unit.
struct GreenRecord {
  double harmonicRadius = 0;
  /// Total charge of the layer: -1 for the exact solution. Charges outside may have any sum: none for mfs.
  std::optional<double> charge;
  /// To which potentials are solved and summed, relative to their largest value.
  double accuracy = 0;
  /// Share of the surface's area where double precision, or the mesh, does not resolve G: the density has the
  /// wrong sign, or the potential's error over a triangle's size outweighs the flux. Coordinates are noise
  /// below it. [docs/method.md, "Where the coordinates run out of digits"]
  double unresolvedArea = 0;
  BoundaryError boundaryError;
  /// For GreenOptions::prove: at delta = 1e-3 and, where that is not proved, at larger ones up to 2e-2, as
  /// far as there is hope; the last is the first that was proved, if any was.
  std::vector<SignProof> signs;
  GreenSummary summary;
  std::optional<MfsSummary> mfs;  ///< of the solver mfs
};

/// A single layer, inner frame: h(x) = integral of density(y)/|x - y|, the density linear on the triangles.
struct SurfaceLayer {
  /// The surface, split further where that was needed. Its first vertices are those of the shape that was
  /// solved for.
  TriMesh mesh;
  /// At the vertices of `mesh`, per unit area; -density is the density of harmonic measure, so positive.
  std::vector<double> density;
};

/// The integral of a density that is linear on the triangles; for the exact solution -1.
double totalCharge(const TriMesh& mesh, std::span<const double> density);

/// What h is the potential of.
using GreenSources = std::variant<SurfaceLayer, PointSources>;

/// Cheap to copy. All lengths in the inner unit.
class GreenFunction {
 public:
  const StarShape& shape() const { return data_->shape; }
  const HarmonicField& field() const { return *data_->field; }
  const GreenSources& sources() const { return data_->sources; }
  /// Of the layer's Green's function. @throws std::bad_variant_access for that of charges.
  const TriMesh& layerMesh() const { return std::get<SurfaceLayer>(data_->sources).mesh; }
  std::span<const double> density() const { return std::get<SurfaceLayer>(data_->sources).density; }
  const GreenRecord& record() const { return data_->record; }
  double harmonicRadius() const { return data_->record.harmonicRadius; }
  const BoundaryError& boundaryError() const { return data_->record.boundaryError; }
  std::optional<double> charge() const { return data_->record.charge; }

  /// G and grad G. At the center G is +infinity and the gradient NaN.
  void evaluate(std::span<const Vec3> points, std::span<double> green, std::span<Vec3> gradient) const;

  /// R = 1/(1 + rho G) for a value of G; clamped to [0, 1].
  double ballRadius(double green) const;

  /// The same function on a refinement of its shape: same solid, same frame. The sources stay.
  GreenFunction onRefined(StarShape finer) const;

 private:
  struct Data {
    StarShape shape;
    GreenSources sources;
    std::shared_ptr<const HarmonicField> field;
    GreenRecord record;
  };
  friend GreenFunction restoreGreen(StarShape, GreenSources, GreenRecord);
  friend GreenFunction solveGreen(const StarShape&, const GreenOptions&, Context&);
  explicit GreenFunction(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

/// Green's function by `options.solver`; by default by a single layer on the surface's own triangles: h = S
/// sigma, sigma continuous and linear on the triangles, first-kind equation tested by the vertex-and-centroid
/// rule, analytic integrals near and edge midpoints far (by a fast multipole method), GMRES with a
/// sparse factor of the inverse as preconditioner, triangles split where the boundary error sits.
///
/// Time and memory grow about linearly with the triangles (docs/bench-green.md). That the boundary error
/// stays above the tolerance is no failure: it is measured and reported, with the reason, and everything
/// downstream depends on it.
/// @throws Error{Errc::notConverged} with the residual history and the place of the largest residual when
/// GMRES does not reach `options.residual`; Error{Errc::usage} when charges need more memory than they may
/// take; Error{Errc::cancelled}.
GreenFunction solveGreen(const StarShape& shape, const GreenOptions& options = {},
                         Context& context = Context::quiet());

/// The Green's function of sources that were solved for before, as a map file keeps them. Nothing is measured
/// again; what evaluations need is built when the first one comes.
GreenFunction restoreGreen(StarShape shape, GreenSources sources, GreenRecord record);

}  // namespace polestar
