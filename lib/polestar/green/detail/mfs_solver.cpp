#include "polestar/green/detail/mfs_solver.h"

#include <Eigen/Core>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/green/detail/boundary_error.h"
#include "polestar/green/detail/inside_star.h"
#include "polestar/green/detail/point_charge_field.h"
#include "polestar/green/detail/spread_points.h"
#include "polestar/green/detail/svd_least_squares.h"

namespace polestar::detail {
namespace {

// What the smooth mode tries: largest offsets, in inner units, and cutoffs, from one decomposition. Larger
// offsets resolve more with fewer sources until singularities of the continued h get between them and the
// surface; lower cutoffs use more of the sources until rounding errors of their large charges show.
constexpr double kOffsets[] = {0.2, 0.4, 0.8};
constexpr double kCutoffs[] = {1e-8, 1e-10, 1e-12, 1e-14};

void refuseWhatDoesNotFit(std::size_t equations, std::size_t sources, const MfsOptions& options,
                          const Context& context) {
  const double bytes =
      SvdLeastSquares::peakBytes(static_cast<double>(equations), static_cast<double>(sources));
  char size[160];
  std::snprintf(size, sizeof size,
                "a dense matrix of %zu vertices by %zu sources and its decomposition: %.2g GB", equations,
                sources, bytes / 1e9);
  if (bytes > options.memoryLimit) {
    char limit[32];
    std::snprintf(limit, sizeof limit, "%.2g GB", options.memoryLimit / 1e9);
    throw Error(Errc::usage, std::string("the method of fundamental solutions needs ") + size +
                                 ", more than the " + limit +
                                 " that it may take; use the layer solver, or a mesh with fewer vertices");
  }
  context.log(LogLevel::info, std::string("method of fundamental solutions: ") + size);
}

// Share of the area around vertices where G grows outward, which it never does.
double wrongSignShare(const TriMesh& mesh, const HarmonicField& field) {
  const std::vector<Vec3> normals = vertexNormals(mesh);
  const std::vector<double> area = vertexAreas(mesh);
  std::vector<double> h(mesh.vertices.size());
  std::vector<Vec3> gradient(mesh.vertices.size());
  field.evaluate(mesh.vertices, h, gradient);
  double wrong = 0, total = 0;
  for (std::size_t i = 0; i < area.size(); ++i) {
    const Vec3& x = mesh.vertices[i];
    total += area[i];
    if (!(normals[i].dot(gradient[i] - x / std::pow(x.norm(), 3)) < 0)) wrong += area[i];
  }
  return wrong / total;
}

// Sources over `base`, without those that would lie inside.
PointSources placeSources(std::span<const Vec3> surface, std::span<const Vec3> normals,
                          const InsideStar& solid, std::span<const std::size_t> base,
                          std::span<const double> offset) {
  PointSources sources;
  for (const std::size_t i : base) {
    const Vec3 p = surface[i] + offset[i] * normals[i];
    if (!solid.contains(p)) sources.positions.push_back(p);
  }
  return sources;
}

SvdLeastSquares decompose(std::span<const Vec3> points, const std::vector<Vec3>& sources,
                          const std::string& stage, const Context& context) {
  Eigen::MatrixXd kernel(points.size(), sources.size());
  parallelChunks(sources.size(), 16, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t j = begin; j < end; ++j) {
      for (std::size_t i = 0; i < points.size(); ++i) kernel(i, j) = 1 / (points[i] - sources[j]).norm();
    }
  });
  Eigen::VectorXd pole(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) pole[i] = -1 / points[i].norm();
  return {std::move(kernel), pole, stage, context};
}

std::vector<double> chargesOf(const SvdLeastSquares& decomposition, double cutoff) {
  const Eigen::VectorXd charges = decomposition.solve(cutoff);
  return {charges.begin(), charges.end()};
}

// Largest rho |G| at points of the surface, and the norm of G relative to that of 1/r.
struct Misfit {
  double largest = 0, relative = 0;
};
Misfit misfit(const PointSources& sources, std::span<const Vec3> points, const Context& context) {
  const PointChargeField field(sources);
  std::vector<double> h(points.size());
  field.evaluatePotential(points, h, context);
  double largest = 0, sum = 0, scale = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double pole = 1 / points[i].norm(), green = std::abs(pole + h[i]);
    largest = std::max(largest, green);
    sum += green * green;
    scale += pole * pole;
  }
  return {std::abs(harmonicRadiusOf(field)) * largest, std::sqrt(sum / scale)};
}

// What is told of a solution besides its search.
MfsSolution finish(PointSources sources, std::size_t placed, const SvdLeastSquares& decomposition,
                   double cutoff, std::span<const Vec3> equation, const Context& context) {
  MfsSolution solution;
  solution.summary.leftOut = placed - sources.positions.size();
  solution.summary.sources = sources.positions.size();
  solution.summary.cutoff = cutoff;
  solution.summary.rank = static_cast<std::size_t>(decomposition.rank(cutoff));
  const Eigen::VectorXd values = decomposition.singularValues();
  solution.summary.reciprocalCondition = values[values.size() - 1] / values[0];
  const Misfit there = misfit(sources, equation, context);
  solution.summary.collocationError = there.largest;
  solution.residual = there.relative;
  solution.sources = std::move(sources);
  return solution;
}

MfsSolution solvePaper(const TriMesh& mesh, std::size_t count, const MfsOptions& options,
                       const Context& context) {
  const double offset = options.offset * boundingBox(mesh).diagonal();
  const std::size_t n = mesh.vertices.size();
  refuseWhatDoesNotFit(n, count, options, context);
  const std::vector<std::size_t> base = spreadPoints(mesh.vertices, std::vector<double>(n, 1.0), count);
  PointSources sources = placeSources(mesh.vertices, vertexNormals(mesh), InsideStar(mesh), base,
                                      std::vector<double>(n, offset));
  const SvdLeastSquares decomposition =
      decompose(mesh.vertices, sources.positions, "solving for the Green's function", context);
  sources.charges = chargesOf(decomposition, options.cutoff);
  MfsSolution solution =
      finish(std::move(sources), count, decomposition, options.cutoff, mesh.vertices, context);
  solution.summary.offset = offset;
  return solution;
}

// At every vertex the radius of the largest ball that touches the surface there from outside and holds no
// other vertex: on smooth surfaces the distance, or less, to where outward normals cross.
std::vector<double> exteriorReach(const TriMesh& mesh, const std::vector<Vec3>& normals,
                                  const Context& context) {
  const std::vector<Vec3>& v = mesh.vertices;
  std::vector<double> reach(v.size(), std::numeric_limits<double>::infinity());
  parallelChunks(v.size(), 64, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      for (const Vec3& other : v) {
        const Vec3 d = other - v[i];
        const double height = normals[i].dot(d);
        if (height > 0) reach[i] = std::min(reach[i], d.squaredNorm() / (2 * height));
      }
    }
  });
  return reach;
}

// Samples of a smooth surface: vertices, or some of them.
struct SmoothSamples {
  std::vector<Vec3> points, normals;
  std::vector<double> reach;

  SmoothSamples where(const std::vector<char>& chosen, char value) const {
    SmoothSamples part;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (chosen[i] != value) continue;
      part.points.push_back(points[i]);
      part.normals.push_back(normals[i]);
      part.reach.push_back(reach[i]);
    }
    return part;
  }
};

// Sources over samples, as dense as they are near: their granularity decays over the offset.
PointSources sourcesWithin(double largestOffset, const SmoothSamples& samples, std::size_t count,
                           const InsideStar& solid, const MfsOptions& options) {
  std::vector<double> offset = samples.reach;
  for (double& d : offset) d = std::min(largestOffset, options.reachShare * d);
  return placeSources(samples.points, samples.normals, solid, spreadPoints(samples.points, offset, count),
                      offset);
}

struct SmoothChoice {
  double offset = kOffsets[0], cutoff = kCutoffs[0], error = std::numeric_limits<double>::infinity();
};

// Tries offsets and cutoffs without the samples that are held out, and judges by those.
SmoothChoice chooseByHeldOut(const SmoothSamples& samples, std::size_t count, const InsideStar& solid,
                             const MfsOptions& options, const Context& context) {
  const std::size_t n = samples.points.size();
  const auto share = static_cast<std::size_t>(options.heldOutShare * static_cast<double>(n));
  const std::size_t heldOut =
      std::clamp<std::size_t>(share, 1, static_cast<std::size_t>(options.largestSources));
  std::vector<char> isHeldOut(n, 0);
  for (const std::size_t i : spreadPoints(samples.points, std::vector<double>(n, 1.0), heldOut))
    isHeldOut[i] = 1;
  const SmoothSamples equation = samples.where(isHeldOut, 0), judge = samples.where(isHeldOut, 1);
  count = std::min(count, equation.points.size());
  SmoothChoice best;
  for (const double offset : kOffsets) {
    PointSources sources = sourcesWithin(offset, equation, count, solid, options);
    char stage[80];
    std::snprintf(stage, sizeof stage, "trying sources within %g for the Green's function", offset);
    const SvdLeastSquares decomposition = decompose(equation.points, sources.positions, stage, context);
    for (const double cutoff : kCutoffs) {
      sources.charges = chargesOf(decomposition, cutoff);
      const double error = misfit(sources, judge.points, context).largest;
      if (error < best.error) best = {offset, cutoff, error};
    }
  }
  return best;
}

MfsSolution solveSmooth(const TriMesh& mesh, std::size_t count, const MfsOptions& options,
                        const Context& context) {
  count = std::min(count, static_cast<std::size_t>(options.largestSources));
  refuseWhatDoesNotFit(mesh.vertices.size(), count, options, context);
  SmoothSamples samples{mesh.vertices, vertexNormals(mesh), {}};
  samples.reach = exteriorReach(mesh, samples.normals, context);
  const InsideStar solid(mesh);
  const SmoothChoice choice = chooseByHeldOut(samples, count, solid, options, context);
  PointSources sources = sourcesWithin(choice.offset, samples, count, solid, options);
  const SvdLeastSquares decomposition =
      decompose(samples.points, sources.positions, "solving for the Green's function", context);
  sources.charges = chargesOf(decomposition, choice.cutoff);
  MfsSolution solution =
      finish(std::move(sources), count, decomposition, choice.cutoff, samples.points, context);
  solution.summary.offset = choice.offset;
  solution.summary.heldOutError = choice.error;
  return solution;
}

}  // namespace

MfsSolution solveMfs(const TriMesh& mesh, const MfsOptions& options, const Context& context) {
  options.validate();
  const auto count = std::max<std::size_t>(
      1, static_cast<std::size_t>(
             std::lround(options.sourcesPerVertex * static_cast<double>(mesh.vertices.size()))));
  MfsSolution solution = options.mode == MfsMode::paper ? solvePaper(mesh, count, options, context)
                                                        : solveSmooth(mesh, count, options, context);
  solution.summary.mode = options.mode;
  return solution;
}

GreenFunction solveGreenByCharges(const StarShape& shape, const MfsOptions& options, const Context& context) {
  const auto startTime = std::chrono::steady_clock::now();
  const TriMesh& mesh = shape.mesh();
  MfsSolution solution = solveMfs(mesh, options, context);
  const PointChargeField field(solution.sources);
  GreenRecord record;
  record.summary.solver = "mfs";
  record.summary.device = "cpu";
  record.summary.passes = 1;
  record.summary.residual = solution.residual;
  record.mfs = solution.summary;
  record.harmonicRadius = harmonicRadiusOf(field);
  record.boundaryError = measureBoundary(
                             mesh,
                             [&](std::span<const Vec3> points, std::span<double> h) {
                               field.evaluatePotential(points, h, context);
                             },
                             record.harmonicRadius)
                             .error;
  record.unresolvedArea = wrongSignShare(mesh, field);
  record.summary.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - startTime).count();
  return restoreGreen(shape, std::move(solution.sources), std::move(record));
}

}  // namespace polestar::detail
