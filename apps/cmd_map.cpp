// polestar map: a mesh becomes a map of its solid onto the unit ball, and the sparse grids that picture it.

#include <sys/resource.h>

#include <cmath>

#include "cli/dry_run.h"
#include "cli/grid_size.h"
#include "cli/map_input.h"
#include "cli/outputs.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultDim = 128;
constexpr int kPaddingVoxels = 3;
constexpr std::size_t kRoundTrips = 50000;
// surface, density and green are floats, rest is three of them.
constexpr double kBytesPerVoxel = 3 * 4 + 12;

class MapCommand final : public Command {
 public:
  Description description() const override {
    return {
        "map", "Parameterize a mesh's solid over the ball: writes OUT.vdb (grids) and OUT.pmap (the map)",
        "The .vdb to write; the .pmap goes beside it. - writes the grids to standard output, without .pmap",
        "polestar map asteroid.obj -o asteroid.vdb --dim 128"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("MESH", mesh_, "Surface mesh: .obj, .ply, .stl or .off; or a .vdb with a level set or fog")
        ->required()
        ->type_name("");
    size_.addOptions(app, "the mesh's", kDefaultDim);
    addMapOptions(app, choices_);
    app.add_flag(
        "--exact", exact_,
        "Fill the grids by tracing a field line from every voxel instead of reading the map's table: about "
        "ten times as long, 30 to 60 s of processor time for a million voxels. The .pmap is the same; on "
        "average they differ by 2e-5 to 1e-4 of the ball's radius");
    app.add_flag(
        "--keep-failed", keepFailed_,
        "Keep the files of a map that fails its certificate (exit code 6). The verdict proved says that "
        "the map in the .pmap is one to one, and that no cell between voxels is inverted more than a "
        "voxel below the surface; how near G is to the true Green's function is measured, see --prove");
  }

  void run(Session& session) override {
    session.addInput(mesh_);
    const fs::path grids = session.options().output;
    if (grids.empty()) throw Error(Errc::usage, "-o OUT.vdb is missing; the .pmap will lie beside it");
    std::vector<fs::path> outputs{grids};
    if (isStandardStream(grids)) {
      if (session.options().json)
        throw Error(Errc::usage, "-o - and --json both want standard output; drop one");
      session.keepStandardOutputFree();
    } else {
      if (grids.extension() != ".vdb") {
        throw Error(Errc::usage, "the output " + grids.string() + " does not end in .vdb; try -o " +
                                     fs::path(grids).replace_extension(".vdb").string());
      }
      outputs.push_back(mapFileBeside(grids));
    }
    for (const fs::path& output : outputs) {
      checkOutput(output, session.options().overwrite, session.inputs());
    }
    if (session.options().dryRun) return planOutputs(outputs, session);
    OutputGuard guard(outputs);
    computeAndWrite(outputs, guard, session);
  }

 private:
  void planOutputs(const std::vector<fs::path>& outputs, Session& session) const {
    const Box box = boundingBox(loadMesh(mesh_, session).mesh);
    std::vector<PlannedFile> files{plannedGrids(outputs[0], "surface, density, rest, green", box,
                                                size_.voxelSize(box), kPaddingVoxels, kBytesPerVoxel)};
    if (outputs.size() > 1) files.push_back({outputs[1], "the map itself", std::nullopt});
    describePlan(session, files);
  }

  /// Writes the files unless the map fails its certificate; then @throws Error{Errc::notConverged}, with
  /// --keep-failed after writing.
  void computeAndWrite(const std::vector<fs::path>& outputs, OutputGuard& guard, Session& session) const {
    Context& context = session.context();
    const BallMap map = makeMap(mesh_, choices_, session);
    const TriMesh& mesh = map.chart().green().shape().surface().mesh();
    const double voxel = size_.voxelSize(boundingBox(mesh));
    SolidGrids grids = session.timed("sample", [&] { return sample(map, voxel, session); });
    const FilteredGrids filtered = session.timed("filter", [&] { return filterCells(grids, context); });
    session.json()["filtered"] = {{"voxels", filtered.voxels},
                                  {"inverted_before", filtered.invertedBefore},
                                  {"largest_move_ball", filtered.largestMove}};
    const Certificate certificate =
        session.timed("certify", [&] { return certifyGrids(map, grids, kRoundTrips, context); });
    describeCertificate(certificate, voxel, session);

    const Check* failure = certificate.firstFailure();
    if (failure && !keepFailed_)
      throw Error(Errc::notConverged,
                  refusal(*failure) + adviceFor(*failure) + ". --keep-failed keeps the files");
    session.timed("write", [&] {
      grids.setMetadata("polestar:certificate", std::string(toString(certificate.verdict)));
      grids.setMetadata("polestar:arguments", session.arguments());
      grids.setMetadata("polestar:source", mesh_.filename().string());
      const std::optional<double> balanceVolume = balanceVolumeOf(map, choices_);
      if (balanceVolume) grids.setMetadata("polestar:balance_volume", *balanceVolume);
      if (outputs.size() > 1) {
        const std::string hash =
            writeMapFile(outputs[1], map, {mesh_.filename().string(), session.arguments(), balanceVolume});
        grids.setMetadata("polestar:map_hash", hash);
        session.json()["map_hash"] = hash;
      }
      context.throwIfCancelled();
      grids.write(outputs[0]);
      return 0;
    });
    guard.keep();
    session.json()["outputs"] = Json::array();
    for (const fs::path& output : outputs) session.json()["outputs"].push_back(output.string());
    summarize(outputs, certificate, map, voxel, session);
    if (failure) throw Error(Errc::notConverged, refusal(*failure) + "; files kept");
  }

  SolidGrids sample(const BallMap& map, double voxel, Session& session) const {
    const GridOptions options{.voxelSize = voxel, .padding = kPaddingVoxels};
    session.json()["exact"] = {{"traced", exact_}, {"answered_by_table", nullptr}};
    if (!exact_) return gridsOf(map, options, session.context());
    TracedGrids traced = tracedGridsOf(map, options, session.context());
    session.json()["exact"]["answered_by_table"] = traced.answeredByTable;
    return std::move(traced.grids);
  }

  static std::string refusal(const Check& failure) {
    return "the map fails its certificate: " + failure.name + ": " + failure.detail;
  }

  static std::string adviceFor(const Check& failure) {
    for (const char* ofGreen : {"boundary_error", "charge", "field_signs"}) {
      if (failure.name == ofGreen) return "; try a smaller --tolerance, --solver layer, or a finer mesh";
    }
    return "; the mesh is probably too coarse or uneven there";
  }

  static void describeCertificate(const Certificate& certificate, double voxel, Session& session) {
    Json checks = Json::array();
    for (const Check& check : certificate.checks) {
      checks.push_back({{"name", check.name},
                        {"passed", check.passed},
                        {"role", toString(check.role)},
                        {"value", std::isfinite(check.value) ? Json(check.value) : Json()},
                        {"limit", check.limit},
                        {"detail", check.detail}});
      if (!check.passed && check.role == CheckRole::warning) {
        session.context().log(LogLevel::warning, check.name + " " + shortNumber(check.value) + " is over " +
                                                     shortNumber(check.limit) + ": " + check.detail);
      }
    }
    Json& json = session.json();
    json["certificate"] = {{"verdict", toString(certificate.verdict)}, {"checks", checks}};
    const CellQuality& cells = certificate.sampled;
    json["sampled"] = {{"voxel_size", voxel},
                       {"voxels", cells.voxels},
                       {"cells", cells.cells},
                       {"inverted", cells.inverted},
                       {"undecided", cells.undecided},
                       {"collapsed", cells.collapsed},
                       {"inverted_deep", cells.invertedDeep},
                       {"collapsed_deep", cells.collapsedDeep},
                       {"min_jacobian", cells.cells > 0 ? Json(cells.minJacobian) : Json()},
                       {"round_trip_rms", certificate.roundTrip.rms},
                       {"round_trip_max", certificate.roundTrip.max},
                       {"round_trip_points", certificate.roundTrip.points},
                       {"round_trip_lost", certificate.roundTrip.lost}};
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    json["peak_memory_bytes"] = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
  }

  /// What was proved of them; empty when nobody asked.
  static std::string criticalPoints(const std::vector<SignProof>& proofs) {
    if (proofs.empty()) return "";
    const SignProof &first = proofs.front(), &last = proofs.back();
    std::string text =
        last.proved()
            ? "no point but the center within " + shortNumber(1 - last.delta) + " of the solid (proved)"
            : "not excluded: " + grouped(last.radial.failed) + " of " + grouped(last.faces) +
                  " faces open at " + shortNumber(1 - last.delta);
    if (last.proved() && proofs.size() > 1) {
      text +=
          "; " + counted(first.radial.failed, "face", "faces") + " open at " + shortNumber(1 - first.delta);
    }
    return text;
  }

  static std::string exactly(const Json& exact) {
    if (!exact["traced"]) return "";
    return "traced one by one; " + grouped(exact["answered_by_table"].get<std::uint64_t>()) +
           " left to the table";
  }

  static std::string verdictLine(const Certificate& certificate) {
    const Check* failure = certificate.firstFailure();
    if (failure) return "failed: " + failure->name;
    return "proved: the map's table is one to one, deep cells between voxels keep orientation";
  }

  static void summarize(const std::vector<fs::path>& outputs, const Certificate& certificate,
                        const BallMap& map, double voxel, Session& session) {
    const GreenFunction& green = map.chart().green();
    const CellQuality& cells = certificate.sampled;
    std::vector<std::vector<std::string>> rows{
        {"G", "harmonic radius " + shortNumber(green.harmonicRadius() * green.shape().frame().unit) +
                  "; rho |G| on the surface at most " + shortNumber(green.boundaryError().max) +
                  (green.boundaryError().bound ? " (proved)" : " (sampled)")},
        {"critical", criticalPoints(green.record().signs)},
        {"map", std::string(toString(map.sphere().kind)) + " boundary, " + toString(map.radius().kind()) +
                    " radius; quasi-conformal ratio " + shortNumber(map.sphere().qcMean) + " on average"},
        {"sphere", counted(map.sphere().flips, "flipped triangle", "flipped triangles") + " of phi, " +
                       grouped(map.chart().report().directionFlips) + " of omega, of " +
                       grouped(map.chart().foliation().triangles.size())},
        {"cells", counted(map.chart().report().cells.bad(), "inverted cell", "inverted cells") + " of " +
                      grouped(map.chart().report().cells.cells) + " in the foliation; " +
                      grouped(cells.inverted) + " of " + grouped(cells.cells) + " between voxels, " +
                      grouped(cells.invertedDeep) + " of them deep"},
        {"round trip", shortNumber(certificate.roundTrip.max / voxel) + " voxels at most"},
        {"voxels", exactly(session.json()["exact"])},
        {"verdict", verdictLine(certificate)}};
    std::erase_if(rows, [](const std::vector<std::string>& row) { return row[1].empty(); });
    for (const fs::path& output : outputs) {
      std::error_code ignored;
      const auto bytes = fs::file_size(output, ignored);
      rows.push_back({"wrote", ignored ? output.string() : output.string() + ", " + byteSize(bytes)});
    }
    session.text() += table(rows, {}, "  ");
  }

  fs::path mesh_;
  GridSize size_;
  MapChoices choices_;
  bool exact_ = false;
  bool keepFailed_ = false;
};

}  // namespace

std::unique_ptr<Command> makeMapCommand() { return std::make_unique<MapCommand>(); }

}  // namespace polestar::cli
