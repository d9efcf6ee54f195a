// polestar morph: solids turn into one another, inside and all, in frames of grids: ball coordinates,
// velocities and colors ride along.

#include <algorithm>
#include <charconv>
#include <chrono>
#include <fstream>
#include <future>
#include <map>

#include "cli/ball_alignment.h"
#include "cli/dry_run.h"
#include "cli/frame_plan.h"
#include "cli/grid_size.h"
#include "cli/map_input.h"
#include "cli/outputs.h"
#include "cli/text.h"
#include "cli/texture_source.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"
#include "polestar/mesh/write_mesh.h"
#include "polestar/morph/frame_proof.h"
#include "polestar/morph/morph_grids.h"
#include "polestar/morph/morph_path.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultDim = 128;
constexpr int kPaddingVoxels = 3;
constexpr double kBytesPerVoxel = 2 * 4 + 2 * 12;  // surface and density; rest and vel
constexpr double kSurfaceVoxels = 0.25;            // of the common triangles from the shapes' surfaces

using Rows = std::vector<std::vector<std::string>>;

const std::map<std::string, ColorNames> kColorNames{
    {"houdini", ColorNames::houdini}, {"blender", ColorNames::blender}, {"both", ColorNames::both}};
const std::map<std::string, Ease> kEases = [] {
  std::map<std::string, Ease> names;
  for (const Ease ease : {Ease::linear, Ease::smooth, Ease::in, Ease::out}) names[toString(ease)] = ease;
  return names;
}();

/// Frames that were looked at.
struct Judged {
  std::size_t failed = 0;  ///< frames
  std::size_t bad = 0;     ///< cells, all frames together
};

class MorphCommand final : public Command {
 public:
  Description description() const override {
    return {
        "morph", "Turn solids into one another, inside and all: a sequence of grids",
        "The .vdb files to write, name.####.vdb; without --frames one file",
        "polestar morph star.vdb head.vdb --frames 1-48 -o melt.####.vdb --texture kiwi --texture orange"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option(
           "SHAPES", shapes_,
           "Two shapes or more, in order: a .pmap, the .vdb beside it, or a mesh, which is mapped first")
        ->required()
        ->type_name("");
    app.add_option("--frames", frames_, "Frames, both ends included: 1-48, 1-240x2")->type_name("RANGE");
    app.add_option("--shot", shot_,
                   "All frames of the shot that --frames are a part of, so that a farm can make it in pieces")
        ->type_name("RANGE");
    app.add_option(
           "--ease", ease_,
           "How time passes: linear (default), smooth (at rest at both ends), in or out (at rest at one)")
        ->transform(CLI::CheckedTransformer(kEases).description(""))
        ->type_name("HOW");
    app.add_option(
           "--weights", weights_,
           "Shares of the shapes that sum to 1, such as 0.5,0.3,0.2: a still; or a file with such a line "
           "for each frame of the shot. Default: from the first shape through the others to the last")
        ->type_name("W|FILE");
    app.add_option("--path", path_,
                   "straight: every point runs straight; radial: by way of the blended radii, star-shaped "
                   "throughout; auto (default): straight where no frame of the shot folds, else radial")
        ->check(CLI::IsMember({"auto", "straight", "radial"}).description(""))
        ->type_name("KIND");
    addAlignmentOptions(app, alignment_,
                        {.from = "the first shape",
                         .to = "each later one",
                         .rotateHelp = "Points go to those that these degrees about x, then y, then z take "
                                       "them to, in the ball: shapes turn on their way",
                         .more = true});
    app.add_option("--fps", fps_, "Frames a second: vel is in units a second")
        ->check(CLI::PositiveNumber.description(""))
        ->capture_default_str()
        ->type_name("N");
    app.add_option(
           "--texture", textures_,
           "A solid texture by name (see polestar transfer --list) or a .vdb with colors; one for all "
           "shapes or, given again, one for each: they are blended")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
        ->type_name("NAME");
    app.add_option("--dcc", options_.colorNames,
                   "The name of colors: houdini (default) writes Cd, blender color, both both")
        ->transform(CLI::CheckedTransformer(kColorNames).description(""))
        ->type_name("WHOSE");
    app.add_flag("--half", options_.half, "Save vel and colors as half floats");
    size_.addOptions(app, "the shapes'", kDefaultDim);
    app.add_option("--mesh", mesh_,
                   "Write the surface, too, name.####.ply (.obj .stl .off): the same triangles in all frames")
        ->type_name("FILE");
    app.add_flag("--keep-failed", keepFailed_,
                 "Keep frames that fold, or in which cells between voxels do (exit code 6)");
  }

  void run(Session& session) override {
    plan(session);
    if (session.options().dryRun) return describeOutputs(session);
    std::vector<MorphShape> shapes = loadShapes(session);
    const Box box = boxAround(shapes);
    options_.grids = {.voxelSize = size_.voxelSize(box), .padding = kPaddingVoxels};
    const MorphComplex complex = session.timed("complex", [&] {
      return MorphComplex(std::move(shapes), {.surfaceTolerance = kSurfaceVoxels * options_.grids.voxelSize},
                          session.context());
    });
    describeComplex(complex, session);
    const std::vector<MorphTexture> textures = loadTextures(complex, session);
    const MorphPath path = session.timed("path", [&] { return choosePath(complex, session); });
    makeFrames(path, textures, session);
  }

 private:
  // --- what is asked for ---------------------------------------------------------------------------------

  void plan(Session& session) {
    for (const fs::path& shape : shapes_) session.addInput(shape);
    addAlignmentInputs(alignment_, session);
    const fs::path output = session.options().output;
    if (output.empty()) throw Error(Errc::usage, "-o OUT.####.vdb is missing");
    if (output.extension() != ".vdb")
      throw Error(Errc::usage, "the output " + output.string() + " does not end in .vdb");
    if (!mesh_.empty() && !isMeshOutputName(mesh_))
      throw Error(Errc::usage, "--mesh " + mesh_.string() + " does not end in .ply, .obj, .off or .stl");
    if (shapes_.size() < 2) throw Error(Errc::usage, "a morph needs two shapes at least; name another");
    if (!alignment_.surfaceMap.empty() && alignment_.surfaceMap.size() != shapes_.size()) {
      throw Error(Errc::usage, counted(alignment_.surfaceMap.size(), "mesh", "meshes") + " for " +
                                   counted(shapes_.size(), "shape", "shapes") +
                                   ": --surface-map wants one on each");
    }
    if (shot_ && !frames_) throw Error(Errc::usage, "--shot is for --frames, a part of it");
    if (!frames_ && weights_.empty())
      throw Error(Errc::usage,
                  "which frames? --frames 1-48 runs from shape to shape, --weights 0.5,0.5 is a still");
    if (!textures_.empty() && textures_.size() != 1 && textures_.size() != shapes_.size()) {
      throw Error(Errc::usage, counted(textures_.size(), "texture", "textures") + " for " +
                                   counted(shapes_.size(), "shape", "shapes") +
                                   ": give one, or one for each");
    }
    for (const std::string& name : textures_) {
      if (textureKindOf(name) == TextureKind::procedural) makeTexture(name);  // is there one of that name?
    }
    jobs_ = planFrames(shapes_.front(), output, frames_);
    shotJobs_ = shot_ ? planFrames(shapes_.front(), output, shot_) : jobs_;
    for (const FrameJob& job : jobs_) {
      const bool part = std::any_of(shotJobs_.begin(), shotJobs_.end(),
                                    [&](const FrameJob& other) { return other.frame == job.frame; });
      if (!part)
        throw Error(Errc::usage, "frame " + std::to_string(*job.frame) + " is not in the shot " + *shot_);
    }
    if (!mesh_.empty()) meshJobs_ = planFrames(shapes_.front(), mesh_, frames_);
    timeline_ = makeTimeline();
    for (const FrameJob& job : jobs_) checkOutput(job.output, session.options().overwrite, session.inputs());
    for (const FrameJob& job : meshJobs_)
      checkOutput(job.output, session.options().overwrite, session.inputs());
  }

  MorphTimeline makeTimeline() const {
    const int first = shotJobs_.front().frame.value_or(0), last = shotJobs_.back().frame.value_or(0);
    if (weights_.empty())
      return MorphTimeline::passage(shapes_.size(), first, last, ease_.value_or(Ease::linear));
    if (ease_) throw Error(Errc::usage, "--weights say themselves how time passes; leave --ease out");
    const std::vector<std::vector<double>> rows = readWeights();
    for (const std::vector<double>& row : rows) {
      if (row.size() != shapes_.size()) {
        throw Error(Errc::usage, counted(row.size(), "weight", "weights") + " for " +
                                     counted(shapes_.size(), "shape", "shapes"));
      }
    }
    if (rows.size() == 1) return MorphTimeline::still(rows.front());
    if (rows.size() != shotJobs_.size()) {
      throw Error(Errc::usage, weights_ + " has " + counted(rows.size(), "line", "lines") +
                                   " of weights for " + counted(shotJobs_.size(), "frame", "frames"));
    }
    return MorphTimeline::keyed(first, last, rows);
  }

  std::vector<std::vector<double>> readWeights() const {
    if (!fs::exists(weights_)) return {parseNumbers(weights_)};
    std::ifstream in(weights_);
    std::vector<std::vector<double>> rows;
    std::string line;
    while (std::getline(in, line)) {
      const auto start = line.find_first_not_of(" \t\r");
      if (start == std::string::npos || line[start] == '#') continue;
      rows.push_back(parseNumbers(line));
    }
    if (rows.empty()) throw Error(Errc::io, weights_ + " holds no weights");
    return rows;
  }

  void describeOutputs(Session& session) const {
    std::vector<PlannedFile> files;
    for (const FrameJob& job : jobs_) files.push_back({job.output, gridNames(), std::nullopt});
    for (const FrameJob& job : meshJobs_)
      files.push_back({job.output, "surface, the same triangles in all frames", std::nullopt});
    describePlan(session, files);
  }

  std::string gridNames() const {
    return std::string("grids surface, density, rest, vel") + (textures_.empty() ? "" : " and colors");
  }

  /// The common ball is the first shape's, and every later one is brought into line with that: not with the
  /// one before it, so that what alignments miss does not add up, a way that ends where it began closes, and
  /// stills between three have all of them in line.
  std::vector<MorphShape> loadShapes(Session& session) const {
    std::vector<MorphShape> shapes;
    for (const fs::path& path : shapes_) shapes.push_back({loadOrMapSolid(path, "shape", session), nullptr});
    if (!alignment_.any()) return shapes;
    Json& told = session.json()["aligned"] = Json::array();
    for (std::size_t s = 1; s < shapes.size(); ++s) {
      const BallAlignment aligned = alignBalls(alignment_, shapes[0].map, shapes[s].map, session,
                                               {.from = shapes_[0].filename().string(),
                                                .to = shapes_[s].filename().string(),
                                                .number = s,
                                                .solids = shapes.size()});
      shapes[s].motion = aligned.motion;
      shapes[s].rotation = aligned.rotation;
      told.push_back({{"shape", shapes_[s].string()}});
      told.back().update(aligned.report);
    }
    return shapes;
  }

  static Box boxAround(const std::vector<MorphShape>& shapes) {
    Box box;
    for (const MorphShape& shape : shapes) {
      const Box own = boundingBox(shape.map.chart().green().shape().surface().mesh());
      box.min = box.min.cwiseMin(own.min);
      box.max = box.max.cwiseMax(own.max);
    }
    return box;
  }

  Json toMendingJson(const Mending& mending) const {
    return {{"bad_before", mending.badBefore},
            {"nodes", mending.moved},
            {"largest_move_voxels", mending.largestMove / options_.grids.voxelSize}};
  }

  // --- what all frames share -----------------------------------------------------------------------------

  void describeComplex(const MorphComplex& complex, Session& session) const {
    const Foliation& ball = complex.ball();
    Json ends = Json::array();
    Rows rows{{"complex", grouped(ball.vertexCount) + " directions, " +
                              counted(ball.levels.size(), "level", "levels") + ", " +
                              grouped(ball.cellCount()) + " tetrahedra"}};
    for (std::size_t s = 0; s < complex.shapeCount(); ++s) {
      const MorphReport::End& end = complex.report().ends[s];
      ends.push_back({{"shape", shapes_[s].string()},
                      {"surface_max", end.surfaceMax},
                      {"surface_rms", end.surfaceRms},
                      {"bad_cells", end.mending.badAfter},
                      {"mended", toMendingJson(end.mending)}});
      rows.push_back(
          {shapes_[s].filename().string(),
           "surface met within " + shortNumber(end.surfaceMax / options_.grids.voxelSize) + " voxels; " +
               counted(end.mending.badAfter, "bad cell", "bad cells") +
               (end.mending.moved > 0 ? ", " + counted(end.mending.moved, "node", "nodes") + " moved" : "")});
    }
    session.json()["voxel_size"] = options_.grids.voxelSize;
    session.json()["complex"] = {{"vertices", ball.vertexCount},      {"triangles", ball.triangles.size()},
                                 {"levels", ball.levels.size()},      {"cells", ball.cellCount()},
                                 {"rounds", complex.report().rounds}, {"ends", ends}};
    session.text() += table(rows, {}, "  ");
  }

  std::vector<MorphTexture> loadTextures(const MorphComplex& complex, Session& session) const {
    std::vector<MorphTexture> textures;
    for (std::size_t s = 0; s < shapes_.size() && !textures_.empty(); ++s) {
      const std::string& name = textures_[textures_.size() == 1 ? 0 : s];
      if (textureKindOf(name) == TextureKind::procedural) {
        textures.push_back({makeTexture(name), std::nullopt, {}});
        continue;
      }
      if (textureKindOf(name) == TextureKind::slices)
        throw Error(Errc::usage,
                    name + ": slices are no texture of a morph; make a .vdb of them with convert");
      session.addInput(name);
      const TextureBody body = loadTextureBody(name, {}, {}, session);
      const SampledGrid* colors = body.grids.find("Cd", true);
      if (!colors) colors = body.grids.find("color", true);
      if (!colors) throw Error(Errc::io, name + " has no colors: no vector grid Cd or color");
      textures.push_back({nullptr, *colors, session.timed("texture", [&] {
                            return complex.nodesIn(body.map, complex.shape(s).motion.get());
                          })});
    }
    return textures;
  }

  /// The same for all parts of a shot.
  MorphPath choosePath(const MorphComplex& complex, Session& session) const {
    Json passages = Json::array();
    bool straightHolds = true;
    for (std::size_t s = 0; weights_.empty() && s + 1 < complex.shapeCount(); ++s) {
      const PassageProof proof = provePassage(complex, s, s + 1);
      passages.push_back({{"cells", proof.cells}, {"open", proof.open}});
      straightHolds = straightHolds && proof.holds();
    }
    Json& json = session.json()["path"];
    json = {{"asked", path_}, {"kind", path_}, {"straight_at_all_times", passages}};
    if (path_ != "auto") return MorphPath(complex, path_ == "radial" ? PathKind::radial : PathKind::straight);
    MorphPath straight(complex, PathKind::straight);
    json["kind"] = "straight";
    if (straightHolds && weights_.empty()) return straight;
    const Judged byStraight = judgeShot(straight, session);
    json["straight_failed_frames"] = byStraight.failed;
    if (byStraight.failed == 0) return straight;
    MorphPath radial(complex, PathKind::radial);
    const Judged byRadial = judgeShot(radial, session);
    json["radial_failed_frames"] = byRadial.failed;
    session.context().log(LogLevel::info, "straight paths fold in " +
                                              counted(byStraight.failed, "frame", "frames") + " (" +
                                              counted(byStraight.bad, "tetrahedron", "tetrahedra") +
                                              "), radial ones in " + grouped(byRadial.failed));
    if (std::pair(byRadial.failed, byRadial.bad) >= std::pair(byStraight.failed, byStraight.bad))
      return straight;
    json["kind"] = "radial";
    return radial;
  }

  Judged judgeShot(const MorphPath& path, Session& session) const {
    Judged judged;
    for (const FrameJob& job : shotJobs_) {
      session.context().throwIfCancelled();
      session.context().progress(
          std::string("trying ") + toString(path.kind()) + " paths",
          static_cast<double>(&job - shotJobs_.data()) / static_cast<double>(shotJobs_.size()));
      MorphPose pose = path.pose(timeline_->weights(job.frame.value_or(0)));
      mendCells(path.complex().ball(), pose.nodes, session.context());
      const FrameProof proof = proveFrame(path.complex(), pose);
      judged.failed += !proof.holds();
      judged.bad += proof.cells.bad();
    }
    return judged;
  }

  // --- frames --------------------------------------------------------------------------------------------

  /// Notes the seconds of all frames together.
  template <class Work>
  auto timed(const char* name, Session& session, Work&& work) {
    const auto start = std::chrono::steady_clock::now();
    auto result = std::forward<Work>(work)();
    seconds_[name] += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    session.noteSeconds(name, seconds_[name]);
    return result;
  }

  void makeFrames(const MorphPath& path, const std::vector<MorphTexture>& textures, Session& session) {
    session.json()["frames"] = Json::array();
    session.json()["outputs"] = Json::array();
    std::string failure;
    std::future<void> writing;  // one frame, while the next is made
    for (std::size_t i = 0; i < jobs_.size(); ++i) {
      const FrameProgress progress(session.context(), i, jobs_.size());
      const MorphFrame frame = timed("pose", session, [&] {
        return path.frame(*timeline_, jobs_[i].frame.value_or(0), fps_, session.context());
      });
      Json report{{"frame", jobs_[i].frame ? Json(*jobs_[i].frame) : Json()}, {"weights", frame.weights}};
      const FrameProof proof =
          timed("prove", session, [&] { return proveFrame(path.complex(), frame.pose); });
      describeProof(proof, report);
      report["mended"] = toMendingJson(frame.mending);
      std::string fault = proof.fault();
      if (!fault.empty() && !keepFailed_) refuse(i, fault, report, session);
      SolidGrids grids = timed("grids", session, [&] {
        return morphGrids(path.complex(), frame, textures, options_, session.context());
      });
      if (const std::string folds = judgeVoxels(grids, report, session); fault.empty()) fault = folds;
      if (!fault.empty() && !keepFailed_) refuse(i, fault, report, session);
      if (failure.empty() && !fault.empty()) failure = frameName(i) + ": " + fault;
      grids.setMetadata("polestar:certificate", std::string(fault.empty() ? "proved" : "failed"));
      label(grids, path, session);
      if (writing.valid()) writing.get();
      writing =
          std::async(std::launch::async, [&, i, own = std::make_shared<const SolidGrids>(std::move(grids))] {
            own->write(jobs_[i].output);
          });
      if (!meshJobs_.empty()) writeSurface(i, path.complex(), frame.pose, session);
      session.json()["frames"].push_back(report);
      session.json()["outputs"].push_back(jobs_[i].output.string());
    }
    writing.get();
    session.text() +=
        table({{"path", std::string(toString(path.kind()))},
               {"wrote", counted(jobs_.size(), "frame", "frames") + ", " + jobs_.front().output.string() +
                             (jobs_.size() > 1 ? " to " + jobs_.back().output.string() : "")}},
              {}, "  ");
    if (!failure.empty()) throw Error(Errc::notConverged, failure + "; files kept");
  }

  std::string frameName(std::size_t i) const {
    return jobs_[i].frame ? "frame " + std::to_string(*jobs_[i].frame) : jobs_[i].output.string();
  }

  [[noreturn]] void refuse(std::size_t i, const std::string& fault, const Json& report,
                           Session& session) const {
    session.json()["frames"].push_back(report);
    throw Error(Errc::notConverged, frameName(i) + " folds: " + fault +
                                        ". Try --path radial, or shapes that are more alike in between; "
                                        "--keep-failed keeps such frames");
  }

  /// Empty, or what is wrong.
  std::string judgeVoxels(SolidGrids& grids, Json& report, Session& session) {
    const MendedVoxels mended =
        timed("judge", session, [&] { return mendVoxels(grids, nullptr, session.context()); });
    const CellQuality& cells = mended.cells;
    report["voxels"] = cells.voxels;
    report["voxel_cells"] = {{"cells", cells.cells},
                             {"inverted", cells.inverted},
                             {"inverted_deep", cells.invertedDeep},
                             {"filtered_voxels", mended.voxels}};
    if (cells.invertedDeep == 0) return "";
    return counted(cells.invertedDeep, "cell", "cells") +
           " between voxels, deeper than one voxel, are inverted; use smaller voxels";
  }

  static void describeProof(const FrameProof& proof, Json& report) {
    report["proof"] = {{"holds", proof.holds()},
                       {"cells", proof.cells.cells},
                       {"bad_cells", proof.cells.bad()},
                       {"first_bad", proof.firstBad ? toJson(*proof.firstBad) : Json()},
                       {"surface", toString(proof.embedding)},
                       {"hidden_triangles", proof.hiddenTriangles},
                       {"crossings", proof.crossings}};
    report["volume"] = proof.volume;
  }

  void label(SolidGrids& grids, const MorphPath& path, const Session& session) const {
    std::string names;
    for (const fs::path& shape : shapes_) names += (names.empty() ? "" : ",") + shape.filename().string();
    grids.setMetadata("polestar:shapes", names);
    grids.setMetadata("polestar:path", std::string(toString(path.kind())));
    grids.setMetadata("polestar:fps", fps_);
    grids.setMetadata("polestar:arguments", session.arguments());
  }

  void writeSurface(std::size_t i, const MorphComplex& complex, const MorphPose& pose, Session& session) {
    timed("write_mesh", session, [&] {
      writeMesh(meshJobs_[i].output, surfaceOf(complex, pose), session.arguments());
      return 0;
    });
    session.json()["outputs"].push_back(meshJobs_[i].output.string());
  }

  std::vector<fs::path> shapes_;
  std::optional<std::string> frames_, shot_;
  std::optional<Ease> ease_;
  std::string weights_, path_ = "auto";
  double fps_ = 24;
  AlignmentChoices alignment_;
  std::vector<std::string> textures_;
  MorphGridOptions options_;
  GridSize size_;
  fs::path mesh_;
  bool keepFailed_ = false;

  std::vector<FrameJob> jobs_, shotJobs_, meshJobs_;
  std::optional<MorphTimeline> timeline_;
  std::map<std::string, double> seconds_;
};

}  // namespace

std::unique_ptr<Command> makeMorphCommand() { return std::make_unique<MorphCommand>(); }

}  // namespace polestar::cli
