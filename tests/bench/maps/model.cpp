#include "model.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>

#include "choices.h"
#include "galaxy_maps.h"
#include "measure.h"
#include "measures.h"
#include "peers.h"
#include "polestar/pipeline.h"
#include "support/solids.h"
#include "tet_map.h"
#include "tetgen.h"

namespace polestar::bench {
namespace {

constexpr std::size_t kPoints = 40000;
constexpr std::size_t kRoundTrips = 10000;
constexpr int kHexahedra = 16;
/// The core's default radius: inside lines are bent, by design.
constexpr double kCore = BallMapOptions{}.coreRadius;

/// What all parts of a model start from.
struct Solved {
  GreenChart chart;
  double secondsOfGreen, secondsOfTrace;

  const StarShape& shape() const { return chart.green().shape(); }
};

Solved solve(const std::filesystem::path& file) {
  const StarShape shape = subdivide(testing::starShapeFromFile(file), MapOptions{}.largestAngle);
  Stopwatch watch;
  const GreenFunction green = solveGreen(shape);
  const double secondsOfGreen = watch.lap().wall;
  GreenChart chart = traceChart(green);
  return {std::move(chart), secondsOfGreen, watch.lap().wall};
}

struct Made {
  BallMap map;
  double seconds;
};

/// The map of a choice, and the seconds that it takes after the trace.
Made make(const Solved& solved, const Choice& choice) {
  Stopwatch watch;
  const MapOptions options = choice.options();
  BoundaryChoice boundary = chooseBoundary(solved.chart, options);
  BallMap map(solved.chart, std::move(boundary.sphere), options.ball, std::move(boundary.radius));
  return {std::move(map), watch.lap().wall};
}

/// |f| below which the map is left out of what is said of right angles.
double coreOf(const BallMap& map) {
  if (map.options().core == CoreMode::paper) return kCore;
  return std::max(kCore, map.radius().value(map.options().coreRadius));
}

Json toJson(const HexDistortion& hex) {
  return {{"cells", hex.cells}, {"bad", hex.bad}, {"min", hex.min}, {"p1", hex.p1}, {"mean", hex.mean}};
}

Json toJson(const Spread& spread) { return {{"mean", spread.mean}, {"p99", spread.p99}}; }

Json rowOf(const std::string& model, Part part) {
  return {{"model", model}, {"part", toString(part)}, {"status", "ok"}};
}

Json describeChart(const ChartReport& report) {
  return {{"cells", report.cells.cells},
          {"bad", report.cells.bad()},
          {"retraced", report.retraced},
          {"added", report.added},
          {"replaced", report.repaired + report.failed},
          {"rays", report.rayLines},
          {"largest_move_ball", report.largestMoveInBall},
          {"omega_flips", report.directionFlips}};
}

struct Judged {
  Certificate certificate;
  std::size_t filteredVoxels;
  double secondsOfSampling, secondsOfJudging;
};

Judged judge(const BallMap& map, double voxel) {
  Stopwatch watch;
  SolidGrids grids = gridsOf(map, {.voxelSize = voxel});
  const MendedVoxels filtered = mendVoxels(grids);
  const double sampling = watch.lap().wall;
  Certificate certificate = certifyGrids(map, grids);
  return {std::move(certificate), filtered.voxels, sampling, watch.lap().wall};
}

std::string failureOf(const Certificate& certificate) {
  const Check* failure = certificate.firstFailure();
  return failure ? failure->name + ": " + failure->detail : "";
}

/// Verdicts of the other choices that methods are compared with.
Json judgeOthers(const Solved& solved, double voxel) {
  Json list = Json::array();
  for (const Choice& choice : choices().subspan(1)) {
    if (!choice.compared) continue;
    const Certificate certificate = judge(make(solved, choice).map, voxel).certificate;
    list.push_back({{"choice", choice.name},
                    {"verdict", toString(certificate.verdict)},
                    {"failure", failureOf(certificate)}});
  }
  return list;
}

Json measureMap(const Solved& solved, int dim, const PeakMemory& memory) {
  const auto [map, secondsOfSphere] = make(solved, choices().front());
  const double voxel = voxelSizeFor(solved.shape().surface().mesh(), dim);
  const auto [certificate, filtered, sample, certify] = judge(map, voxel);
  const GreenFunction& green = solved.chart.green();
  const CellQuality& cells = certificate.sampled;
  Json row{
      {"dim", dim},
      {"verdict", toString(certificate.verdict)},
      {"failure", failureOf(certificate)},
      {"boundary_error", green.boundaryError().max},
      {"unresolved_area", green.record().unresolvedArea},
      {"charge", green.record().charge.value_or(0)},
      {"chart", describeChart(solved.chart.report())},
      {"nodes_moved", solved.chart.movedNodes().size()},
      {"image_cells_bad", map.imageCells().bad()},
      {"voxel_cells",
       {{"cells", cells.cells},
        {"inverted", cells.inverted},
        {"inverted_deep", cells.invertedDeep},
        {"collapsed", cells.collapsed},
        {"filtered_voxels", filtered}}},
      {"round_trip", {{"voxels", certificate.roundTrip.max / voxel}, {"lost", certificate.roundTrip.lost}}},
      {"qc_mean", map.sphere().qcMean},
      {"seconds",
       {{"green", solved.secondsOfGreen},
        {"trace", solved.secondsOfTrace},
        {"sphere", secondsOfSphere},
        {"sample", sample},
        {"certify", certify}}},
      {"peak_bytes", memory.bytes()}};
  row["others"] = judgeOthers(solved, voxel);
  return row;
}

Json measureChoice(const Solved& solved, const Choice& choice, std::span<const Vec3> points) {
  const auto [map, seconds] = make(solved, choice);
  const SolidDistortion solid = measureSolid(map, points, coreOf(map));
  std::vector<Vec3> inside = testing::pointsInside(solved.shape(), kRoundTrips);
  const RoundTrip trip = measureRoundTrip(map, inside);
  const double diagonal = boundingBox(solved.shape().surface().mesh()).diagonal();
  return {{"choice", choice.name},
          {"boundary", toString(map.sphere().kind)},
          {"mips", toJson(solid.mips)},
          {"log_volume", solid.logVolumeDeviation},
          {"folded", solid.folded},
          {"hex", toJson(measureHexahedra(map, kHexahedra))},
          {"skew", toJson(solid.skew)},
          {"image_cells_bad", map.imageCells().bad()},
          {"round_trip", {{"diagonals", trip.max / diagonal}, {"lost", trip.lost}}},
          {"qc_mean", map.sphere().qcMean},
          {"core", map.options().core == CoreMode::smooth ? map.options().coreRadius : 0},
          {"seconds", seconds}};
}

Json measureChoices(const Solved& solved) {
  const std::vector<Vec3> points = latticePoints(solved.shape(), kPoints);
  Json row{{"choices", Json::array()}};
  for (const Choice& choice : choices()) row["choices"].push_back(measureChoice(solved, choice, points));
  return row;
}

/// What all methods are measured with on one mesh.
struct Yardstick {
  const Frame& frame;
  std::vector<Vec3> points;
  double core;

  Json measure(const char* method, double seconds, TetMesh mesh, std::vector<Vec3> image) const {
    const TetDistortion tets = measureTetrahedra(mesh, image);
    const TetMap map(frame, std::move(mesh), std::move(image));
    return {{"method", method},
            {"status", "ok"},
            {"tetrahedra", tets.tetrahedra},
            {"inverted", tets.inverted},
            {"inverted_on_surface", tets.invertedOnSurface},
            {"mips_by_solid", toJson(tets.mipsBySolid)},
            {"mips_by_ball", toJson(tets.mipsByBall)},
            {"log_volume", tets.logVolumeDeviation},
            {"hex", toJson(measureHexahedra(map, kHexahedra))},
            {"skew", toJson(measureSolid(map, points, core).skew)},
            {"seconds", seconds}};
  }
};

Json measureGalaxyMaps(const Yardstick& yardstick, const TetMesh& mesh, const std::vector<Vec3>& start,
                       double secondsOfStart, int limit) {
  const auto without = [](const std::string& status) {
    return Json{{"method", kGalaxyMaps}, {"status", status}};
  };
  const std::optional<std::filesystem::path> program = galaxyMapsProgram();
  if (!program) return without("not run");
  try {
    Stopwatch watch;
    std::optional<GalaxyMap> galaxy = repairByGalaxyMaps(*program, mesh, start, limit);
    if (!galaxy) return without("stopped after " + std::to_string(limit) + " s");
    return yardstick.measure(kGalaxyMaps, secondsOfStart + watch.lap().wall, std::move(galaxy->mesh),
                             std::move(galaxy->image));
  } catch (const std::exception& error) {
    return without(std::string("failed: ") + error.what());
  }
}

Json measureComparison(const Solved& solved, const MeasureOptions& options) {
  const TriMesh& surface = solved.shape().mesh();
  if (surface.vertices.size() > options.mostVertices) {
    return {{"status", "left out: more than " + std::to_string(options.mostVertices) + " vertices"}};
  }
  Stopwatch watch;
  const std::optional<TetMesh> mesh = tetrahedralize(surface);
  if (!mesh) return {{"status", "left out: tetgen is not installed"}};
  Json row{{"seconds_of_tetgen", watch.lap().wall},
           {"tetrahedra", mesh->tetrahedra.size()},
           {"methods", Json::array()}};
  std::vector<std::pair<const Choice*, Made>> ours;
  double core = kCore;
  for (const Choice& choice : choices()) {
    if (!choice.compared) continue;
    ours.emplace_back(&choice, make(solved, choice));
    core = std::max(core, coreOf(ours.back().second.map));
  }
  const Yardstick yardstick{solved.shape().frame(), latticePoints(solved.shape(), kPoints), core};
  row["core"] = core;
  for (const auto& [choice, made] : ours) {
    watch.lap();
    std::vector<Vec3> image = imagesByMap(*mesh, made.map);
    const double seconds = solved.secondsOfGreen + solved.secondsOfTrace + made.seconds + watch.lap().wall;
    row["methods"].push_back(yardstick.measure(choice->name, seconds, *mesh, std::move(image)));
  }
  watch.lap();
  std::vector<Vec3> cone = imagesByCone(*mesh, surface);
  row["methods"].push_back(yardstick.measure(kRadialCone, watch.lap().wall, *mesh, std::move(cone)));
  const SphereMap boundary = conformalSphereMap(solved.shape());
  const std::vector<Vec3> harmonic = imagesByHarmonicMap(*mesh, boundary.directions);
  const double seconds = watch.lap().wall;
  row["methods"].push_back(yardstick.measure(kHarmonicMap, seconds, *mesh, harmonic));
  row["methods"].push_back(measureGalaxyMaps(yardstick, *mesh, harmonic, seconds, options.galaxySeconds));
  return row;
}

}  // namespace

const char* toString(Part part) {
  switch (part) {
    case Part::map:
      return "map";
    case Part::choices:
      return "choices";
    case Part::comparison:
      break;
  }
  return "comparison";
}

Json failedRow(const std::string& model, Part part, const std::string& status) {
  Json row = rowOf(model, part);
  row["status"] = status;
  return row;
}

std::vector<Json> measureModel(const std::filesystem::path& file, const std::vector<Part>& parts,
                               const MeasureOptions& options) {
  const std::string model = file.filename().string();
  const PeakMemory memory;
  const Solved solved = solve(file);
  std::vector<Json> rows;
  for (const Part part : parts) {
    Json row = rowOf(model, part);
    row["vertices"] = solved.shape().mesh().vertices.size();
    try {
      row.update(part == Part::map       ? measureMap(solved, options.dim, memory)
                 : part == Part::choices ? measureChoices(solved)
                                         : measureComparison(solved, options));
    } catch (const std::exception& error) {
      row["status"] = std::string("failed: ") + error.what();
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace polestar::bench
