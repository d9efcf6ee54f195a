#include "cli/solid_input.h"

#include <cmath>
#include <string>

#include "cli/map_input.h"
#include "cli/outputs.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/mesh/repair.h"

namespace polestar::cli {
namespace {

using Rows = std::vector<std::vector<std::string>>;

constexpr const char* kIndent = "  ";

/// The members of `check` in the schema's order, before anything is known.
void declareMembers(Json& json) {
  json["valid"] = false;
  json["star"] = false;
  for (const char* name : {"center", "center_margin", "margin", "margin_relative", "vertices", "triangles",
                           "euler", "components", "witness_faces", "bad_area_fraction", "rays"}) {
    json[name] = nullptr;
  }
}

void fillRepair(Json& json, const RepairReport& repair) {
  json["repair"] = {
      {"welded_vertices", repair.weldedVertices},           {"unused_vertices", repair.unusedVertices},
      {"degenerate_triangles", repair.degenerateTriangles}, {"zero_area_triangles", repair.zeroAreaTriangles},
      {"duplicate_triangles", repair.duplicateTriangles},   {"flipped_triangles", repair.flippedTriangles},
      {"turned_inside_out", repair.turnedInsideOut}};
}

void fillSurface(Json& json, const SurfaceReport& surface) {
  json["valid"] = surface.valid;
  json["vertices"] = surface.vertices;
  json["triangles"] = surface.triangles;
  json["euler"] = surface.euler;
  json["components"] = surface.components;
}

void fillStar(Json& json, const StarReport& star) {
  json["star"] = star.star;
  json["center"] = toJson(star.center);
  json["center_margin"] = star.centerMargin;
  json["margin"] = star.margin;
  json["margin_relative"] = star.marginRelative;
  json["witness_faces"] = star.witnessFaces;
  json["bad_area_fraction"] = star.badAreaFraction;
  json["rays"] = {{"count", star.rays.count}, {"failed", star.rays.failed}};
}

Rows surfaceRows(const SurfaceReport& surface, const RepairReport& repair) {
  std::string topology = counted(surface.components, "component", "components");
  if (surface.valid) topology = "closed, genus 0";
  return {{"surface", counted(surface.vertices, "vertex", "vertices") + ", " +
                          counted(surface.triangles, "triangle", "triangles") + "; " + topology},
          {"repair", repair.summary()}};
}

Rows starRows(const StarReport& star) {
  Rows rows;
  const std::string relative = shortNumber(std::abs(star.marginRelative)) + " of the box's diagonal";
  if (star.star) {
    rows.push_back({"center", shortPoint(star.center) + "; " + shortNumber(star.centerMargin) +
                                  " inside the nearest face's plane"});
    rows.push_back({"margin", shortNumber(star.margin) + " at the best point: " + relative});
  } else {
    rows.push_back({"center", "none; the least bad point is " + shortPoint(star.center)});
    rows.push_back(
        {"margin", shortNumber(star.margin) + ": the best point is " + relative + " short of a center"});
    rows.push_back({"unseen", shortNumber(100 * star.badAreaFraction) + " % of the area, worst near " +
                                  shortPoint(star.badPlace)});
  }
  if (star.rays.count > 0) {
    rows.push_back({"rays", grouped(star.rays.count - star.rays.failed) + " of " + grouped(star.rays.count) +
                                " from there meet the surface once"});
  }
  return rows;
}

MeshFile surfaceOfGrids(const std::filesystem::path& path, Session& session) {
  const SampledGrids grids(path);
  const std::filesystem::path beside = mapFileBeside(path);
  if (!grids.metadata("polestar:map_hash").empty() && std::filesystem::exists(beside)) {
    session.context().log(LogLevel::warning, path.string() + " has a map already, " + beside.string() +
                                                 "; what is read here is the surface of its voxels, as if it "
                                                 "had none");
  }
  return {solidSurface(grids, path.string()), "vdb", 0};
}

}  // namespace

TriMesh solidSurface(const SampledGrids& grids, const std::string& name, const SurfaceChoice& choice) {
  const SampledGrid* solid = grids.solidGrid();
  if (!solid) {
    throw Error(Errc::io, name +
                              " does not say where a solid is: it has no level set and no fog, such as the "
                              "grids surface and density");
  }
  std::optional<TriMesh> surface;
  try {
    surface = grids.extractSurface(choice);
  } catch (const Error& error) {
    throw Error(error.code(), name + ": " + error.what());
  }
  if (!surface) {
    throw Error(Errc::io, name + ": the grid " + solid->name() + " has no surface where its value is " +
                              shortNumber(choice.level.value_or(solid->isFog() ? 0.5 : 0)));
  }
  return std::move(*surface);
}

MeshFile loadMesh(const std::filesystem::path& path, Session& session) {
  if (isStandardStream(path)) {
    throw Error(Errc::usage,
                "a mesh is not read from standard input, its format is told by its name; give a file");
  }
  return session.timed(
      "load", [&] { return path.extension() == ".vdb" ? surfaceOfGrids(path, session) : readMesh(path); });
}

InspectedSolid inspectSolid(const std::filesystem::path& path, const StarOptions& options, Session& session) {
  Json& json = session.json();
  declareMembers(json);
  const MeshFile file = loadMesh(path, session);
  return session.timed("check", [&]() -> InspectedSolid {
    const std::string name = path.filename().string();
    RepairedMesh repaired = repairMesh(file.mesh);
    fillRepair(json, repaired.report);
    if (repaired.report.changedAnything()) session.context().log(LogLevel::info, repaired.report.summary());

    const SurfaceReport report = inspectSurface(repaired.mesh);
    fillSurface(json, report);
    Rows rows = surfaceRows(report, repaired.report);
    if (!report.valid) {
      session.text() = name + " does not bound a solid\n" + table(rows, {}, kIndent);
      throw Error(Errc::invalidSurface, path.string() + ": " + report.defect);
    }
    ClosedSurface surface = verifyClosedSurface(std::move(repaired.mesh));

    StarReport star = inspectStar(surface, options, session.context());
    fillStar(json, star);
    const Rows more = starRows(star);
    rows.insert(rows.end(), more.begin(), more.end());
    session.text() =
        name + (star.star ? " is star-shaped\n" : " is not star-shaped\n") + table(rows, {}, kIndent);
    if (!star.star) throw Error(Errc::notStarShaped, path.string() + ": " + star.reason);
    return {std::move(surface), std::move(star)};
  });
}

}  // namespace polestar::cli
