#include "cli/map_input.h"

#include <algorithm>
#include <map>

#include "cli/solid_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"

namespace polestar::cli {

void addMapOptions(CLI::App& app, MapChoices& choices) {
  static const std::map<std::string, SphereMapKind> kBoundaries = [] {
    std::map<std::string, SphereMapKind> names;
    for (const SphereMapKind kind : kSphereMapKinds) names[toString(kind)] = kind;
    return names;
  }();
  static const std::map<std::string, RadiusKind> kRadii = [] {
    std::map<std::string, RadiusKind> names;
    for (const RadiusKind kind : kRadiusKinds) names[toString(kind)] = kind;
    return names;
  }();
  static const std::map<std::string, CoreMode> kCores{{"smooth", CoreMode::smooth},
                                                      {"paper", CoreMode::paper}};
  static const std::map<std::string, GreenSolver> kSolvers{{"layer", GreenSolver::layer},
                                                           {"mfs", GreenSolver::mfs}};
  static const std::map<std::string, MfsMode> kMfsModes{{"paper", MfsMode::paper},
                                                        {"smooth", MfsMode::smooth}};
  app.add_option("--boundary", choices.boundary,
                 "How the surface goes onto the sphere: conformal (default) keeps angles of the surface, "
                 "field-line the directions in which field lines leave the center (best for hexahedra, and "
                 "the default "
                 "of cubes and polycubes), balanced "
                 "distorts the solid least (best for textures), radial projects from the center")
      ->transform(CLI::CheckedTransformer(kBoundaries).description(""))
      ->type_name("KIND");
  app.add_option(
         "--radius", choices.radius,
         "How far from the middle of the ball: green (default) is 1/(1 + rho G), volume gives equal "
         "shells equal volumes, mixed is their mean, balanced distorts least (default with --boundary "
         "balanced)")
      ->transform(CLI::CheckedTransformer(kRadii).description(""))
      ->type_name("KIND");
  app.add_option(
         "--balance-volume", choices.balanceVolume,
         "Weight of even volumes against even angles in a balanced boundary or radius: 0 is angles alone, "
         "0.03 the default, 0.1 evens volumes out at some cost in angles")
      ->check(CLI::NonNegativeNumber.description(""))
      ->type_name("MU");
  app.add_option(
         "--core", choices.core,
         "Near the center: smooth (default) turns into a rotation there, paper keeps field lines throughout")
      ->transform(CLI::CheckedTransformer(kCores).description(""))
      ->type_name("KIND");
  app.add_option(
         "--solver", choices.solver,
         "For Green's function: layer (default) or mfs, point charges outside as in the paper: slower, "
         "dense, for meshes up to about 10,000 vertices")
      ->transform(CLI::CheckedTransformer(kSolvers).description(""))
      ->type_name("KIND");
  app.add_option(
         "--mfs", choices.mfs,
         "Of the solver mfs: paper (default) has the paper's parameters, smooth fits the smooth surface that "
         "the vertices lie on")
      ->transform(CLI::CheckedTransformer(kMfsModes).description(""))
      ->type_name("KIND");
  app.add_option("--tolerance", choices.tolerance,
                 "Error of rho G aimed at on the surface; the solver splits triangles until it holds")
      ->check(CLI::PositiveNumber.description(""))
      ->capture_default_str()
      ->type_name("E");
  app.add_flag(
      "--prove", choices.prove,
      "Bound the error of rho G everywhere, all that its evaluation adds included, instead of sampling "
      "it, and enclose the signs that leave G no critical point but the center; takes seven to ten times as "
      "long as solving");
  addDeviceOption(app, choices.device);
  addCenterOption(app, choices.center);
}

bool isMapName(const std::filesystem::path& path) {
  return path.extension() == ".pmap" || path.extension() == ".vdb";
}

std::filesystem::path mapFileBeside(const std::filesystem::path& path) {
  return std::filesystem::path(path).replace_extension(".pmap");
}

namespace {

Json describeMfs(const MfsSummary& mfs, double unit) {
  return {{"mode", mfs.mode == MfsMode::paper ? "paper" : "smooth"},
          {"sources", mfs.sources},
          {"left_out", mfs.leftOut},
          {"offset", mfs.offset * unit},
          {"cutoff", mfs.cutoff},
          {"rank", mfs.rank},
          {"reciprocal_condition", mfs.reciprocalCondition},
          {"collocation_error", mfs.collocationError},
          {"held_out_error", mfs.mode == MfsMode::smooth ? Json(mfs.heldOutError) : Json()}};
}

Json describeSigns(const std::vector<SignProof>& proofs, const Frame& frame) {
  const auto sign = [](const SignProof::Sign& s) {
    return Json{{"failed", s.failed}, {"refuted", s.refuted}, {"worst", s.worst}};
  };
  Json list = Json::array();
  for (const SignProof& proof : proofs) {
    Json weakest = Json::array();
    for (const SignProof::Face& face : proof.weakest) {
      weakest.push_back({{"place", toJson(frame.toWorld(face.place))},
                         {"radial", face.radial},
                         {"normal", face.normal},
                         {"seen", face.seen}});
    }
    list.push_back({{"delta", proof.delta},
                    {"proved", proof.proved()},
                    {"faces", proof.faces},
                    {"radial", sign(proof.radial)},
                    {"normal", sign(proof.normal)},
                    {"weakest", weakest},
                    {"points", proof.points},
                    {"seconds", proof.seconds}});
  }
  return list;
}

/// The members of `map` that its stages know.
void describeMap(const BallMap& map, const MapChoices& choices, Session& session) {
  const GreenFunction& green = map.chart().green();
  const double unit = green.shape().frame().unit;
  const double diagonal = boundingBox(green.shape().surface().mesh()).extent().norm();
  const GreenRecord& record = green.record();
  const BoundaryError& error = record.boundaryError;
  const ChartReport& lines = map.chart().report();
  Json& json = session.json();
  json["solver"] = record.summary.solver;
  json["harmonic_radius"] = record.harmonicRadius * unit;
  json["boundary_error"] = {{"max", error.max},
                            {"rms", error.rms},
                            {"points", error.points},
                            {"kind", error.bound ? "bound" : "sampled"},
                            {"sampled", error.bound ? error.sampled : error.max},
                            {"worst", toJson(green.shape().frame().toWorld(error.worst))}};
  json["charge"] = record.charge ? Json(*record.charge) : Json();
  json["green"] = {{"iterations", record.summary.iterations},
                   {"passes", record.summary.passes},
                   {"device", record.summary.device},
                   {"residual", record.summary.residual},
                   {"accuracy", record.accuracy},
                   {"stop", record.summary.stop},
                   {"seconds", record.summary.seconds},
                   {"unresolved_area", record.unresolvedArea}};
  if (const auto* layer = std::get_if<SurfaceLayer>(&green.sources())) {
    json["green"]["layer_vertices"] = layer->mesh.vertices.size();
  }
  if (error.bound) json["green"]["seconds_of_proof"] = record.summary.secondsOfProof;
  json["field_signs"] = describeSigns(record.signs, green.shape().frame());
  if (record.mfs) json["green"]["mfs"] = describeMfs(*record.mfs, unit);
  json["radius"] = {{"kind", toString(map.radius().kind())},
                    {"slope_at_center", map.radius().derivative(0)},
                    {"slope_at_surface", map.radius().derivative(1)}};
  const std::optional<double> balanceVolume = balanceVolumeOf(map, choices);
  json["balance_volume"] = balanceVolume ? Json(*balanceVolume) : Json();
  json["sphere"] = {{"kind", toString(map.sphere().kind)}, {"flips", map.sphere().flips},
                    {"omega_flips", lines.directionFlips}, {"qc_mean", map.sphere().qcMean},
                    {"qc_max", map.sphere().qcMax},        {"fallback", map.sphere().fallbackReason}};
  json["core"] = {{"kind", map.options().core == CoreMode::smooth ? "smooth" : "paper"},
                  {"radius", map.options().core == CoreMode::smooth ? map.options().coreRadius : 0.0},
                  {"fallback", map.coreFallbackReason()}};
  json["foliation"] = {{"levels", map.chart().foliation().levels.size()},
                       {"cells", lines.cells.cells},
                       {"inverted", lines.cells.inverted},
                       {"flat", lines.cells.flat},
                       {"lines", lines.lines},
                       {"lines_deepened", lines.deepened},
                       {"lines_failed", lines.failed},
                       {"lines_retraced", lines.retraced},
                       {"lines_added", lines.added},
                       {"lines_repaired", lines.repaired},
                       {"lines_on_rays", lines.rayLines},
                       {"nodes_moved", map.chart().movedNodes().size()},
                       {"largest_move", lines.largestMove * unit},
                       {"largest_move_diagonal", lines.largestMove * unit / diagonal},
                       {"largest_move_ball", lines.largestMoveInBall},
                       {"image_cells_bad", map.imageCells().bad()}};
}

}  // namespace

MapOptions toMapOptions(const MapChoices& choices) {
  MapOptions options;
  options.boundary = choices.boundary.value_or(SphereMapKind::conformal);
  options.radius = choices.radius;
  options.green.tolerance = choices.tolerance;
  options.green.prove = choices.prove;
  options.green.solver = choices.solver;
  options.green.mfs.mode = choices.mfs;
  options.green.device = choices.device;
  options.ball.core = choices.core;
  if (choices.balanceVolume) {
    if (choices.boundary != SphereMapKind::balanced && choices.radius != RadiusKind::balanced) {
      throw Error(Errc::usage,
                  "--balance-volume has no effect here; add --boundary balanced or --radius balanced");
    }
    options.balance.volumeWeight = *choices.balanceVolume;
    options.balance.validate();
  }
  return options;
}

std::optional<double> balanceVolumeOf(const BallMap& map, const MapChoices& choices) {
  if (map.sphere().kind != SphereMapKind::balanced && map.radius().kind() != RadiusKind::balanced)
    return std::nullopt;
  return choices.balanceVolume.value_or(BalanceOptions{}.volumeWeight);
}

BallMap makeMap(const std::filesystem::path& mesh, const MapChoices& choices, Session& session) {
  const MapOptions options = toMapOptions(choices);
  const InspectedSolid solid = inspectSolid(mesh, StarOptions{.center = choices.center}, session);
  const StarShape shape = verifyStarShape(solid.surface, StarOptions{.center = solid.star.center, .rays = 0});
  MapTimings timings;
  BallMap map = mapToBall(shape, options, session.context(), &timings);
  session.noteSeconds("green", timings.green);
  session.noteSeconds("trace", timings.trace);
  session.noteSeconds("sphere", timings.sphere);
  describeMap(map, choices, session);
  return map;
}

namespace {

const char* timingOf(const std::string& whose) {
  return whose == "target" ? "map_target" : whose == "shape" ? "map_shape" : "map_source";
}

/// With the library's defaults; `what` begins the messages of errors.
BallMap mapSurface(const TriMesh& surface, const std::string& what, const std::string& whose,
                   Session& session) {
  return session.timed(timingOf(whose), [&] {
    try {
      const ClosedSurface closed = verifyClosedSurface(repairMesh(surface).mesh);
      return mapToBall(verifyStarShape(closed, {}, session.context()), {}, session.context());
    } catch (const Error& error) {
      if (error.code() == Errc::cancelled) throw;
      throw Error(error.code(), what + ": " + error.what());
    }
  });
}

}  // namespace

BallMap mapOwnSurface(const SampledGrids& grids, const std::string& name, const std::string& whose,
                      Session& session) {
  const bool hadOne = !grids.metadata("polestar:map_hash").empty();
  session.context().log(
      hadOne ? LogLevel::warning : LogLevel::info,
      name + (hadOne ? ": its .pmap does not lie beside it, so its own surface gets a new map; "
                       "name the .pmap if you have it"
                     : ": no map is given or lies beside, its own surface gets one"));
  return mapSurface(solidSurface(grids, name), "the " + whose + "'s own body, the surface in " + name, whose,
                    session);
}

BallMap loadOrMakeMap(const std::filesystem::path& path, const std::string& whose, Session& session) {
  if (path.extension() != ".vdb" || std::filesystem::exists(mapFileBeside(path)))
    return loadMap(path, session);
  const SampledGrids grids = session.timed("load", [&] { return SampledGrids(path); });
  return mapOwnSurface(grids, path.string(), whose, session);
}

BallMap loadOrMapSolid(const std::filesystem::path& path, const std::string& whose, Session& session) {
  if (isMapName(path)) return loadOrMakeMap(path, whose, session);
  return mapSurface(loadMesh(path, session).mesh, path.string(), whose, session);
}

BallMap loadMap(const std::filesystem::path& path, Session& session) {
  return std::move(loadMapFile(path, session).map);
}

MapFile loadMapFile(const std::filesystem::path& path, Session& session) {
  const std::filesystem::path file = mapFileBeside(path);
  if (!std::filesystem::exists(file)) {
    throw Error(Errc::io,
                path.string() + ": the map itself, " + file.string() +
                    ", is not there; keep the .pmap beside its .vdb, or make both with polestar map");
  }
  return session.timed("load", [&] {
    MapFile map = readMapFile(file);
    if (path.extension() == ".vdb") {
      const std::vector<GridHeader> grids = readGridHeaders(path);
      const bool belongs = std::any_of(grids.begin(), grids.end(), [&](const GridHeader& grid) {
        return std::find(grid.metadata.begin(), grid.metadata.end(),
                         std::pair<std::string, std::string>("polestar:map_hash", map.hash)) !=
               grid.metadata.end();
      });
      if (!belongs) {
        throw Error(Errc::io, path.string() + " was not made from " + file.string() +
                                  " (polestar:map_hash differs or is missing); name the .pmap that you mean");
      }
    }
    return map;
  });
}

}  // namespace polestar::cli
