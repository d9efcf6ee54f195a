#include "pair.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "level_set_paths.h"
#include "measure.h"
#include "polestar/map/alignment.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "polestar/mesh/self_intersection.h"
#include "polestar/mesh/shapes.h"
#include "polestar/morph/frame_proof.h"
#include "polestar/morph/morph_grids.h"
#include "polestar/morph/morph_path.h"
#include "polestar/pipeline.h"
#include "polestar/sphere/reach.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar::bench {
namespace {

namespace fs = std::filesystem;

constexpr double kSurfaceVoxels = 0.25;  // as `polestar morph` has it
constexpr int kPadding = 3;

/// Around the origin: level sets that do not overlap have no way into one another.
TriMesh centered(const StarShape& shape) {
  TriMesh mesh = shape.surface().mesh();
  for (Vec3& v : mesh.vertices) v -= shape.frame().origin;
  return mesh;
}

double volumeOf(const TriMesh& mesh) {
  double six = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    six += mesh.corner(t, 0).dot(mesh.corner(t, 1).cross(mesh.corner(t, 2)));
  return six / 6;
}

std::size_t hiddenFromOrigin(const TriMesh& mesh) {
  std::size_t count = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    count += !(mesh.corner(t, 0).dot(mesh.corner(t, 1).cross(mesh.corner(t, 2))) > 0);
  return count;
}

/// What all methods of a pair start from.
struct Solids {
  std::vector<MorphShape> shapes;
  TriMesh first, last;
  double voxel = 0, secondsOfMaps = 0;
};

Solids load(const Pair& pair, int dim) {
  const auto read = [](const std::string& file) {
    const fs::path own = fs::path(POLESTAR_VOLUMES_FOLDER) / file;
    return repairMesh(readMesh(fs::exists(own) ? own : *testing::meshFolder() / file).mesh).mesh;
  };
  const Mat3 turn = Eigen::AngleAxisd(pair.turn, Vec3(1, 1, 1).normalized()).toRotationMatrix();
  const TriMesh last = transformed(read(pair.last), [&](const Vec3& x) -> Vec3 { return turn * x; });
  Solids solids;
  Stopwatch watch;
  for (const TriMesh& mesh : {read(pair.first), last}) {
    // Moved before it is mapped, so that nothing of it is rounded twice.
    const TriMesh moved = centered(testing::starShape(mesh));
    solids.shapes.push_back(
        {mapToBall(subdivide(testing::starShape(moved, Vec3(0, 0, 0)), MapOptions{}.largestAngle)), nullptr});
    (solids.shapes.size() == 1 ? solids.first : solids.last) = moved;
  }
  if (pair.turn != 0) {
    const BallMap &from = solids.shapes[0].map, &to = solids.shapes[1].map;
    const Alignment found = alignSolids(from.chart().green().shape(), to.chart().green().shape());
    const LandmarkMatch match = alignedMotion(from, to, found.rotation);
    solids.shapes[1].motion = match.motion;
    solids.shapes[1].rotation = match.rotation;
  }
  solids.secondsOfMaps = watch.lap().cpu;
  solids.voxel = std::max(voxelSizeFor(solids.first, dim), voxelSizeFor(solids.last, dim));
  return solids;
}

Json rowOf(const Pair& pair, const char* method, const PairOptions& options) {
  return {{"pair", pair.name},
          {"method", method},
          {"status", "ok"},
          {"dim", options.dim},
          {"frame_count", options.frames},
          {"frames", Json::array()}};
}

double timeOf(int frame, const PairOptions& options) {
  return static_cast<double>(frame) / (options.frames - 1);
}

/// A frame that is a surface of triangles, around the origin.
Json frameOf(double t, const TriMesh& surface, double volume, std::size_t crossings) {
  const Topology topology = topologyOf(surface);
  return {{"t", t},
          {"volume", volume},
          {"parts", topology.parts},
          {"handles", topology.handles},
          {"crossings", crossings},
          {"hidden", hiddenFromOrigin(surface)}};
}

double offLast(const LevelSetPair& levelSets, const TriMesh& surface, double voxel) {
  return rootMeanSquare(levelSets.distancesToLast(surface.vertices)) / voxel;
}

Json ours(const Pair& pair, const MorphComplex& complex, PathKind kind, const LevelSetPair& levelSets,
          double voxel, const PairOptions& options) {
  Json row = rowOf(pair, toString(kind), options);
  const MorphPath path(complex, kind);
  const MorphTimeline timeline = MorphTimeline::passage(2, 1, options.frames, Ease::linear);
  double surfaceSeconds = 0, seconds = 0;
  TriMesh surface;
  for (int i = 0; i < options.frames; ++i) {
    Stopwatch watch;
    const MorphFrame frame = path.frame(timeline, i + 1, 24);
    const FrameProof proof = proveFrame(complex, frame.pose);
    surfaceSeconds += watch.lap().cpu;
    SolidGrids grids = morphGrids(complex, frame, {}, {.grids = {.voxelSize = voxel, .padding = kPadding}});
    const MendedVoxels mended = mendVoxels(grids);
    seconds += watch.lap().cpu;
    surface = surfaceOf(complex, frame.pose);
    row["frames"].push_back(frameOf(timeOf(i, options), surface, proof.volume, proof.crossings));
    Json& told = row["frames"].back();
    told["holds"] = proof.holds() && mended.cells.invertedDeep == 0;
    told["mended"] = frame.mending.moved;
    told["inverted_before"] = frame.mending.badBefore;
    told["inverted"] = proof.cells.bad();
    told["filtered"] = mended.voxels;
  }
  row["off_last_voxels"] = offLast(levelSets, surface, voxel);
  row["seconds_surface"] = surfaceSeconds / options.frames;
  row["seconds"] = (surfaceSeconds + seconds) / options.frames;
  return row;
}

Json linear(const Pair& pair, const char* method, const VertexPaths& paths, const LevelSetPair& levelSets,
            double voxel, const PairOptions& options) {
  Json row = rowOf(pair, method, options);
  double seconds = 0;
  TriMesh surface;
  for (int i = 0; i < options.frames; ++i) {
    Stopwatch watch;
    surface = paths.at(timeOf(i, options));
    seconds += watch.lap().cpu;
    row["frames"].push_back(
        frameOf(timeOf(i, options), surface, volumeOf(surface), findSelfIntersections(surface).pairs));
  }
  row["off_last_voxels"] = offLast(levelSets, surface, voxel);
  row["seconds"] = seconds / options.frames;
  return row;
}

Json onVoxels(const Pair& pair, const char* method, const LevelSetPair& levelSets, double voxel,
              const PairOptions& options) {
  Json row = rowOf(pair, method, options);
  int i = 0;
  TriMesh surface;
  const auto seen = [&](const LevelSetFrame& frame) {
    surface = frame.surface;
    const Topology topology = topologyOf(surface);
    row["frames"].push_back({{"t", timeOf(i++, options)},
                             {"volume", frame.volume},
                             {"parts", topology.parts},
                             {"handles", topology.handles}});
  };
  const auto frames = static_cast<std::size_t>(options.frames);
  const bool normalFlow = row["method"] == "LevelSetMorphing";
  const double seconds = normalFlow ? levelSets.morph(frames, seen) : levelSets.blend(frames, seen);
  row["off_last_voxels"] = offLast(levelSets, surface, voxel);
  row["seconds"] = seconds / (normalFlow ? options.frames - 1 : options.frames);
  return row;
}

}  // namespace

std::vector<Pair> pairs() {
  std::vector<Pair> all{
      {"smooth star, head", "smooth_star.ply", "head.ply"},
      {"head, pig", "head.ply", "pig.ply"},
      {"asteroid, twelve lobes", "asteroid.ply", "twelve_lobes.ply"},
      {"head, itself turned by 150 degrees", "head.ply", "head.ply", 150 * std::numbers::pi / 180}};
  if (testing::meshFolder()) {
    all.push_back({"castalia, geographos", "castalia.obj", "geographos.ply"});
    all.push_back({"bennu, KW4Alpha", "bennu.ply", "KW4Alpha.obj"});
  }
  return all;
}

Topology topologyOf(const TriMesh& surface) {
  std::vector<std::size_t> root(surface.vertices.size());
  std::iota(root.begin(), root.end(), std::size_t{0});
  const auto find = [&](std::size_t v) {
    while (root[v] != v) v = root[v] = root[root[v]];
    return v;
  };
  std::vector<bool> used(root.size(), false);
  for (const Triangle& t : surface.triangles) {
    for (int k = 0; k < 3; ++k) {
      const auto a = static_cast<std::size_t>(t[static_cast<std::size_t>(k)]),
                 b = static_cast<std::size_t>(t[static_cast<std::size_t>((k + 1) % 3)]);
      used[a] = true;
      root[find(a)] = find(b);
    }
  }
  Topology topology;
  long vertices = 0;
  for (std::size_t v = 0; v < root.size(); ++v) {
    if (!used[v]) continue;
    ++vertices;
    topology.parts += find(v) == v;
  }
  // V - E + F = 2 parts - 2 handles, and 2 E = 3 F on a closed surface.
  const long characteristic = vertices - static_cast<long>(surface.triangles.size()) / 2;
  topology.handles = static_cast<long>(topology.parts) - characteristic / 2;
  return topology;
}

TriMesh VertexPaths::at(double t) const {
  TriMesh mesh;
  mesh.triangles = triangles;
  for (std::size_t v = 0; v < first.size(); ++v) mesh.vertices.emplace_back((1 - t) * first[v] + t * last[v]);
  return mesh;
}

VertexPaths bySphereMaps(const MorphComplex& complex) {
  const Foliation& ball = complex.ball();
  const auto surface = [&](std::size_t shape) {
    std::vector<Vec3> points;
    for (std::size_t v = 0; v < ball.vertexCount; ++v)
      points.push_back(complex.center(shape) + complex.shape(shape).rotation * complex.nodes(shape)[v]);
    return points;
  };
  return {ball.triangles, surface(0), surface(1)};
}

VertexPaths byDirections(const MorphComplex& complex) {
  VertexPaths paths = bySphereMaps(complex);
  const StarShape& shape = complex.shape(1).map.chart().green().shape();
  const ExactReach reach(shape);
  for (std::size_t v = 0; v < paths.first.size(); ++v) {
    const Vec3 direction = paths.first[v] - complex.center(0);
    paths.last[v] = shape.frame().origin +
                    shape.frame().unit * reach.reach(direction) * direction / direction.cwiseAbs().maxCoeff();
  }
  return paths;
}

std::vector<Json> measurePair(const Pair& pair, const PairOptions& options) {
  Solids solids = load(pair, options.dim);
  const double voxel = solids.voxel;
  const LevelSetPair levelSets(solids.first, solids.last, voxel);
  Stopwatch watch;
  const MorphComplex complex(std::move(solids.shapes), {.surfaceTolerance = kSurfaceVoxels * voxel});
  const double secondsOfComplex = watch.lap().cpu;
  std::vector<Json> rows;
  for (const PathKind kind : {PathKind::straight, PathKind::radial}) {
    rows.push_back(ours(pair, complex, kind, levelSets, voxel, options));
    rows.back()["seconds_before"] = solids.secondsOfMaps + secondsOfComplex;
    rows.back()["cells"] = complex.ball().cellCount();
  }
  rows.push_back(linear(pair, "vertices, conformal", bySphereMaps(complex), levelSets, voxel, options));
  rows.push_back(linear(pair, "vertices, radial", byDirections(complex), levelSets, voxel, options));
  rows.push_back(onVoxels(pair, "LevelSetMorphing", levelSets, voxel, options));
  rows.push_back(onVoxels(pair, "blended distances", levelSets, voxel, options));
  for (Json& row : rows) {
    row["volumes_of_ends"] = {volumeOf(solids.first), volumeOf(solids.last)};
    row["triangles"] = complex.ball().triangles.size();
  }
  return rows;
}

}  // namespace polestar::bench
