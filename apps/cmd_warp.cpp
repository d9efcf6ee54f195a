// polestar warp: what lies in a solid goes over to its map's domain, back, or on into another solid. Points,
// surfaces, meshes of the solid with a report on their tetrahedra, and the grids of a .vdb.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <span>

#include <Eigen/LU>

#include "cli/dry_run.h"
#include "cli/grid_size.h"
#include "cli/outputs.h"
#include "cli/points.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "cli/warp_route.h"
#include "commands.h"
#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/mesh/read_tet_mesh.h"
#include "polestar/mesh/tet_orientation.h"
#include "polestar/mesh/write_mesh.h"
#include "polestar/mesh/write_tet_mesh.h"
#include "polestar/vdb/warp_grids.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultDim = 128;
constexpr std::size_t kMostNamed = 8;  // tetrahedra, where there are more

using Rows = std::vector<std::vector<std::string>>;

enum class Kind { points, surface, solidMesh, grids };

std::string lowerExtension(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return extension;
}

bool isPointsName(const fs::path& path) {
  const std::string extension = lowerExtension(path);
  return isStandardStream(path) || extension == ".txt" || extension == ".csv" || extension == ".xyz";
}

Kind kindOf(const fs::path& input) {
  if (isPointsName(input)) return Kind::points;
  if (isMeshOutputName(input)) return Kind::surface;
  if (isTetMeshName(input)) return Kind::solidMesh;
  if (lowerExtension(input) == ".vdb") return Kind::grids;
  throw Error(Errc::usage,
              "what is in " + input.string() +
                  "? Its name should end in .txt .csv .xyz (points), .obj .ply .stl .off (surface), .vtk "
                  ".mesh .msh .node (solid) or .vdb (grids)");
}

/// Names and endings of what a kind is written to.
struct OutputForm {
  const char* name;
  const char* endings;
  bool (*fits)(const fs::path&);
};

OutputForm formOf(Kind kind) {
  switch (kind) {
    case Kind::points:
      return {"points", ".txt, .csv or .xyz", isPointsName};
    case Kind::surface:
      return {"surface", ".obj, .ply, .off or .stl", isMeshOutputName};
    case Kind::solidMesh:
      return {"mesh of the solid", ".vtk, .mesh or .msh", isTetMeshOutputName};
    case Kind::grids:
      break;
  }
  return {"grids", ".vdb",
          [](const fs::path& path) { return isStandardStream(path) || lowerExtension(path) == ".vdb"; }};
}

// --- points ----------------------------------------------------------------------------------------------

std::string pointLines(const std::vector<Vec3>& points, char separator) {
  std::string text;
  for (const Vec3& point : points) {
    for (int axis = 0; axis < 3; ++axis) {
      if (axis > 0) text += separator;
      text += exactNumber(point[axis]);
    }
    text += '\n';
  }
  return text;
}

Json pointsJson(const std::vector<Vec3>& points) {
  Json list = Json::array();
  for (const Vec3& point : points) list.push_back(point.allFinite() ? toJson(point) : Json());
  return list;
}

// --- tetrahedra ------------------------------------------------------------------------------------------

Json signsJson(const TetSigns& signs) {
  return {{"positive", signs.positive}, {"negative", signs.negative}, {"flat", signs.flat}};
}

Json qualityJson(const TetQuality& quality) {
  return {{"least", quality.least}, {"one_percent", quality.onePercent}, {"mean", quality.mean}};
}

std::span<const std::size_t> firstBad(const TetReport& report) {
  return std::span(report.bad).first(std::min(report.bad.size(), kMostNamed));
}

Vec3 centroid(const Tetrahedron& t, const std::vector<Vec3>& vertices) {
  return (vertices[t[0]] + vertices[t[1]] + vertices[t[2]] + vertices[t[3]]) / 4;
}

/// Of the tetrahedra that turned over or went flat, those in whose middle the map itself does so: there it
/// folds. Elsewhere straight edges cannot follow a map that is one to one.
std::size_t countFolds(const TetReport& report, const TetMesh::Tetrahedra& tetrahedra,
                       const std::vector<Vec3>& before, const VolumeMap& map) {
  std::vector<Vec3> middles;
  for (const std::size_t t : report.bad) middles.push_back(centroid(tetrahedra.corners[t], before));
  std::vector<Mat3> jacobians(middles.size());
  map.jacobian(middles, jacobians);
  return static_cast<std::size_t>(std::count_if(jacobians.begin(), jacobians.end(), [](const Mat3& jacobian) {
    return jacobian.allFinite() && jacobian.determinant() <= 0;
  }));
}

Json reportJson(const TetReport& report, std::size_t folds, const TetMesh::Tetrahedra& tetrahedra,
                const std::vector<Vec3>& before, const std::vector<Vec3>& after) {
  Json first = Json::array();
  for (const std::size_t t : firstBad(report)) {
    first.push_back({{"cell", tetrahedra.cells[t]},
                     {"vertices", tetrahedra.corners[t]},
                     {"before", toJson(centroid(tetrahedra.corners[t], before))},
                     {"after", toJson(centroid(tetrahedra.corners[t], after))}});
  }
  return {{"count", report.tetrahedra},
          {"on_boundary", report.onBoundary},
          {"before", signsJson(report.before)},
          {"after", signsJson(report.after)},
          {"turned", report.turned},
          {"flattened", report.flattened},
          {"turned_on_boundary", report.turnedOnBoundary},
          {"flattened_on_boundary", report.flattenedOnBoundary},
          {"map_folds", folds},
          {"first", first},
          {"quality",
           {{"kind", "mean_ratio"},
            {"before", qualityJson(report.qualityBefore)},
            {"after", qualityJson(report.qualityAfter)}}}};
}

std::string signsText(const TetSigns& signs, const TetQuality& quality) {
  return grouped(signs.positive) + " positive, " + grouped(signs.negative) + " negative, " +
         grouped(signs.flat) + " flat; mean ratio " + shortNumber(quality.least) + " at least, " +
         shortNumber(quality.onePercent) + " at 1 %, " + shortNumber(quality.mean) + " on average";
}

Rows reportRows(const TetReport& report, std::size_t folds, const TetMesh::Tetrahedra& tetrahedra,
                const std::vector<Vec3>& before) {
  Rows rows{
      {"tetrahedra", grouped(report.tetrahedra) + "; " + grouped(report.onBoundary) +
                         " with all four vertices on the boundary"},
      {"before", signsText(report.before, report.qualityBefore)},
      {"after", signsText(report.after, report.qualityAfter)},
      {"turned over", grouped(report.turned) + " (" + grouped(report.turnedOnBoundary) +
                          " of them with all four vertices on the boundary); " + grouped(report.flattened) +
                          " went flat (" + grouped(report.flattenedOnBoundary) + ")"}};
  if (!report.good()) {
    rows.push_back({"", folds == 0
                            ? "the map itself folds in none of them: straight edges cannot follow it there"
                            : "the map itself folds in " + grouped(folds) + " of them"});
  }
  for (const std::size_t t : firstBad(report)) {
    rows.push_back({"", "cell " + std::to_string(tetrahedra.cells[t]) + " at " +
                            shortPoint(centroid(tetrahedra.corners[t], before))});
  }
  return rows;
}

std::string failure(const TetReport& report, std::size_t folds) {
  const std::size_t bad = report.turned + report.flattened;
  const std::size_t onBoundary = report.turnedOnBoundary + report.flattenedOnBoundary;
  std::string text = grouped(bad) + " of " + counted(report.tetrahedra, "tetrahedron", "tetrahedra") +
                     " turned over or went flat";
  if (onBoundary == bad) {
    return text +
           ", all with their four vertices on the boundary; split the edges that join two boundary "
           "vertices through the inside";
  }
  if (onBoundary > 0) text += ", " + grouped(onBoundary) + " of them with all vertices on the boundary";
  return text + "; refine the mesh there" + (folds > 0 ? ", and map the solid from a finer surface" : "");
}

class WarpCommand final : public Command {
 public:
  Description description() const override {
    return {"warp", "Carry points, surfaces, tetrahedra or grids through a map: solid to domain, back, or on",
            "The file to write, of the input's kind; points go to standard output without it",
            "polestar warp asteroid.vtk asteroid.pmap -o ball.vtk --json"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("INPUT", input_,
                   "Points (.txt .csv .xyz, - is standard input), a surface (.obj .ply .stl .off), a mesh of "
                   "the solid (.vtk .mesh .msh, or TetGen's .node and .ele) or grids (.vdb)")
        ->required()
        ->type_name("");
    app.add_option("MAP", choices_.map,
                   "A .pmap, or the .vdb beside it. The way ends in its domain: ball, cube or polycube")
        ->required()
        ->type_name("");
    app.add_flag("--inverse", choices_.inverse, "The same way back: from the domain to the solid of MAP");
    app.add_option("--to", choices_.to,
                   "By way of the ball to the solid of a second map; ball: end in the ball, whatever the "
                   "domain of MAP is")
        ->type_name("MAP2|ball");
    addAlignmentOptions(app, choices_.alignment,
                        {.from = "the solid of MAP",
                         .to = "that of MAP2",
                         .rotateHelp = "Turn the ball by these degrees about x, then y, then z"});
    app.add_flag("--exact", choices_.exact,
                 "Trace a field line from every point instead of reading the map's table; much slower");
    app.add_option("--snap", choices_.snap,
                   "Points outside by up to E box diagonals are taken for points of the surface")
        ->check(CLI::NonNegativeNumber.description(""))
        ->capture_default_str()
        ->type_name("E");
    size_.addOptions(app, "of grids, the output's", kDefaultDim);
    app.add_flag("--keep-failed", keepFailed_,
                 "Keep a mesh whose tetrahedra turned over or went flat (exit code 6)");
  }

  void run(Session& session) override {
    session.addInput(input_);
    session.addInput(choices_.map);
    if (toSecondMap()) session.addInput(choices_.to);
    addAlignmentInputs(choices_.alignment, session);
    const Kind kind = kindOf(input_);
    checkChoices(kind, session);
    const fs::path output = session.options().output;
    if (!output.empty()) checkOutput(output, session.options().overwrite, session.inputs());
    if (session.options().dryRun) {
      const OutputForm form = formOf(kind);
      return describePlan(session, {{output.empty() ? "-" : output, form.name, std::nullopt}});
    }
    OutputGuard guard(output.empty() ? std::vector<fs::path>{} : std::vector<fs::path>{output});
    carry(kind, output, session);
    guard.keep();
    if (failure_.empty()) return;
    throw Error(Errc::notConverged, failure_);
  }

 private:
  bool toSecondMap() const { return !choices_.to.empty() && choices_.to != kBallName; }

  void checkChoices(Kind kind, Session& session) const {
    const fs::path output = session.options().output;
    const OutputForm form = formOf(kind);
    if (output.empty() && kind != Kind::points) {
      throw Error(Errc::usage,
                  "-o FILE is missing; a " + std::string(form.name) + " is written as " + form.endings);
    }
    if (!output.empty() && !form.fits(output)) {
      throw Error(Errc::usage, "the output " + output.string() + " does not end in " + form.endings +
                                   ", as a " + form.name + " has to");
    }
    if (!toSecondMap() && choices_.alignment.any() && !choices_.alignment.rotate) {
      throw Error(Errc::usage,
                  "--landmarks, --align and --surface-map bring two solids into line; --to MAP2 is missing");
    }
    if (kind != Kind::grids && size_.given())
      throw Error(Errc::usage, "--voxel and --dim are for grids; " + input_.string() + " holds none");
    if (isStandardStream(output)) {
      if (session.options().json)
        throw Error(Errc::usage, "-o - and --json both want standard output; drop one");
      if (kind == Kind::grids) session.keepStandardOutputFree();
    }
  }

  void carry(Kind kind, const fs::path& output, Session& session) {
    static constexpr const char* kNames[] = {"points", "surface", "solid_mesh", "grids"};
    session.json()["kind"] = kNames[static_cast<int>(kind)];
    // Read before the maps: a mistake in the input shows at once.
    switch (kind) {
      case Kind::points:
        return carryPoints(session.timed("read", [&] { return readPoints(input_, session.context()); }),
                           output, session);
      case Kind::surface:
        return carrySurface(session.timed("read", [&] { return loadMesh(input_, session); }), output,
                            session);
      case Kind::solidMesh:
        return carrySolid(session.timed("read", [&] { return readTetMesh(input_); }), output, session);
      case Kind::grids:
        return carryGrids(output, session);
    }
  }

  Route loadRoute(Session& session) const {
    return session.timed("load", [&] { return Route(choices_, session); });
  }

  MovedPoints move(const Route& route, const std::vector<Vec3>& points, Session& session) const {
    route.describe(session.json());
    MovedPoints moved = session.timed("warp", [&] { return route.move(points, session); });
    session.json()["moved"] = describeMoved(moved, points);
    if (choices_.exact && route.answeredByTable() > 0) {
      session.json()["answered_by_table"] = route.answeredByTable();
      session.context().log(LogLevel::warning, grouped(route.answeredByTable()) +
                                                   " points could not be traced, as happens on the surface; "
                                                   "the table answered there");
    }
    return moved;
  }

  /// Vertices cannot be left out of a mesh.
  std::vector<Vec3> moveVertices(const Route& route, const std::vector<Vec3>& vertices,
                                 Session& session) const {
    MovedPoints moved = move(route, vertices, session);
    if (moved.complete()) {
      if (moved.snapped > 0) {
        session.context().log(LogLevel::info, grouped(moved.snapped) + " vertices lay outside, by up to " +
                                                  shortNumber(moved.farthestSnapped) +
                                                  ", and were taken for points of the surface");
      }
      return std::move(moved.points);
    }
    std::string message = input_.string() + ": " + missingPoints(moved, vertices, route, "vertices");
    if (moved.outside > 0) {
      const double needed = 1.01 * moved.farthestOutside / route.sourceDiagonal();
      message += needed < 0.1 ? ". --snap " + shortNumber(needed) + " takes them for points of the surface"
                              : ". Is it in the units and at the place of " + route.sourceName() + "?";
    }
    throw Error(Errc::io, message);
  }

  std::string comment(const Session& session) const {
    return std::string("polestar ") + kVersion + ": " + session.arguments();
  }

  void finish(const Route& route, const fs::path& output, Rows rows, Session& session) const {
    std::error_code ignored;
    const auto bytes = fs::file_size(output, ignored);
    rows.push_back({"wrote", ignored ? output.string() : output.string() + ", " + byteSize(bytes)});
    session.json()["outputs"] = {output.string()};
    describeInText(route, rows, session);
  }

  void describeInText(const Route& route, const Rows& rows, Session& session) const {
    session.text() = input_.string() + ": from " + route.sourceName() + " to " + route.targetName() + "\n" +
                     table(rows, {}, "  ");
  }

  void carryPoints(const std::vector<Vec3>& points, const fs::path& output, Session& session) const {
    if (points.empty())
      throw Error(Errc::io, input_.string() + " holds no points; give lines such as 0.5 -1 2e-3");
    const Route route = loadRoute(session);
    const MovedPoints moved = move(route, points, session);
    if (!moved.complete()) {
      session.context().log(LogLevel::warning,
                            missingPoints(moved, points, route, "points") + "; they are nan in the output");
    }
    const std::string lines = pointLines(moved.points, lowerExtension(output) == ".csv" ? ',' : ' ');
    if (output.empty() || isStandardStream(output)) {
      session.text() = lines;
      if (session.options().json) {
        session.json()["points"] = pointsJson(points);
        session.json()["warped"] = pointsJson(moved.points);
      }
      return;
    }
    session.timed("write", [&] {
      writeAtomically(output, [&](const fs::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out << lines << std::flush;
        if (!out) throw Error(Errc::io, "cannot write " + output.string() + "; is the disk full?");
      });
      return 0;
    });
    finish(route, output,
           {{"points", grouped(points.size()) + "; " + grouped(moved.outside) + " outside, " +
                           grouped(moved.unanswered) + " without an answer"}},
           session);
  }

  void carrySurface(MeshFile file, const fs::path& output, Session& session) const {
    const Route route = loadRoute(session);
    file.mesh.vertices = moveVertices(route, file.mesh.vertices, session);
    session.json()["triangles"] = file.mesh.triangles.size();
    if (file.polygons > 0) {
      session.context().log(LogLevel::warning,
                            counted(file.polygons, "polygon is", "polygons are") + " written as triangles");
    }
    session.timed("write", [&] {
      writeMesh(output, file.mesh, comment(session));
      return 0;
    });
    finish(route, output,
           {{"surface", counted(file.mesh.vertices.size(), "vertex", "vertices") + ", " +
                            counted(file.mesh.triangles.size(), "triangle", "triangles")}},
           session);
  }

  void carrySolid(TetMeshFile file, const fs::path& output, Session& session) {
    TetMesh& mesh = file.mesh;
    for (const std::string& note : file.notes)
      session.context().log(LogLevel::warning, input_.string() + ": " + note);
    dropNormals(mesh.vertexData, file.left);
    dropNormals(mesh.cellData, file.left);
    const Route route = loadRoute(session);
    const std::vector<Vec3> before = mesh.vertices;
    mesh.vertices = moveVertices(route, before, session);

    const TetMesh::Tetrahedra tetrahedra = mesh.tetrahedra();
    const TetReport report =
        session.timed("judge", [&] { return compareTetrahedra(tetrahedra.corners, before, mesh.vertices); });
    const std::size_t folds = countFolds(report, tetrahedra, before, route.map());
    session.json()["tetrahedra"] = reportJson(report, folds, tetrahedra, before, mesh.vertices);
    Rows rows{{"mesh", counted(before.size(), "vertex", "vertices") + ", " +
                           counted(mesh.cellCount(), "cell", "cells")}};
    const Rows more = reportRows(report, folds, tetrahedra, before);
    rows.insert(rows.end(), more.begin(), more.end());
    describeInText(route, rows, session);
    if (!report.good()) {
      if (!keepFailed_) {
        throw Error(Errc::notConverged,
                    input_.string() + ": " + failure(report, folds) + ". --keep-failed keeps the file");
      }
      failure_ = input_.string() + ": " + failure(report, folds) + "; file kept";
    }

    std::vector<std::string> lost = session.timed("write", [&] {
      return writeTetMesh(output, mesh,
                          {.binary = file.binary && lowerExtension(output) == lowerExtension(input_),
                           .comment = comment(session)});
    });
    lost.insert(lost.begin(), file.left.begin(), file.left.end());
    session.json()["left_out"] = lost;
    for (const std::string& one : lost) session.context().log(LogLevel::warning, "left out: " + one);
    finish(route, output, std::move(rows), session);
  }

  static void dropNormals(std::vector<MeshData>& all, std::vector<std::string>& left) {
    for (const MeshData& data : all) {
      if (data.normals) left.push_back("the normals " + data.name + ", which held before the warp");
    }
    std::erase_if(all, [](const MeshData& data) { return data.normals; });
  }

  void carryGrids(const fs::path& output, Session& session) const {
    const Route route = loadRoute(session);
    route.describe(session.json());
    const VolumeMap& map = route.map();
    const WarpGridsOptions options{.box = route.targetBox(), .voxelSize = size_.voxelSize(route.targetBox())};
    const GridWarp warp{
        [&](std::span<const Vec3> after, std::span<Vec3> before) { map.inverse(after, before); },
        [&](std::span<const Vec3> before, std::span<Vec3> after) { map.forward(before, after); },
        [&](std::span<const Vec3> before, std::span<Mat3> derivative) { map.jacobian(before, derivative); }};
    WarpedGrids grids =
        session.timed("warp", [&] { return WarpedGrids(input_, warp, options, session.context()); });
    grids.setMetadata("polestar:version", std::string(kVersion));
    grids.setMetadata("polestar:domain", route.targetKind());
    grids.setMetadata("polestar:source", input_.filename().string());
    grids.setMetadata("polestar:arguments", session.arguments());
    session.timed("write", [&] {
      grids.write(output);
      return 0;
    });

    Json list = Json::array();
    Rows rows{{"grid", "type", "carried", "active voxels", ""}};
    for (const WarpedGrid& grid : grids.report()) {
      list.push_back({{"name", grid.name},
                      {"type", grid.valueType},
                      {"carried", grid.how.empty() ? Json() : Json(grid.how)},
                      {"active_voxels", grid.activeVoxels},
                      {"note", grid.note}});
      rows.push_back({grid.name, grid.valueType, grid.how.empty() ? "no" : grid.how,
                      grouped(grid.activeVoxels), grid.note});
      if (!grid.note.empty()) session.context().log(LogLevel::warning, grid.name + ": " + grid.note);
    }
    session.json()["grids"] = list;
    session.json()["voxel_size"] = options.voxelSize;
    session.json()["voxels_inside"] = grids.voxelsInside();
    session.json()["outputs"] = {output.string()};
    for (auto& row : rows) row.pop_back();
    session.text() = input_.string() + ": from " + route.sourceName() + " to " + route.targetName() +
                     ", voxels of " + shortNumber(options.voxelSize) + "\n" + table(rows, {3}, "  ") +
                     "wrote " + output.string() + "\n";
  }

  fs::path input_;
  RouteChoices choices_;
  GridSize size_;
  bool keepFailed_ = false;
  std::string failure_;  // of a mesh that was written all the same
};

}  // namespace

std::unique_ptr<Command> makeWarpCommand() { return std::make_unique<WarpCommand>(); }

}  // namespace polestar::cli
