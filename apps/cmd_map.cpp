// polestar map: a mesh becomes a map of its solid onto the unit ball, and the sparse grids that picture it.

#include <sys/resource.h>

#include <cmath>

#include "cli/domain_input.h"
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
/// Without kinks on the field lines that come from a domain's edges, see mapToDomain().
constexpr SphereMapKind kDomainBoundary = SphereMapKind::fieldLine;
constexpr std::size_t kRoundTrips = 50000;
// surface, density and green are floats, rest is three of them.
constexpr double kBytesPerVoxel = 3 * 4 + 12;
// The same less green.
constexpr double kBytesPerPosition = 2 * 4 + 12;

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
    addDomainOptions(app, domain_);
    app.add_option(
           "--inverse", inverse_,
           "Write grids of the domain as well, to look things up by their coordinates: surface, density and "
           "position, the point of the solid; as many voxels along the longest side")
        ->type_name("POS.vdb");
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
    Outputs outputs{grids, {}, inverse_};
    if (isStandardStream(grids)) {
      if (session.options().json)
        throw Error(Errc::usage, "-o - and --json both want standard output; drop one");
      session.keepStandardOutputFree();
    } else {
      if (grids.extension() != ".vdb") {
        throw Error(Errc::usage, "the output " + grids.string() + " does not end in .vdb; try -o " +
                                     fs::path(grids).replace_extension(".vdb").string());
      }
      outputs.map = mapFileBeside(grids);
    }
    domain_.validate();
    if (!choices_.boundary && domain_.domain != DomainChoice::ball) choices_.boundary = kDomainBoundary;
    if (exact_ && domain_.domain != DomainChoice::ball)
      throw Error(Errc::usage, "--exact is for --domain ball; other domains are read from the maps' tables");
    if (!inverse_.empty() && (inverse_.extension() != ".vdb" || inverse_ == grids))
      throw Error(Errc::usage, "--inverse " + inverse_.string() + " has to be another .vdb than -o");
    if (!domain_.polycube.empty()) session.addInput(domain_.polycube);
    for (const fs::path& output : outputs.all()) {
      checkOutput(output, session.options().overwrite, session.inputs());
    }
    if (session.options().dryRun) return planOutputs(outputs, session);
    OutputGuard guard(outputs.all());
    computeAndWrite(outputs, guard, session);
  }

 private:
  struct Outputs {
    fs::path grids, map, inverse;  ///< empty: not asked for

    std::vector<fs::path> all() const {
      std::vector<fs::path> paths{grids};
      for (const fs::path& path : {map, inverse}) {
        if (!path.empty()) paths.push_back(path);
      }
      return paths;
    }
  };

  /// The map, onto the ball and onto the domain that was asked for.
  struct Mapped {
    BallMap ball;
    std::optional<DomainMap> domain;

    Certificate certify(const SolidGrids& grids, Context& context) const {
      return domain ? certifyGrids(*domain, grids, kRoundTrips, context)
                    : certifyGrids(ball, grids, kRoundTrips, context);
    }
    /// As many voxels along the longest side as the solid's grids have.
    SolidGrids inverse(double dim, Context& context) const {
      if (!domain) return inverseGridsOf(ball, {.voxelSize = 2 / dim, .padding = kPaddingVoxels}, context);
      return inverseGridsOf(*domain, {.voxelSize = 2 / dim, .padding = kPaddingVoxels}, context);
    }
  };

  void planOutputs(const Outputs& outputs, Session& session) const {
    const Box box = boundingBox(loadMesh(mesh_, session).mesh);
    std::vector<PlannedFile> files{plannedGrids(outputs.grids, "surface, density, rest, green", box,
                                                size_.voxelSize(box), kPaddingVoxels, kBytesPerVoxel)};
    if (!outputs.map.empty()) files.push_back({outputs.map, "the map itself", std::nullopt});
    if (!outputs.inverse.empty()) {
      const Box domain{Vec3::Constant(-1), Vec3::Constant(1)};
      files.push_back(plannedGrids(outputs.inverse, "surface, density, position", domain,
                                   2 * size_.voxelSize(box) / box.extent().maxCoeff(), kPaddingVoxels,
                                   kBytesPerPosition));
    }
    describePlan(session, files);
  }

  /// Writes the files unless the map fails its certificate; then @throws Error{Errc::notConverged}, with
  /// --keep-failed after writing.
  void computeAndWrite(const Outputs& outputs, OutputGuard& guard, Session& session) const {
    Context& context = session.context();
    BallMap ball = makeMap(mesh_, choices_, session);
    const Mapped map{ball, makeDomainMap(ball, choices_, domain_, session)};
    const Box box = boundingBox(ball.chart().green().shape().surface().mesh());
    const double voxel = size_.voxelSize(box);
    SolidGrids grids = session.timed("sample", [&] { return sample(map, voxel, session); });
    const MendedVoxels filtered = session.timed(
        "filter", [&] { return mendVoxels(grids, map.domain ? &*map.domain : nullptr, context); });
    session.json()["filtered"] = {{"voxels", filtered.voxels},
                                  {"inverted_before", filtered.invertedBefore},
                                  {"largest_move_ball", filtered.largestMove}};
    const Certificate certificate = session.timed("certify", [&] { return map.certify(grids, context); });
    describeCertificate(certificate, voxel, session);

    const Check* failure = certificate.firstFailure();
    if (failure && !keepFailed_)
      throw Error(Errc::notConverged,
                  refusal(*failure) + adviceFor(*failure) + ". --keep-failed keeps the files");
    std::optional<SolidGrids> inverse;
    if (!outputs.inverse.empty()) inverse = sampleInverse(map, box.extent().maxCoeff() / voxel, session);
    session.timed("write", [&] {
      const MapProvenance provenance{mesh_.filename().string(), session.arguments(),
                                     balanceVolumeOf(ball, choices_)};
      std::string hash;
      if (!outputs.map.empty()) {
        hash = map.domain ? writeMapFile(outputs.map, *map.domain, provenance)
                          : writeMapFile(outputs.map, ball, provenance);
        session.json()["map_hash"] = hash;
      }
      const auto finish = [&](SolidGrids& written, const fs::path& path) {
        written.setMetadata("polestar:certificate", std::string(toString(certificate.verdict)));
        written.setMetadata("polestar:arguments", provenance.arguments);
        written.setMetadata("polestar:source", provenance.source);
        if (provenance.balanceVolume)
          written.setMetadata("polestar:balance_volume", *provenance.balanceVolume);
        if (!hash.empty()) written.setMetadata("polestar:map_hash", hash);
        context.throwIfCancelled();
        written.write(path);
      };
      finish(grids, outputs.grids);
      if (inverse) finish(*inverse, outputs.inverse);
      return 0;
    });
    guard.keep();
    session.json()["outputs"] = Json::array();
    for (const fs::path& output : outputs.all()) session.json()["outputs"].push_back(output.string());
    summarize(outputs.all(), certificate, ball, voxel, session);
    if (failure) throw Error(Errc::notConverged, refusal(*failure) + "; files kept");
  }

  SolidGrids sample(const Mapped& map, double voxel, Session& session) const {
    const GridOptions options{.voxelSize = voxel, .padding = kPaddingVoxels};
    session.json()["exact"] = {{"traced", exact_}, {"answered_by_table", nullptr}};
    if (map.domain) return gridsOf(*map.domain, options, session.context());
    if (!exact_) return gridsOf(map.ball, options, session.context());
    TracedGrids traced = tracedGridsOf(map.ball, options, session.context());
    session.json()["exact"]["answered_by_table"] = traced.answeredByTable;
    return std::move(traced.grids);
  }

  SolidGrids sampleInverse(const Mapped& map, double dim, Session& session) const {
    SolidGrids grids = session.timed("sample_inverse", [&] { return map.inverse(dim, session.context()); });
    const CellQuality cells = session.timed("certify", [&] { return judgeVoxelCells(grids, "position"); });
    session.json()["inverse"] = {{"voxel_size", grids.voxelSize()},
                                 {"voxels", cells.voxels},
                                 {"cells", cells.cells},
                                 {"inverted", cells.inverted},
                                 {"inverted_deep", cells.invertedDeep},
                                 {"collapsed_deep", cells.collapsedDeep}};
    if (const std::size_t bad = cells.invertedDeep + cells.collapsedDeep; bad > 0) {
      session.context().log(LogLevel::warning,
                            grouped(bad) + " of " + grouped(cells.cells) +
                                " cells of position deeper than a voxel are inverted or collapsed: the solid "
                                "changes faster there than these voxels hold");
    }
    return grids;
  }

  static std::string refusal(const Check& failure) {
    return "the map fails its certificate: " + failure.name + ": " + failure.detail;
  }

  std::string adviceFor(const Check& failure) const {
    const bool ofDomain = failure.name.starts_with("domain_");
    if (domain_.domain == DomainChoice::polycube && (ofDomain || failure.name == "voxel_cells"))
      return "; a polycube of fewer --cells, or coarser voxels, ask less of its reentrant edges";
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

  static std::string domainText(const Json& json) {
    if (!json.contains("domain")) return "";
    const Json& domain = json["domain"];
    const Json& bands = domain["distortion_by_edge_distance"];
    const auto mips = [](const Json& band) { return shortNumber(band["mips_mean"].get<double>()); };
    return domain["kind"].get<std::string>() + ", " +
           counted(domain["cells"].get<std::uint64_t>(), "cell", "cells") + " with " +
           counted(domain["corners"].get<std::uint64_t>(), "corner", "corners") + ", overlap " +
           shortNumber(domain["overlap"].get<double>()) + ", center " +
           shortNumber(domain["margin_cells"].get<double>()) + " cells from the nearest face's plane; MIPS " +
           mips(bands.front()) + " within 0.05 cells of its edges, " + mips(bands.back()) +
           " beyond 0.5 cells";
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
        {"domain", domainText(session.json())},
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
  DomainChoices domain_;
  fs::path inverse_;
  bool exact_ = false;
  bool keepFailed_ = false;
};

}  // namespace

std::unique_ptr<Command> makeMapCommand() { return std::make_unique<MapCommand>(); }

}  // namespace polestar::cli
