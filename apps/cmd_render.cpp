// polestar render: a picture of a mapped solid, cut open, with its ball coordinates as a pattern.

#include <charconv>

#include "cli/dry_run.h"
#include "cli/map_input.h"
#include "cli/outputs.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/render/mapped_appearance.h"
#include "polestar/render/render_solid.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNoCut = "none";

/// "x", "-y", "z,0.2", "1,1,0" or "1,1,0,0.2": what lies on the normal's side of the plane is cut away.
CutPlane parseCut(const std::string& text) {
  const bool negative = !text.empty() && text[0] == '-';
  const std::size_t letter = negative ? 1 : 0;
  const std::size_t axis = std::string("xyz").find(letter < text.size() ? text[letter] : ' ');
  CutPlane cut;
  std::vector<double> numbers;
  if (axis != std::string::npos) {
    cut.normal = (negative ? -1 : 1) * Vec3::Unit(static_cast<Eigen::Index>(axis));
    const std::string rest = text.substr(letter + 1);
    if (!rest.empty()) numbers = parseNumbers(rest);
    if (numbers.size() <= 1 && (rest.empty() || rest[0] == ',')) {
      if (!numbers.empty()) cut.offset = numbers[0];
      return cut;
    }
  } else {
    numbers = parseNumbers(text);
    if (numbers.size() == 3 || numbers.size() == 4) {
      cut.normal = Vec3(numbers[0], numbers[1], numbers[2]);
      if (numbers.size() == 4) cut.offset = numbers[3];
      return cut;
    }
  }
  throw Error(Errc::usage, "a cut is x, -y, z,0.2, nx,ny,nz or nx,ny,nz,offset; found \"" + text + "\"");
}

/// "1280x960"
void parseSize(const std::string& text, RenderOptions& options) {
  const char* const end = text.data() + text.size();
  const auto [cross, first] = std::from_chars(text.data(), end, options.width);
  if (first == std::errc() && cross != end && *cross == 'x') {
    const auto [last, second] = std::from_chars(cross + 1, end, options.height);
    if (second == std::errc() && last == end) return;
  }
  throw Error(Errc::usage, "a size is WIDTHxHEIGHT such as 1280x960; found \"" + text + "\"");
}

class RenderCommand final : public Command {
 public:
  Description description() const override {
    return {"render", "Draw a mapped solid, cut open, with its ball coordinates as a pattern",
            "The .png to write", "polestar render asteroid.vdb -o asteroid.png --cut x --cut -y"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("MAP", map_, "A .pmap, or the .vdb beside it")->required()->type_name("");
    app.add_option("--cut", cuts_,
                   "Take away what lies beyond a plane: x, -y, z,0.2 or nx,ny,nz[,offset], offset in [-1, 1] "
                   "from the "
                   "center to the far end. Twice: a wedge. none: the whole solid. Default x")
        ->type_name("PLANE")
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    app.add_option("--size", size_, "Pixels; default 1280x960")->type_name("WxH");
    app.add_option("--samples", options_.samples, "Samples a pixel")->capture_default_str()->type_name("N");
    addPointOption(app, "--view", view_, "Direction that the camera looks along");
  }

  void run(Session& session) override {
    session.addInput(map_);
    const fs::path picture = session.options().output;
    if (picture.empty()) throw Error(Errc::usage, "-o OUT.png is missing");
    if (picture.extension() != ".png") {
      throw Error(Errc::usage, "the output " + picture.string() + " does not end in .png");
    }
    if (!size_.empty()) parseSize(size_, options_);
    if (view_) options_.viewDirection = *view_;
    if (cuts_ != std::vector<std::string>{kNoCut}) {
      for (const std::string& cut : cuts_) options_.cuts.push_back(parseCut(cut));
    }
    options_.validate();
    checkOutput(picture, session.options().overwrite, session.inputs());
    if (session.options().dryRun) {
      const std::string size = std::to_string(options_.width) + " x " + std::to_string(options_.height);
      return describePlan(session, {{picture, "picture of " + size + " pixels", std::nullopt}});
    }
    draw(picture, session);
  }

 private:
  void draw(const fs::path& picture, Session& session) const {
    const BallMap map = loadMap(map_, session);
    const TriMesh& surface = map.chart().green().shape().surface().mesh();
    const auto appearance = makeMappedAppearance(map, &map, coordinateLook(options_.height / 480.0));
    const Rendering rendering = session.timed(
        "render", [&] { return renderSolid(surface, *appearance, options_, session.context()); });
    session.timed("write", [&] {
      writePicture(picture, rendering.picture, {{"polestar:arguments", session.arguments()}});
      return 0;
    });
    session.json()["outputs"] = {picture.string()};
    session.json()["samples"] = {{"solid", rendering.solidSamples}, {"unmapped", rendering.unmappedSamples}};
    session.text() = "wrote " + picture.string() + "\n";
    if (rendering.unmappedSamples > 0) {
      session.context().log(LogLevel::warning, grouped(rendering.unmappedSamples) + " of " +
                                                   grouped(rendering.solidSamples) +
                                                   " samples have no coordinates and are drawn grey");
    }
  }

  fs::path map_;
  std::vector<std::string> cuts_{"x"};
  std::string size_;
  std::optional<Vec3> view_;
  RenderOptions options_;
};

}  // namespace

std::unique_ptr<Command> makeRenderCommand() { return std::make_unique<RenderCommand>(); }

}  // namespace polestar::cli
