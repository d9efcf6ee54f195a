// polestar convert: meshes, grids and slices become one another; grids are thinned, renamed, resampled and
// turned on the way.

#include <algorithm>
#include <iostream>
#include <iterator>

#include "cli/conversion_end.h"
#include "cli/dry_run.h"
#include "cli/frame_plan.h"
#include "cli/grid_edits.h"
#include "cli/outputs.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/io/slice_stack.h"
#include "polestar/io/usd_volume.h"
#include "polestar/mesh/edge_pairs.h"
#include "polestar/mesh/repair.h"
#include "polestar/mesh/write_mesh.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;
using Kind = ConversionEnd::Kind;

class ConvertCommand final : public Command {
 public:
  Description description() const override {
    return {"convert", "Meshes, grids and slices become one another; grids resampled, turned, repacked",
            "The file to write; its name says what it is. With --frames name.####.vdb, - is standard output",
            "polestar convert asteroid.obj -o asteroid.vdb --dim 256"};
  }

  void addOptions(CLI::App& app) override {
    app_ = &app;
    app.add_option(
           "INPUT", input_,
           "A mesh (.obj .ply .stl .off), grids (.vdb) or slices (scan/slice.####.png); - is standard "
           "input")
        ->required()
        ->type_name("");
    app.add_option("--from", fromFormat_, "What a name does not tell: obj, ply, stl, off or vdb")
        ->type_name("FORMAT");
    app.add_option("--to", toFormat_, "The same of the output")->type_name("FORMAT");
    app.add_option("--frames", frames_, "A numbered sequence: 1-48, 1-240x2; names have #### for the number")
        ->type_name("RANGE");
    edits_.addOptions(app);
    app.add_flag(
        "--exact", exact_,
        "Of a mesh: distances that are exact throughout the band, the right side of gaps thinner than "
        "two voxels, and cavities; for surfaces that do not run through themselves. Default is "
        "OpenVDB's conversion");
    app.add_flag("--repair", repair_, "From mesh to mesh: weld seams, drop duplicates, turn faces outward");
    app.add_option(
           "--adaptivity", adaptivity_,
           "Of a mesh that is made: 0 (default) has triangles of a voxel, up to 1 larger ones where it is "
           "flat")
        ->check(CLI::Range(0.0, 1.0).description(""))
        ->type_name("A");
    addPointOption(app, "--slice-voxel", sliceVoxel_,
                   "Of slices that are read: size of a voxel along x, y and z; default 1,1,1");
    addPointOption(app, "--slice-origin", sliceOrigin_,
                   "Of slices that are read: the corner where x, y and z are least; default 0,0,0");
    app.add_option("--fps", fps_, "Of a .usda with --frames: frames a second")
        ->check(CLI::PositiveNumber.description(""))
        ->capture_default_str()
        ->type_name("N");
    app.add_option("--meters-per-unit", metersPerUnit_, "Of a .usda: how long a unit of the grids is")
        ->check(CLI::PositiveNumber.description(""))
        ->capture_default_str()
        ->type_name("M");
  }

  void run(Session& session) override {
    prepare(session);
    const std::vector<FrameJob> jobs = planJobs();
    for (const fs::path& input : inputsOf(jobs)) session.addInput(input);
    std::vector<fs::path> outputs = outputsOf(jobs);
    for (const fs::path& output : outputs) checkOutput(output, session.options().overwrite, session.inputs());
    if (session.options().dryRun) return plan(outputs, session);
    session.json()["files"] = Json::array();
    session.json()["outputs"] = Json::array();
    if (to_.kind == Kind::usd) return writeUsd(jobs, session);
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      const FrameProgress progress(session.context(), i, jobs.size());
      convert(jobs[i], session);
    }
  }

 private:
  // --- what is asked for ---------------------------------------------------------------------------------

  void prepare(Session& session) {
    const fs::path output = session.options().output;
    if (output.empty()) throw Error(Errc::usage, "-o FILE is missing; its name says what to make");
    from_ = conversionInput(input_, fromFormat_);
    to_ = conversionOutput(output, toFormat_);
    if (to_.kind == Kind::usd && from_.kind != Kind::grids)
      throw Error(Errc::usage, "a .usda names .vdb files; make one of " + input_.string() + " first");
    if (from_.kind == Kind::slices && to_.kind == Kind::slices)
      throw Error(Errc::usage, "from slices to slices there is nothing to do; name a .vdb or a mesh");
    if (frames_ && (from_.kind == Kind::slices || to_.kind == Kind::slices))
      throw Error(Errc::usage, "--frames is for sequences of files; the numbers of slices are their places");
    if (isStandardStream(output)) {
      if (session.options().json)
        throw Error(Errc::usage, "-o - and --json both want standard output; drop one");
      session.keepStandardOutputFree();
    }
    edits_.prepare();
    refuseWhatHasNoUse();
  }

  /// An option that nothing would come of is a mistake.
  void refuseWhatHasNoUse() const {
    const bool fromMesh = from_.kind == Kind::mesh, toMesh = to_.kind == Kind::mesh,
               toUsd = to_.kind == Kind::usd;
    const bool grids = !(fromMesh && toMesh) && !toUsd, writesGrids = to_.kind == Kind::grids;
    const std::pair<const char*, bool> uses[] = {
        {"--pick", grids},
        {"--drop", grids},
        {"--rename", writesGrids},
        {"--as", grids},
        {"--iso", !fromMesh && (toMesh || (grids && edits_.asked()))},
        {"--half-width", grids},
        {"--voxel", grids},
        {"--dim", grids},
        {"--half", writesGrids},
        {"--prune", writesGrids},
        {"--compression", writesGrids},
        {"--exact", fromMesh && grids},
        {"--repair", fromMesh && toMesh},
        {"--adaptivity", toMesh && !fromMesh},
        {"--slice-voxel", from_.kind == Kind::slices},
        {"--slice-origin", from_.kind == Kind::slices},
        {"--fps", toUsd},
        {"--meters-per-unit", toUsd}};
    for (const auto& [option, useful] : uses) {
      if (useful || app_->get_option(option)->count() == 0) continue;
      throw Error(Errc::usage, std::string(option) + " has no use from " + nameOf(from_.kind) + " to " +
                                   nameOf(to_.kind) + "; leave it out");
    }
  }

  std::vector<FrameJob> planJobs() const {
    if (from_.kind == Kind::slices || to_.kind == Kind::slices) return {{std::nullopt, from_.path, to_.path}};
    if (to_.kind != Kind::usd) return planFrames(from_.path, to_.path, frames_);
    // Many files in, one out.
    std::vector<FrameJob> jobs = planFrames(from_.path, from_.path, frames_);
    for (FrameJob& job : jobs) job.output = to_.path;
    return jobs;
  }

  std::vector<fs::path> inputsOf(const std::vector<FrameJob>& jobs) const {
    if (from_.kind == Kind::slices) return numberedFiles(from_.path);
    std::vector<fs::path> inputs;
    for (const FrameJob& job : jobs) inputs.push_back(job.input);
    return inputs;
  }

  std::vector<fs::path> outputsOf(const std::vector<FrameJob>& jobs) const {
    std::vector<fs::path> outputs;
    if (to_.kind == Kind::usd) return {to_.path};
    for (const FrameJob& job : jobs)
      outputs.push_back(to_.kind == Kind::slices ? FramePath(job.output).at(1) : job.output);
    return outputs;
  }

  void plan(const std::vector<fs::path>& outputs, Session& session) const {
    std::vector<PlannedFile> files;
    for (const fs::path& output : outputs) {
      files.push_back({output,
                       std::string(nameOf(to_.kind)) +
                           (to_.kind == Kind::slices ? ", the first of as many as there are layers" : ""),
                       std::nullopt});
    }
    describePlan(session, files);
  }

  // --- one file ------------------------------------------------------------------------------------------

  void convert(const FrameJob& job, Session& session) const {
    Json file{{"input", job.input.string()}, {"output", job.output.string()}};
    if (from_.kind == Kind::mesh && to_.kind == Kind::mesh) {
      MeshFile mesh = readMeshInput(job.input, session);
      changeMesh(mesh, job.input, session);
      writeMeshOutput(job.output, mesh.mesh, file, session);
    } else {
      GridSet grids = readGrids(job.input, session);
      edits_.apply(grids, from_.kind == Kind::mesh, session);
      writeGrids(job, grids, file, session);
    }
    session.json()["files"].push_back(file);
  }

  MeshFile readMeshInput(const fs::path& path, Session& session) const {
    if (!isStandardStream(path)) return loadMesh(path, session);
    std::string bytes{std::istreambuf_iterator<char>(std::cin), {}};
    return session.timed("load",
                         [&] { return readMesh(std::move(bytes), "standard input" + from_.extension); });
  }

  void changeMesh(MeshFile& file, const fs::path& path, Session& session) const {
    if (file.polygons > 0) {
      session.context().log(LogLevel::warning,
                            counted(file.polygons, "polygon is", "polygons are") + " written as triangles");
    }
    if (repair_) {
      RepairedMesh repaired = repairMesh(file.mesh);
      session.context().log(LogLevel::info, path.string() + ": " + repaired.report.summary());
      file.mesh = std::move(repaired.mesh);
    }
    if (!edits_.up()) return;
    for (Vec3& vertex : file.mesh.vertices) vertex = turnedUp(vertex, *edits_.up());
  }

  /// Closed is enough: several parts and handles may be.
  static TriMesh closedMesh(TriMesh mesh, const fs::path& path, Session& session) {
    if (edgesPair(mesh)) return mesh;
    RepairedMesh repaired = repairMesh(mesh);
    session.context().log(LogLevel::info, path.string() + ": " + repaired.report.summary());
    if (edgesPair(repaired.mesh)) return std::move(repaired.mesh);
    const SurfaceReport report = inspectSurface(repaired.mesh);
    if (report.boundaryEdges == 0) return std::move(repaired.mesh);
    std::string where;
    if (!report.holes.empty()) where = ", the longest around " + shortPoint(report.holes[0].center);
    throw Error(Errc::invalidSurface,
                path.string() + ": the mesh is open, so it has no inside: " +
                    counted(report.boundaryEdges, "edge", "edges") + " of one triangle in " +
                    counted(report.holeCount, "hole", "holes") + where + "; close them first");
  }

  GridSet readGrids(const fs::path& path, Session& session) const {
    if (from_.kind == Kind::grids) return session.timed("load", [&] { return GridSet(path); });
    if (from_.kind == Kind::mesh) return voxelize(path, session);
    SliceOptions place;
    if (sliceVoxel_) place.voxelSize = *sliceVoxel_;
    if (sliceOrigin_) place.origin = *sliceOrigin_;
    return session.timed("load", [&] { return GridSet(readSlices(path, place, session.context())); });
  }

  GridSet voxelize(const fs::path& path, Session& session) const {
    MeshFile file = readMeshInput(path, session);
    const TriMesh mesh =
        session.timed("check", [&] { return closedMesh(std::move(file.mesh), path, session); });
    VoxelizeOptions options{.voxelSize = edits_.size().voxelSize(boundingBox(mesh)),
                            .halfWidth = edits_.halfWidth(),
                            .exact = exact_};
    if (!exact_ && hasCavities(mesh)) {
      options.exact = true;
      session.context().log(LogLevel::info, path.string() +
                                                " has parts that face inward, cavities: voxelized "
                                                "as with --exact, which keeps them");
    }
    return session.timed("voxelize", [&] {
      GridSet grids(mesh, options, session.context());
      grids.provide(edits_.wants("surface"), edits_.wants("density"), 0, options.halfWidth,
                    session.context());
      return grids;
    });
  }

  // --- what comes of it ----------------------------------------------------------------------------------

  void writeGrids(const FrameJob& job, GridSet& grids, Json& file, Session& session) const {
    if (to_.kind == Kind::mesh) {
      const TriMesh mesh = surfaceOf(grids, job.input, session);
      return writeMeshOutput(job.output, mesh, file, session);
    }
    if (to_.kind == Kind::slices) return writeSliceStack(job.output, grids, file, session);
    setMetadata(grids, job.input, session);
    OutputGuard guard({job.output});
    session.timed("write", [&] {
      grids.write(job.output, edits_.compression());
      return 0;
    });
    guard.keep();
    Json list = Json::array();
    std::vector<std::vector<std::string>> rows;
    for (const GridInfo& grid : grids.describe()) {
      list.push_back({{"name", grid.name},
                      {"type", grid.valueType},
                      {"class", grid.gridClass},
                      {"active_voxels", grid.activeVoxels},
                      {"voxel_size", grid.voxelSize}});
      rows.push_back({grid.name, grid.valueType, grid.gridClass, grouped(grid.activeVoxels),
                      shortNumber(grid.voxelSize)});
    }
    file["grids"] = list;
    session.text() += table(rows, {3, 4}, "  ");
    wrote(job.output, session);
  }

  TriMesh surfaceOf(const GridSet& grids, const fs::path& path, Session& session) const {
    return session.timed("mesh", [&] {
      const SampledGrids found = grids.lookUp();
      TriMesh mesh = solidSurface(found, path.string(), {.level = edits_.iso(), .adaptivity = adaptivity_});
      std::string left;
      for (const SampledGrid& grid : found.grids()) {
        const bool shape = &grid == found.solidGrid() || grid.name() == "density";
        if (!shape) left += (left.empty() ? "" : ", ") + grid.name();
      }
      for (const LeftOutGrid& grid : found.leftOut()) left += (left.empty() ? "" : ", ") + grid.name;
      if (!left.empty())
        session.context().log(LogLevel::warning, "left out, a mesh has no place for them: " + left);
      return mesh;
    });
  }

  void writeSliceStack(const fs::path& output, const GridSet& grids, Json& file, Session& session) const {
    const SampledGrids found = grids.lookUp();
    const SliceLayout stack = planSlices(found);
    const FramePath pattern(output);
    std::vector<fs::path> files;
    for (int z = 1; z <= stack.count; ++z) files.push_back(pattern.at(z));
    for (const fs::path& one : files) checkOutput(one, session.options().overwrite, session.inputs());
    OutputGuard guard(files);
    const std::size_t clipped =
        session.timed("write", [&] { return writeSlices(pattern, found, stack, session.context()); });
    guard.keep();
    if (clipped > 0) {
      session.context().log(LogLevel::warning,
                            counted(clipped, "value lies", "values lie") +
                                " outside of 0 to 1 and had to be clipped; .tif and .exr hold any");
    }
    file["slices"] = {{"grid", stack.grid},
                      {"count", stack.count},
                      {"width", stack.width},
                      {"height", stack.height},
                      {"alpha", stack.alpha},
                      {"clipped", clipped},
                      {"voxel", toJson(stack.place.voxelSize)},
                      {"origin", toJson(stack.place.origin)}};
    for (const fs::path& one : files) session.json()["outputs"].push_back(one.string());
    const auto three = [](const Vec3& v) {
      return exactNumber(v.x()) + "," + exactNumber(v.y()) + "," + exactNumber(v.z());
    };
    session.text() += "wrote " + counted(files.size(), "slice", "slices") + " of " + stack.grid + ", " +
                      std::to_string(stack.width) + " x " + std::to_string(stack.height) +
                      " pixels: " + output.string() + "\nback: --slice-voxel " +
                      three(stack.place.voxelSize) + " --slice-origin=" + three(stack.place.origin) + "\n";
  }

  void writeMeshOutput(const fs::path& output, const TriMesh& mesh, Json& file, Session& session) const {
    const std::string comment = std::string("polestar ") + kVersion + ": " + session.arguments();
    file["mesh"] = {{"vertices", mesh.vertices.size()}, {"triangles", mesh.triangles.size()}};
    session.text() += counted(mesh.vertices.size(), "vertex", "vertices") + ", " +
                      counted(mesh.triangles.size(), "triangle", "triangles") + "\n";
    session.timed("write", [&] {
      if (isStandardStream(output)) {
        if (!(std::cout << meshBytes(to_.extension, mesh, comment) << std::flush))
          throw Error(Errc::io, "cannot write to standard output; it was closed");
      } else {
        writeMesh(output, mesh, comment);
      }
      return 0;
    });
    wrote(output, session);
  }

  void writeUsd(const std::vector<FrameJob>& jobs, Session& session) const {
    UsdVolume volume;
    for (const FrameJob& job : jobs) {
      session.context().throwIfCancelled();
      volume.frames.push_back(
          {job.frame, job.input, session.timed("load", [&] { return readGridInfo(job.input); })});
    }
    const std::vector<GridInfo>& grids = volume.frames.front().grids;
    for (const GridInfo& grid : grids) {
      if (usdFields({grid}).empty())
        session.context().log(LogLevel::warning,
                              grid.name + ": left out, UsdVol has no word for " + grid.valueType);
    }
    volume.upAxis = edits_.up() == UpAxis::z ? 'Z' : 'Y';
    volume.metersPerUnit = metersPerUnit_;
    volume.framesPerSecond = fps_;
    writeUsdVolume(to_.path, volume, std::string("polestar ") + kVersion);
    session.json()["files"].push_back({{"input", input_.string()},
                                       {"output", to_.path.string()},
                                       {"frames", jobs.size()},
                                       {"fields", usdFields(grids).size()}});
    wrote(to_.path, session);
  }

  void setMetadata(GridSet& grids, const fs::path& input, const Session& session) const {
    if (from_.kind == Kind::grids) {
      grids.setMetadata("polestar:converted", session.arguments());
      return;
    }
    grids.setMetadata("polestar:version", std::string(kVersion));
    grids.setMetadata("polestar:domain", std::string("solid"));
    grids.setMetadata("polestar:source", input.filename().string());
    grids.setMetadata("polestar:arguments", session.arguments());
  }

  static void wrote(const fs::path& output, Session& session) {
    session.json()["outputs"].push_back(output.string());
    std::error_code ignored;
    const auto bytes = fs::file_size(output, ignored);
    session.text() +=
        "wrote " + (ignored ? output.string() : output.string() + ", " + byteSize(bytes)) + "\n";
  }

  const CLI::App* app_ = nullptr;
  fs::path input_;
  std::string fromFormat_, toFormat_;
  std::optional<std::string> frames_;
  ConversionEnd from_{}, to_{};
  GridEdits edits_;
  bool exact_ = false, repair_ = false;
  double adaptivity_ = 0, fps_ = 24, metersPerUnit_ = 1;
  std::optional<Vec3> sliceVoxel_, sliceOrigin_;
};

}  // namespace

std::unique_ptr<Command> makeConvertCommand() { return std::make_unique<ConvertCommand>(); }

}  // namespace polestar::cli
