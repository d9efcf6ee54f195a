// polestar map: a mesh becomes a map of its solid onto the unit ball, and the sparse grids that picture it.

#include <cmath>

#include "cli/dry_run.h"
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
// surface, density and green are floats, rest is three of them.
constexpr std::uint64_t kBytesPerVoxel = 3 * 4 + 12;

class MapCommand final : public Command {
 public:
  Description description() const override {
    return {
        "map", "Parameterize a mesh's solid over the ball: writes OUT.vdb (grids) and OUT.pmap (the map)",
        "The .vdb to write; the .pmap goes beside it. - writes the grids to standard output, without .pmap",
        "polestar map asteroid.obj -o asteroid.vdb --dim 128"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("MESH", mesh_, "Surface mesh: .obj, .ply, .stl or .off")->required()->type_name("");
    CLI::Option* voxel = app.add_option("--voxel", voxel_, "Size of a voxel, mesh units")
                             ->check(CLI::PositiveNumber.description(""))
                             ->type_name("S");
    app.add_option("--dim", dim_, "Voxels along the longest side")
        ->check(CLI::Range(4, 1 << 20).description(""))
        ->capture_default_str()
        ->excludes(voxel)
        ->type_name("N");
    addMapOptions(app, choices_);
    app.add_flag("--keep-failed", keepFailed_,
                 "Keep the files of a map that fails its certificate (exit code 6)");
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
    makeMap(outputs, session);
    guard.keep();
  }

 private:
  void planOutputs(const std::vector<fs::path>& outputs, Session& session) const {
    const Box box = boundingBox(loadMesh(mesh_, session).mesh);
    const double voxel = voxel_ > 0 ? voxel_ : box.extent().maxCoeff() / dim_;
    std::string size;
    double voxels = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const double count = std::ceil(box.extent()[axis] / voxel) + 2 * kPaddingVoxels;
      voxels *= count;
      size += (axis ? " x " : "") + shortNumber(count);
    }
    std::vector<PlannedFile> files{
        {outputs[0], "grids surface, density, rest, green in " + size + " voxels of " + shortNumber(voxel),
         static_cast<std::uint64_t>(std::min(voxels * kBytesPerVoxel, 1e18))}};
    if (outputs.size() > 1) files.push_back({outputs[1], "the map itself", std::nullopt});
    describePlan(session, files);
  }

  /// The library's road from the mesh to its files.
  void makeMap(const std::vector<fs::path>& outputs, Session& session) const {
    inspectSolid(mesh_, StarOptions{.center = choices_.center}, session);
    throw Error(Errc::notConverged, "this build ends after the check of " + mesh_.string() +
                                        "; nothing was written to " + outputs[0].string());
  }

  fs::path mesh_;
  int dim_ = kDefaultDim;
  double voxel_ = 0;  // 0: by dim_
  MapChoices choices_;
  bool keepFailed_ = false;
};

}  // namespace

std::unique_ptr<Command> makeMapCommand() { return std::make_unique<MapCommand>(); }

}  // namespace polestar::cli
