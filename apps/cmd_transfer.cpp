// polestar transfer: a solid texture goes into a mapped solid: fruit and stone by name, or the grids of a
// .vdb or a stack of slices by way of the ball.

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "cli/ball_alignment.h"
#include "cli/dry_run.h"
#include "cli/grid_size.h"
#include "cli/map_input.h"
#include "cli/outputs.h"
#include "cli/text.h"
#include "cli/texture_source.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/map_file.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultDim = 128;
constexpr int kPaddingVoxels = 3;
constexpr double kBytesPerVoxel = 4 + 4 + 12;  // surface, density, and a color or vector

const std::map<std::string, ColorNames> kColorNames{
    {"houdini", ColorNames::houdini}, {"blender", ColorNames::blender}, {"both", ColorNames::both}};

class TransferCommand final : public Command {
 public:
  Description description() const override {
    return {"transfer", "Fill a mapped solid with a solid texture", "The .vdb to write",
            "polestar transfer kiwi asteroid.pmap -o kiwi.vdb --dim 256"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option(
           "TEXTURE", texture_,
           "A name such as kiwi (see --list), a .vdb with Cd, color or other grids, or a numbered stack of "
           "slices such as scan/slice.####.png")
        ->type_name("");
    app.add_option("TARGET", target_,
                   "The solid to fill: a .pmap, the .vdb beside it, or any .vdb with a level set or fog")
        ->type_name("");
    app.add_flag("--list", list_, "Name the textures there are, with their parameters, and do nothing else");
    app.add_option("--set", settings_, "A parameter of a texture by name; may be given often")
        ->type_name("NAME=VALUE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option(
           "--source", source_,
           "The map of the solid that a .vdb or slices fill; without it the .pmap beside the .vdb, else a "
           "map made from its own grid surface or density")
        ->type_name("MAP");
    app.add_option(
           "--grids", grids_,
           "Of a .vdb, the grids to carry, separated by commas; default all but surface, density, rest and "
           "green")
        ->delimiter(',')
        ->type_name("NAMES");
    addAlignmentOptions(app, alignment_,
                        {.from = "the source (of a texture by name, the ball)",
                         .to = "the target",
                         .rotateHelp = "Turn the texture by these degrees about x, then y, then z"});
    size_.addOptions(app, "the target's", kDefaultDim);
    app.add_option("--dcc", options_.colorNames,
                   "The name of colors: houdini (default) writes Cd, blender color, both both")
        ->transform(CLI::CheckedTransformer(kColorNames).description(""))
        ->type_name("WHOSE");
    app.add_option(
           "--fibers", options_.fibers.strength,
           "Draw fibers along the grain of the texture, as thick all over the solid: by how much they make "
           "colors darker and lighter, 0 to 1; default 0, none")
        ->type_name("SHARE");
    app.add_option("--fiber-thickness", options_.fibers.thickness, "Of drawn fibers, in box diagonals")
        ->capture_default_str()
        ->type_name("T");
    app.add_option("--fiber-length", options_.fibers.length, "Of drawn fibers, in box diagonals")
        ->capture_default_str()
        ->type_name("L");
    app.add_flag("--half", options_.halfColors, "Save colors as half floats");
    app.add_flag("--rest", options_.rest, "Write the ball coordinates rest, too");
    addPointOption(app, "--slice-voxel", sliceVoxel_,
                   "Of slices: size of a voxel along x, y and z; default 1,1,1");
    addPointOption(app, "--slice-origin", sliceOrigin_,
                   "Of slices: the corner of the block where x, y and z are least; default 0,0,0");
  }

  void run(Session& session) override {
    if (list_) {
      session.json()["textures"] = texturesJson();
      session.text() = listTextures();
      return;
    }
    checkArguments(session);
    const fs::path output = session.options().output;
    checkOutput(output, session.options().overwrite, session.inputs());
    const BallMap target = loadOrMakeMap(target_, "target", session);
    // The target's own .vdb, where that is what was named and no other size is asked for.
    const bool own = target_.extension() == ".vdb" && !size_.given();
    if (own) readMapped(session);
    const double voxel =
        own ? options_.mapped ? options_.mapped->voxelSize() : readGridInfo(target_).front().voxelSize
            : size_.voxelSize(boundingBox(target.chart().green().shape().surface().mesh()));
    if (session.options().dryRun) return plan(target, voxel, session);
    OutputGuard guard({output});
    fill(target, voxel, output, session);
    guard.keep();
  }

 private:
  void checkArguments(Session& session) {
    if (texture_.empty())
      throw Error(Errc::usage, "TEXTURE is missing: a name of --list, a .vdb or slices.####.png");
    if (target_.empty()) throw Error(Errc::usage, "TARGET is missing: the .pmap of the solid to fill");
    kind_ = textureKindOf(texture_);
    const fs::path output = session.options().output;
    if (output.empty()) throw Error(Errc::usage, "-o OUT.vdb is missing");
    if (isStandardStream(output)) {
      if (session.options().json)
        throw Error(Errc::usage, "-o - and --json both want standard output; drop one");
      session.keepStandardOutputFree();
    } else if (output.extension() != ".vdb") {
      throw Error(Errc::usage, "the output " + output.string() + " does not end in .vdb");
    }
    if (!isMapName(target_)) {
      throw Error(Errc::usage, target_.string() + " is no map; make one with: polestar map " +
                                   target_.string() + " -o " +
                                   fs::path(target_).replace_extension(".vdb").string());
    }
    if (kind_ == TextureKind::procedural) {
      if (!source_.empty() || !grids_.empty())
        throw Error(Errc::usage, "--source and --grids are for a .vdb or slices; " + texture_ + " is a name");
      procedural_ = makeTexture(texture_, parseSettings(settings_));
    } else {
      if (!settings_.empty())
        throw Error(Errc::usage, "--set is for textures by name; " + texture_ + " is a file");
      if (kind_ == TextureKind::grids) session.addInput(texture_);
      if (!source_.empty()) session.addInput(source_);
    }
    if (kind_ != TextureKind::slices && (sliceVoxel_ || sliceOrigin_))
      throw Error(Errc::usage, "--slice-voxel and --slice-origin are for slices; " + texture_ + " is none");
    session.addInput(target_);
    addAlignmentInputs(alignment_, session);
  }

  /// The ball coordinates that `map` has written and judged: not those of a file without its map, which has
  /// just got another one, nor those that were resampled since, nor those in a polycube.
  void readMapped(Session& session) {
    if (!fs::exists(mapFileBeside(target_))) return;
    const std::vector<GridHeader> headers = readGridHeaders(target_);
    const bool usable = std::any_of(headers.begin(), headers.end(), [](const GridHeader& grid) {
      const std::map<std::string, std::string> metadata(grid.metadata.begin(), grid.metadata.end());
      const auto domain = metadata.find("polestar:domain");
      return grid.name == "rest" && metadata.contains("polestar:certificate") && domain != metadata.end() &&
             domain->second == "ball";
    });
    if (!usable) return;
    std::optional<SolidGrids> grids = session.timed("load_grids", [&] { return SolidGrids::read(target_); });
    if (grids) options_.mapped = std::make_shared<const SolidGrids>(std::move(*grids));
  }

  void plan(const BallMap& target, double voxel, Session& session) const {
    const Box box = boundingBox(target.chart().green().shape().surface().mesh());
    std::string names = "surface, density and ";
    names += kind_ == TextureKind::procedural ? "colors" : "what is carried";
    const int vectors = 1 + (options_.colorNames == ColorNames::both) + options_.rest +
                        (procedural_ && procedural_->hasFiber()) +
                        static_cast<int>(grids_.empty() ? 0 : grids_.size() - 1);
    describePlan(session, {plannedGrids(session.options().output, names, box, voxel, kPaddingVoxels,
                                        kBytesPerVoxel + 12 * (vectors - 1))});
  }

  void fill(const BallMap& target, double voxel, const fs::path& output, Session& session) {
    TransferOptions options = options_;
    options.grids = {.voxelSize = voxel, .padding = kPaddingVoxels};
    std::optional<TextureBody> body;
    std::vector<CarriedGrid> carried;
    if (kind_ != TextureKind::procedural) {
      SliceOptions slices;
      if (sliceVoxel_) slices.voxelSize = *sliceVoxel_;
      if (sliceOrigin_) slices.origin = *sliceOrigin_;
      body = loadTextureBody(texture_, source_, slices, session);
      carried = chooseGrids(body->grids, grids_);
    }
    std::optional<BallMap> source;
    if (body) source = body->map;
    const TextureRoute route(target, motion(target, source, session), source);
    const auto start = std::chrono::steady_clock::now();
    Transfer transfer = session.timed("transfer", [&] {
      return procedural_ ? transferTexture(route, *procedural_, options, session.context())
                         : transferGrids(route, carried, options, session.context());
    });
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    session.timed("write", [&] {
      setMetadata(transfer.grids, session);
      transfer.grids.write(output);
      return 0;
    });
    describe(transfer.report, voxel, seconds, output, session);
  }

  /// Where the target looks up the texture: the way back from what the texture does.
  std::shared_ptr<const VolumeMap> motion(const BallMap& target, const std::optional<BallMap>& source,
                                          Session& session) const {
    const BallAlignment aligned = alignBalls(alignment_, source, target, session);
    session.json().update(aligned.report);
    if (!aligned.motion) return nullptr;
    return std::make_shared<const ComposedMap>(ComposedMap().thenInverse(aligned.motion));
  }

  void setMetadata(SolidGrids& grids, const Session& session) const {
    grids.setMetadata("polestar:version", std::string(kVersion));
    grids.setMetadata("polestar:domain", std::string("solid"));
    grids.setMetadata("polestar:texture",
                      kind_ == TextureKind::procedural ? texture_ : fs::path(texture_).filename().string());
    grids.setMetadata("polestar:target", target_.filename().string());
    grids.setMetadata("polestar:arguments", session.arguments());
  }

  void describe(const TransferReport& report, double voxel, double seconds, const fs::path& output,
                Session& session) const {
    Json list = Json::array();
    std::vector<std::vector<std::string>> rows;
    for (const TransferReport::Grid& grid : report.grids) {
      list.push_back({{"name", grid.name},
                      {"from", grid.from.empty() ? Json() : Json(grid.from)},
                      {"carried", grid.how},
                      {"note", grid.note}});
      rows.push_back({grid.name, (grid.from.empty() ? "" : "from " + grid.from + ", ") + grid.how});
      if (!grid.note.empty()) session.context().log(LogLevel::warning, grid.name + ": " + grid.note);
    }
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    Json& json = session.json();
    json["grids"] = list;
    json["voxel_size"] = voxel;
    json["voxels"] = report.voxels;
    json["unanswered"] = report.unanswered;
    json["rest"] = options_.mapped ? "read" : "computed";
    json["blocks"] = {{"count", report.blocks}, {"interpolated", report.interpolated}};
    json["voxels_per_second"] = static_cast<double>(report.voxels) / seconds;
    json["peak_memory_bytes"] = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
    json["outputs"] = {output.string()};
    if (report.unanswered > 0) {
      session.context().log(LogLevel::warning, grouped(report.unanswered) + " of " + grouped(report.voxels) +
                                                   " voxels have no place in the texture and hold no value");
    }
    rows.push_back({"voxels", grouped(report.voxels) + " of " + shortNumber(voxel)});
    std::error_code ignored;
    const auto bytes = fs::file_size(output, ignored);
    rows.push_back({"wrote", ignored ? output.string() : output.string() + ", " + byteSize(bytes)});
    session.text() = texture_ + " in the solid of " + target_.string() + "\n" + table(rows, {}, "  ");
  }

  std::string texture_;
  fs::path target_, source_;
  AlignmentChoices alignment_;
  bool list_ = false;
  std::vector<std::string> settings_, grids_;
  std::optional<Vec3> sliceVoxel_, sliceOrigin_;
  GridSize size_;
  TransferOptions options_;
  TextureKind kind_ = TextureKind::procedural;
  std::unique_ptr<SolidTexture> procedural_;
};

}  // namespace

std::unique_ptr<Command> makeTransferCommand() { return std::make_unique<TransferCommand>(); }

}  // namespace polestar::cli
