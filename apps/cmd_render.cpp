// polestar render: pictures of a solid, cut open, in its coordinates, a texture, or the colors of its grids.

#include <algorithm>
#include <map>
#include <numbers>
#include <string_view>

#include "cli/dry_run.h"
#include "cli/frame_plan.h"
#include "cli/outputs.h"
#include "cli/render_input.h"
#include "cli/render_options.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/io/display_view.h"
#include "polestar/render/iso_objects.h"
#include "polestar/render/render_fog.h"
#include "polestar/render/render_solid.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNone = "none";
constexpr std::string_view kWhole = "whole-";

/// One of the pictures that stand side by side.
struct Panel {
  Body body = Body::solid;
  bool whole = false;  ///< without cuts
};

/// "domain", "whole-domain" @throws Error{Errc::usage}
Panel parsePanel(const std::string& text) {
  static const std::map<std::string_view, Body> kBodies{
      {"solid", Body::solid}, {"ball", Body::ball}, {"domain", Body::domain}};
  Panel panel;
  std::string_view name = text;
  panel.whole = name.starts_with(kWhole);
  if (panel.whole) name.remove_prefix(kWhole.size());
  const auto found = kBodies.find(name);
  if (found == kBodies.end()) {
    throw Error(
        Errc::usage,
        "--show takes solid, ball, domain, whole-solid, whole-ball and whole-domain; found \"" + text + "\"");
  }
  panel.body = found->second;
  return panel;
}
constexpr double kRadians = std::numbers::pi / 180;

/// Over all frames.
struct Totals {
  std::size_t solid = 0, unmapped = 0, primary = 0, light = 0;
  double seconds = 0;

  void add(const Rendering& rendering) {
    solid += rendering.solidSamples;
    unmapped += rendering.unmappedSamples;
    primary += rendering.primaryRays;
    light += rendering.lightRays;
    seconds += rendering.seconds;
  }
  double raysPerSecond() const { return seconds > 0 ? static_cast<double>(primary + light) / seconds : 0; }
};

class RenderCommand final : public Command {
 public:
  Description description() const override {
    return {"render", "Draw a solid, cut open, in its coordinates, a texture or its own colors",
            "The .png or .exr to write; with --frames name.####.png",
            "polestar render asteroid.vdb -o asteroid.png --texture kiwi --cut x --cut -y"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("INPUT", input_,
                   "A .pmap, the .vdb beside it, or a .vdb with colors; with --frames name.####.vdb")
        ->required()
        ->type_name("");
    addLookOptions(app);
    addSceneOptions(app);
    addFoliationOptions(app);
    addFogOptions(app);
    addPictureOptions(app);
  }

  void run(Session& session) override {
    prepare(session);
    if (shot_ && !frames_) throw Error(Errc::usage, "--shot is for --frames, a part of it");
    const std::vector<FrameJob> jobs = planFrames(input_, session.options().output, frames_);
    const std::vector<FrameJob> shot = shot_ ? planFrames(input_, session.options().output, shot_) : jobs;
    requirePartOf(shot, jobs);
    for (const FrameJob& job : shot) {
      if (session.inputs().empty() || session.inputs().back() != job.input) session.addInput(job.input);
    }
    for (const FrameJob& job : jobs) checkOutput(job.output, session.options().overwrite, session.inputs());
    if (session.options().dryRun) return describe(jobs, session);
    placeFrames(shot, session);
    draw(jobs, session);
  }

 private:
  void addLookOptions(CLI::App& app) {
    app.add_option(
           "--texture", look_.texture,
           "A solid texture by name (see polestar transfer --list); coordinates: panels of a soccer ball "
           "times bands of radius; lattice: cubes of the cells of a map's cube or polycube; or plain. "
           "Default: "
           "plain with shells and field lines, else the colors Cd or color of a .vdb, else lattice where the "
           "map has one, else coordinates")
        ->type_name("NAME");
    app.add_option("--set", settings_,
                   "A parameter of the texture; of lattice: divisions=D, cubes along a cell")
        ->type_name("NAME=VALUE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--iso-lines", isoLines_,
                   "Curves over any look, separated by commas: radius (on cuts), graticule (longitudes and "
                   "latitudes on the skin), seams (of the panels), lattice (planes between cells, and edges "
                   "of the cube or polycube), none")
        ->type_name("WHAT")
        ->delimiter(',');
    app.add_option("--line-width", linePixels_, "Of iso-lines; default 1/480 of the picture's height")
        ->type_name("PIXELS");
  }

  void addSceneOptions(CLI::App& app) {
    app.add_option(
           "--show", show_,
           "What of a map is drawn: solid (default), domain (its cube or polycube, where it lies over the "
           "solid), ball; whole-solid and so on without the cuts. Several, separated by commas, stand side "
           "by side")
        ->type_name("BODY,...")
        ->delimiter(',');
    app.add_option("--cut", cuts_,
                   "Take away what lies beyond a plane: x, -y, z,0.2 or nx,ny,nz[,offset], offset in [-1, 1] "
                   "from the center to the far end. Twice: a wedge. none: the whole solid. Default x")
        ->type_name("PLANE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--cut-mode", cutMode_,
                   "Of several planes: notch (default) takes away what lies beyond all of them, slices what "
                   "lies beyond any")
        ->check(CLI::IsMember({"notch", "slices"}).description(""))
        ->type_name("MODE");
    app.add_option("--explode", explode_,
                   "Keep all pieces that the planes make, up to 4 planes, and move their sides apart by this "
                   "share of half the box's diagonal, such as 0.3")
        ->type_name("D");
    addPointOption(app, "--view", view_, "Direction that the camera looks along");
    addPointOption(app, "--up", up_, "Direction that is up in the picture; default 0,0,1");
    app.add_option("--fov", fieldOfView_, "Vertical field of view; default 26")->type_name("DEGREES");
    app.add_option("--background", background_, "#rrggbb, white, grey, black or transparent")
        ->type_name("COLOR");
    app.add_flag("--no-floor", noFloor_, "No floor and no shadow on it");
    app.add_option("--light-size", options_.keySize, "Of the key light: 0 hard shadows, 1 soft, up to 3")
        ->capture_default_str()
        ->type_name("S");
    app.add_flag("--flat", flat_, "Plain colors without light");
  }

  void addFoliationOptions(CLI::App& app) {
    app.add_option(
           "--shells", foliation_.shells,
           "Iso-surfaces of these ball radii, between 0 and 1, nested in the solid, of which the skin "
           "alone is left. Planes cut them like the skin, but for the innermost")
        ->type_name("S,...")
        ->delimiter(',');
    app.add_option("--field-lines", foliation_.lines,
                   "So many field lines as tubes, from the innermost shell to the skin, not cut")
        ->type_name("N");
    app.add_option("--tube-width", foliation_.lineWidth, "Of field lines, share of the solid's box diagonal")
        ->capture_default_str()
        ->type_name("SHARE");
  }

  bool foliated() const { return !foliation_.shells.empty() || foliation_.lines > 0; }

  void addFogOptions(CLI::App& app) {
    app.add_flag("--fog", fog_,
                 "Draw the grid density (or the first fog) of a .vdb as fog, in the colors Cd or color where "
                 "there are any");
    app.add_option(
           "--mean-free-path", meanFreePath_,
           "How far light gets in fog of density 1, share of half the diagonal of its box; default 0.04")
        ->type_name("SHARE");
  }

  void addPictureOptions(CLI::App& app) {
    app.add_option("--size", size_, "Pixels, of each body that --show names; default 1280x960")
        ->type_name("WxH");
    app.add_option("--samples", options_.samples, "Samples a pixel")->capture_default_str()->type_name("N");
    app.add_option("--crop", crop_, "Render these pixels alone; an .exr keeps their place")
        ->type_name("X0,Y0,X1,Y1");
    app.add_option("--frames", frames_, "Frames, both ends included: 1-48, 1-240x2")->type_name("RANGE");
    app.add_option(
           "--shot", shot_,
           "All frames of the shot that --frames are a part of: turntable and camera are those of the whole, "
           "so that a farm can draw it in pieces")
        ->type_name("RANGE");
    app.add_option("--turntable", turntable_,
                   "Turn the solid by this over the frames; default 360 for one input, 0 for a sequence")
        ->type_name("DEGREES");
    app.add_flag("--no-aovs", noAovs_,
                 "An .exr with colors alone: no Z, N, ball, green, id; so is one of several bodies");
    app.add_option("--ocio-display", ocioDisplay_,
                   "Of the OpenColorIO configuration that $OCIO names: its display for a .png; default the "
                   "configuration's own")
        ->type_name("NAME");
    app.add_option("--ocio-view", ocioView_, "The view of that display")->type_name("NAME");
    app.add_flag("--no-ocio", noOcio_, "Polestar's own view transform, whatever $OCIO says");
  }

  bool exr(Session& session) const { return session.options().output.extension() == ".exr"; }

  void prepare(Session& session) {
    const fs::path& output = session.options().output;
    if (output.empty()) throw Error(Errc::usage, "-o OUT.png is missing");
    if (output.extension() != ".png" && output.extension() != ".exr") {
      throw Error(Errc::usage, "the output " + output.string() + " does not end in .png or .exr");
    }
    prepareScene();
    if (!show_.empty()) panels_.clear();
    for (const std::string& body : show_) panels_.push_back(parsePanel(body));
    foliation_.validate();
    if (foliated() && look_.texture.empty()) look_.texture = "plain";
    if (foliated() && explode_)
      throw Error(Errc::usage, "--shells and --field-lines do not explode; use --cut");
    prepareFog();
    if (!size_.empty()) parseSize(size_, options_);
    if (!crop_.empty()) options_.crop = parseCrop(crop_);
    if (options_.crop && panels_.size() > 1)
      throw Error(Errc::usage, "--crop is a part of one picture, and --show names several");
    options_.aovs = exr(session) && !noAovs_ && !fog_ && panels_.size() == 1;
    options_.validate();
    for (const std::string& setting : settings_) look_.settings.push_back(parseSetting(setting));
    if (!isoLines_.empty()) look_.isoLines = isoLines_;
    look_.linePixels = linePixels_.value_or(std::max(1.0, options_.height / 480.0));
    look_.validate();
    prepareDisplay(session);
  }

  void prepareFog() {
    if (meanFreePath_) fogLook_.meanFreePath = *meanFreePath_;
    fogLook_.validate();
    if (!fog_) {
      if (meanFreePath_) throw Error(Errc::usage, "--mean-free-path is for --fog");
      return;
    }
    if (input_.extension() != ".vdb")
      throw Error(Errc::usage, "--fog draws grids: the input must end in .vdb");
    if (!look_.texture.empty() || !isoLines_.empty())
      throw Error(Errc::usage, "--fog has the colors of its grids; leave --texture and --iso-lines out");
    if (explode_) throw Error(Errc::usage, "a fog cannot be exploded; use --cut");
    if (!show_.empty()) throw Error(Errc::usage, "a fog is grids alone; leave --show out");
    if (foliated()) throw Error(Errc::usage, "a fog has no map; leave --shells and --field-lines out");
  }

  void prepareScene() {
    // A solid shows its inside by default; a fog does so anyway.
    if (cuts_.empty() && !fog_) cuts_ = {"x"};
    if (cuts_ != std::vector<std::string>{kNone}) {
      for (const std::string& cut : cuts_) options_.cuts.push_back(parseCut(cut));
    }
    if (cutMode_ == "slices") options_.cutMode = CutMode::slices;
    if (explode_) {
      if (!cutMode_.empty()) throw Error(Errc::usage, "--explode keeps all pieces; leave --cut-mode out");
      options_.cutMode = CutMode::explode;
      options_.explode = *explode_;
    }
    if (view_) options_.viewDirection = *view_;
    if (up_) options_.up = *up_;
    if (fieldOfView_) options_.fieldOfView = *fieldOfView_ * kRadians;
    if (!background_.empty()) parseBackground(background_, options_);
    options_.floor = !noFloor_;
    if (flat_) options_.shading = Shading::flat;
  }

  void prepareDisplay(Session& session) {
    const bool named = !ocioDisplay_.empty() || !ocioView_.empty();
    if (named && exr(session)) {
      throw Error(Errc::usage, "an .exr is scene-linear: --ocio-display and --ocio-view are for .png");
    }
    if (named && noOcio_)
      throw Error(Errc::usage, "--no-ocio leaves no use for --ocio-display and --ocio-view");
    if (exr(session) || noOcio_ || (!named && !DisplayView::configured())) return;
    display_.emplace(ocioDisplay_, ocioView_);
  }

  void requirePartOf(const std::vector<FrameJob>& shot, const std::vector<FrameJob>& jobs) const {
    for (const FrameJob& job : jobs) {
      const bool part = std::any_of(shot.begin(), shot.end(),
                                    [&](const FrameJob& other) { return other.frame == job.frame; });
      if (!part)
        throw Error(Errc::usage, "frame " + std::to_string(*job.frame) + " is not in the shot " + *shot_);
    }
  }

  /// What the frames of a shot share, and how far each of them is turned.
  void placeFrames(const std::vector<FrameJob>& shot, Session& session) {
    const bool sequence = shot.back().input != shot.front().input;
    if (sequence) options_.framed = cornersOf(sequenceBox(shot, session));
    const double degrees = turntable_.value_or(sequence || shot.size() == 1 ? 0 : 360);
    for (std::size_t i = 0; i < shot.size(); ++i) {
      turns_[shot[i].frame] = degrees * kRadians * static_cast<double>(i) / static_cast<double>(shot.size());
      options_.turns.push_back(turns_[shot[i].frame]);
    }
  }

  void describe(const std::vector<FrameJob>& jobs, Session& session) const {
    const PixelBox box = options_.crop.value_or(PixelBox{0, 0, options_.width, options_.height});
    const int width = (box.x1 - box.x0) * static_cast<int>(panels_.size()), height = box.y1 - box.y0;
    Picture picture;
    picture.width = width;
    picture.height = height;
    if (options_.aovs) picture.channels = solidAovs();
    std::vector<PlannedFile> files;
    for (const FrameJob& job : jobs) {
      files.push_back({job.output,
                       "picture of " + std::to_string(width) + " x " + std::to_string(height) + " pixels",
                       exr(session) ? largestExrBytes(picture) : largestPngBytes(picture)});
    }
    describePlan(session, files);
    const double megapixels = 1e-6 * width * height;
    session.json()["dry_run"]["frames"] = jobs.size();
    session.json()["dry_run"]["megapixels"] = megapixels;
    session.json()["dry_run"]["samples"] = options_.samples;
    session.text() +=
        counted(jobs.size(), "picture", "pictures") + " of " + shortNumber(megapixels) + " megapixels, " +
        counted(static_cast<std::uint64_t>(options_.samples), "sample", "samples") + " a pixel\n";
  }

  void draw(const std::vector<FrameJob>& jobs, Session& session) {
    const bool sequence = jobs.back().input != jobs.front().input;
    Totals totals;
    Json outputs = Json::array();
    Stage stage;
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      if (i == 0 || sequence) {
        stage = Stage();
        stage = fog_ ? fogStage(jobs[i].input, session) : solidStage(jobs[i].input, session);
      }
      const FrameProgress progress(session.context(), i, jobs.size());
      const double turn = turns_.at(jobs[i].frame);
      std::vector<Picture> pictures;
      for (std::size_t k = 0; k < panels_.size(); ++k) {
        Rendering rendering = stage.fog ? stage.fog->render(turn, session.context())
                                        : stage.solids[k]->render(turn, session.context());
        totals.add(rendering);
        pictures.push_back(std::move(rendering.picture));
      }
      session.noteSeconds("render", totals.seconds);
      write(jobs[i].output, sideBySide(std::move(pictures)), session);
      outputs.push_back(jobs[i].output.string());
      session.json()["outputs"] = outputs;
      session.text() += "wrote " + jobs[i].output.string() + "\n";
    }
    report(stage.look(), totals, session);
  }

  /// An input, ready to be drawn.
  struct Stage {
    std::vector<Subject> subjects;  ///< one a panel
    std::vector<std::unique_ptr<SolidRenderer>> solids;
    std::unique_ptr<FogRenderer> fog;
    std::string fogLook;
    const std::string& look() const { return fog ? fogLook : subjects.front().look; }
  };

  Stage solidStage(const fs::path& path, Session& session) const {
    std::vector<Body> bodies;
    for (const Panel& panel : panels_) bodies.push_back(panel.body);
    Stage stage;
    stage.subjects = loadSubjects(path, bodies, look_, session);
    for (std::size_t k = 0; k < panels_.size(); ++k) {
      const Subject& subject = stage.subjects[k];
      RenderOptions options = options_;
      if (panels_[k].whole) options.cuts.clear();
      if (panels_.size() > 1 && options.framed.empty()) options.framed = pointsOf(stage.subjects);
      if (foliated()) {
        options.hollow = !foliation_.shells.empty();
        options.objects = session.timed("foliation", [&] {
          return isoObjects(*subject.coordinates, subject.surface, subject.directions, foliation_,
                            session.context());
        });
      }
      stage.solids.push_back(session.timed("scene", [&] {
        return std::make_unique<SolidRenderer>(subject.surface, *subject.appearance, options);
      }));
    }
    return stage;
  }

  /// Bodies side by side are drawn in one scale.
  static std::vector<Vec3> pointsOf(const std::vector<Subject>& subjects) {
    std::vector<Vec3> points;
    for (const Subject& subject : subjects)
      points.insert(points.end(), subject.surface.vertices.begin(), subject.surface.vertices.end());
    return points;
  }

  Stage fogStage(const fs::path& path, Session& session) const {
    const FogVolume fog = session.timed("read", [&] { return FogVolume(path); });
    Stage stage;
    stage.fogLook = "fog of the grid " + fog.densityName() +
                    (fog.colorName().empty() ? "" : " in the colors of " + fog.colorName());
    stage.fog = std::make_unique<FogRenderer>(fog, fogLook_, options_);
    return stage;
  }

  /// Of all inputs' active voxels, so that the camera stands still.
  static Box sequenceBox(const std::vector<FrameJob>& jobs, Session& session) {
    Box box;
    for (std::size_t i = 0; i < jobs.size(); ++i) {
      session.context().throwIfCancelled();
      session.context().progress("measuring the sequence",
                                 static_cast<double>(i) / static_cast<double>(jobs.size()));
      const Box frame = inputBox(jobs[i].input);
      box.min = box.min.cwiseMin(frame.min);
      box.max = box.max.cwiseMax(frame.max);
    }
    return box;
  }

  void write(const fs::path& path, const Picture& picture, Session& session) const {
    const PictureText text{{"polestar:arguments", session.arguments()},
                           {"polestar:samples", std::to_string(options_.samples)}};
    session.timed("write", [&] {
      if (exr(session))
        writeExr(path, picture, text);
      else
        writePicture(path, picture, text, display_ ? &*display_ : nullptr);
      return 0;
    });
  }

  void report(const std::string& look, const Totals& totals, Session& session) const {
    session.json()["look"] = look;
    session.json()["view_transform"] =
        exr(session) ? Json() : Json(display_ ? display_->name() : std::string("polestar"));
    session.json()["samples"] = {
        {"per_pixel", options_.samples}, {"solid", totals.solid}, {"unmapped", totals.unmapped}};
    session.json()["rays"] = {{"camera", totals.primary},
                              {"light", totals.light},
                              {"seconds", totals.seconds},
                              {"per_second", totals.raysPerSecond()}};
    session.text() += look + "; " + grouped(totals.primary) + " camera rays and " + grouped(totals.light) +
                      " light rays in " + duration(totals.seconds) + ", " +
                      shortNumber(1e-6 * totals.raysPerSecond()) + " million a second\n";
    if (totals.unmapped == 0) return;
    session.context().log(LogLevel::warning, grouped(totals.unmapped) + " of " + grouped(totals.solid) +
                                                 " samples have no color there and are drawn grey");
  }

  fs::path input_;
  LookChoices look_;
  std::vector<std::string> settings_, isoLines_;
  std::optional<double> linePixels_, explode_, meanFreePath_, fieldOfView_, turntable_;
  std::vector<std::string> cuts_, show_;
  std::vector<Panel> panels_{Panel{}};
  std::string cutMode_, size_, crop_, background_, ocioDisplay_, ocioView_;
  std::optional<std::string> frames_, shot_;
  std::map<std::optional<int>, double> turns_;  ///< radians, by frame
  std::optional<Vec3> view_, up_;
  bool noFloor_ = false, flat_ = false, noAovs_ = false, noOcio_ = false, fog_ = false;
  FogOptions fogLook_;
  IsoObjectOptions foliation_;
  std::optional<DisplayView> display_;
  RenderOptions options_;
};

}  // namespace

std::unique_ptr<Command> makeRenderCommand() { return std::make_unique<RenderCommand>(); }

}  // namespace polestar::cli
