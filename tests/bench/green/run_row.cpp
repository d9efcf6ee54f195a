#include "run_row.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <stdexcept>
#include <variant>

#include "exact_solid.h"
#include "measure.h"
#include "polestar/green/green_function.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "support/meshes.h"
#include "tet_laplacian.h"
#include "tetgen.h"
#include "voxel_poisson.h"

namespace polestar::bench {
namespace {

const ExactSolid* exactOrNull(const std::string& shape) {
  const auto& solids = exactSolids();
  const auto found =
      std::find_if(solids.begin(), solids.end(), [&](const ExactSolid& s) { return s.name == shape; });
  return found == solids.end() ? nullptr : &*found;
}

TriMesh surfaceOf(const Row& row) {
  if (const ExactSolid* exact = exactOrNull(row.shape)) return exact->surface(row.size);
  if (row.shape == "head") {
    // As it ships, and finer copies of the same polyhedron.
    const TriMesh head = readMesh(POLESTAR_VOLUMES_FOLDER "/head.ply").mesh;
    return subdivided(
        head, static_cast<int>(std::lround(std::sqrt(row.size / static_cast<double>(head.vertices.size())))));
  }
  // volumes/asteroid.ply by its formula, finer detail included.
  if (row.shape == "asteroid")
    return asteroid(static_cast<int>(std::lround(std::sqrt((row.size - 2.0) / 10))));
  const auto folder = testing::meshFolder();
  if (!folder) throw std::runtime_error("POLESTAR_MESHES is not set");
  return repairMesh(readMesh(*folder / row.shape).mesh).mesh;
}

void put(Json& result, const char* key, const Cost& cost) {
  result[key] = {{"wall", cost.wall}, {"cpu", cost.cpu}};
}

void putErrors(Json& result, const ExactSolid& solid, const Reference& reference,
               const std::vector<double>& green) {
  double max = 0, sum = 0;
  for (std::size_t i = 0; i < green.size(); ++i) {
    const double error = std::abs(solid.harmonicRadius * (green[i] - reference.green[i]));
    if (!(error <= max)) max = error;
    sum += error * error;
  }
  result["error_max"] = max;
  result["error_rms"] = std::sqrt(sum / static_cast<double>(green.size()));
}

/// rho |G| at vertices and at random places of edges and faces, as many of each: places that the solver,
/// which samples at fixed ones, has not seen.
double checkBoundary(const GreenFunction& green) {
  constexpr std::size_t kEach = 6000;
  const TriMesh& mesh = green.shape().mesh();
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> triangle(0, mesh.triangles.size() - 1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < kEach; ++i) {
    const std::size_t t = triangle(random), u = triangle(random);
    points.push_back(mesh.corner(t, static_cast<int>(i % 3)));
    const double s = uniform(random);
    points.push_back((1 - s) * mesh.corner(t, 0) + s * mesh.corner(t, 1));
    double a = uniform(random), b = uniform(random);
    if (a + b > 1) a = 1 - a, b = 1 - b;
    points.push_back((1 - a - b) * mesh.corner(u, 0) + a * mesh.corner(u, 1) + b * mesh.corner(u, 2));
  }
  std::vector<double> value(points.size());
  std::vector<Vec3> gradient(points.size());
  green.evaluate(points, value, gradient);
  double worst = 0;
  for (const double g : value) {
    const double error = std::abs(green.harmonicRadius() * g);
    if (!(error <= worst)) worst = error;
  }
  return worst;
}

/// Everything that the library's public solver offers goes through here.
GreenOptions greenOptions(const Row& row) {
  GreenOptions options;
  if (row.tolerance > 0) options.tolerance = row.tolerance;
  if (row.method != "layer") options.solver = GreenSolver::mfs;
  if (row.method == "mfs-best") options.mfs.mode = MfsMode::smooth;
  return options;
}

void putSources(Json& result, const GreenSources& sources) {
  if (const auto* charges = std::get_if<PointSources>(&sources)) {
    result["unknowns"] = charges->charges.size();
  } else {
    result["unknowns"] = result["layer_vertices"] = std::get<SurfaceLayer>(sources).density.size();
  }
}

Json runSolver(const Row& row, const Reference* reference) {
  const ExactSolid* exact = exactOrNull(row.shape);
  const TriMesh mesh = surfaceOf(row);
  StarOptions star;
  if (exact) star.center = exact->pole;

  Json result{{"status", "ok"}, {"surface", mesh.vertices.size()}};
  const PeakMemory memory;
  Stopwatch watch;
  const StarShape shape = verifyStarShape(verifyClosedSurface(mesh), star);
  put(result, "setup", watch.lap());
  const GreenFunction green = solveGreen(shape, greenOptions(row));
  put(result, "solve", watch.lap());
  result["peak_bytes"] = memory.bytes();
  putSources(result, green.sources());
  result["iterations"] = green.record().summary.iterations;
  result["passes"] = green.record().summary.passes;
  result["stop"] = green.record().summary.stop;
  result["boundary_error"] = green.boundaryError().max;
  result["boundary_check"] = checkBoundary(green);
  if (green.charge()) {
    result["charge"] = *green.charge();
    result["unresolved_area"] = green.record().unresolvedArea;
  }
  if (!reference) return result;

  const Frame& frame = shape.frame();
  std::vector<Vec3> points, gradient(reference->points.size());
  for (const Vec3& x : reference->points) points.push_back(frame.toInner(x));
  std::vector<double> values(points.size());
  green.evaluate(points, values, gradient);
  for (double& value : values) value /= frame.unit;
  putErrors(result, *exact, *reference, values);
  return result;
}

/// G = 1/|x - c| + h from the peers' h.
std::vector<double> withPole(const ExactSolid& solid, const std::vector<Vec3>& points,
                             std::vector<double> h) {
  for (std::size_t i = 0; i < points.size(); ++i) h[i] += 1 / (points[i] - solid.pole).norm();
  return h;
}

Json runVoxels(const Row& row, const Reference& reference) {
  const ExactSolid& solid = exactSolid(row.shape);
  const Vec3 pole = solid.pole;
  // Looser than this the error grows, tighter it stays.
  VoxelPoissonOptions options{.dim = row.size, .boundary = VoxelBoundary::neighbours, .residual = 1e-5};
  if (row.method == "openvdb-cut") {
    options.boundary = VoxelBoundary::crossings;
    options.residual = 1e-7;
  }
  Json result{{"status", "ok"}};
  const PeakMemory memory;
  Stopwatch watch;
  VoxelPoisson poisson({solid.box, solid.inside, [pole](const Vec3& x) { return -1 / (x - pole).norm(); }},
                       options);
  put(result, "setup", watch.lap());
  const int iterations = poisson.solve();
  put(result, "solve", watch.lap());
  result["peak_bytes"] = memory.bytes();
  result["surface"] = poisson.boundaryVoxels();
  result["unknowns"] = poisson.voxels();
  result["iterations"] = iterations;
  std::vector<double> h(reference.points.size());
  poisson.evaluate(reference.points, h);
  putErrors(result, solid, reference, withPole(solid, reference.points, h));
  return result;
}

Json runTetrahedra(const Row& row, const Reference& reference) {
  const ExactSolid& solid = exactSolid(row.shape);
  const TriMesh surface = solid.surface(row.size);
  Json result{{"status", "ok"}, {"surface", surface.vertices.size()}};
  const PeakMemory memory;
  Stopwatch watch;
  const std::optional<TetMesh> mesh = tetrahedralize(surface);
  if (!mesh) return {{"status", "not installed"}};
  put(result, "setup", watch.lap());
  const TetSolution solution =
      solveTetLaplacian(*mesh, [&](const Vec3& x) { return -1 / (x - solid.pole).norm(); });
  put(result, "solve", watch.lap());
  result["peak_bytes"] = memory.bytes();
  result["unknowns"] = mesh->vertices.size() - mesh->surfaceVertices;
  result["iterations"] = solution.iterations;
  std::vector<double> h(reference.points.size());
  interpolateOnTets(*mesh, solution.h, reference.points, h);
  putErrors(result, solid, reference, withPole(solid, reference.points, h));
  return result;
}

}  // namespace

Json runRow(const Row& row, const Reference* reference) {
  Json result = toJson(row);
  if (method(row.method).voxels) {
    result.update(runVoxels(row, *reference));
  } else if (row.method == "fem") {
    result.update(runTetrahedra(row, *reference));
  } else {
    result.update(runSolver(row, reference));
  }
  return result;
}

}  // namespace polestar::bench
