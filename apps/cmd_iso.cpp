// polestar iso: iso-surfaces and iso-curves of a map as geometry, for ParaView, Blender, Houdini.

#include <cmath>

#include "cli/dry_run.h"
#include "cli/map_input.h"
#include "cli/outputs.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/map/iso_geometry.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultLevels = 5;
constexpr int kMostLevels = 1000;

class IsoCommand final : public Command {
 public:
  Description description() const override {
    return {"iso", "Iso-surfaces and iso-curves of a map as meshes and polylines",
            "The .vtp, .obj or .ply to write; data at points come along in .vtp and .ply",
            "polestar iso asteroid.pmap -o shells.vtp --levels 0.25,0.5,0.75,1 --lines 200"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("MAP", map_, "A .pmap, or the .vdb beside it")->required()->type_name("");
    app.add_option("--levels", levels_,
                   "Ball radii of iso-surfaces such as 0.2,0.4,0.6; or how many: 4 stands for "
                   "0.25,0.5,0.75,1. Default 5, where nothing else is asked for")
        ->type_name("S,...");
    app.add_option(
           "--lines", iso_.lines,
           "So many radial lines, spread evenly: field lines of Green's function outside the map's core")
        ->check(CLI::NonNegativeNumber.description(""))
        ->type_name("N");
    app.add_option("--graticule", iso_.graticule,
                   "Longitudes and latitudes on every level, these degrees apart")
        ->type_name("DEGREES");
    app.add_option("--sheets", iso_.sheets, "So many half-planes of constant longitude, as surfaces")
        ->check(CLI::NonNegativeNumber.description(""))
        ->type_name("N");
    app.add_option("--tolerance", iso_.tolerance,
                   "How far curves may bend off their polylines, share of the box's diagonal")
        ->capture_default_str()
        ->type_name("T");
  }

  void run(Session& session) override {
    session.addInput(map_);
    const fs::path output = session.options().output;
    if (output.empty()) throw Error(Errc::usage, "-o OUT.vtp is missing");
    if (!isPolyDataOutputName(output))
      throw Error(Errc::usage, "the output " + output.string() + " does not end in .vtp, .obj or .ply");
    iso_.levels = parseLevels();
    iso_.validate();
    checkOutput(output, session.options().overwrite, session.inputs());
    if (session.options().dryRun) return describePlan(session, {{output, content(), std::nullopt}});
    const BallMap map = loadMap(map_, session);
    const PolyData geometry =
        session.timed("trace", [&] { return isoGeometry(map, iso_, session.context()); });
    session.timed("write", [&] {
      writePolyData(output, geometry, std::string("polestar ") + kVersion + ": " + session.arguments());
      return 0;
    });
    report(geometry, output, session);
  }

 private:
  /// A whole number of 1 or more is how many.
  std::vector<double> parseLevels() const {
    if (levels_.empty() && (iso_.lines > 0 || iso_.sheets > 0) && iso_.graticule == 0) return {};
    std::vector<double> levels =
        levels_.empty() ? std::vector<double>{kDefaultLevels} : parseNumbers(levels_);
    if (levels.size() != 1 || levels[0] < 1) return levels;
    const double count = levels[0];
    if (count != std::floor(count) || count > kMostLevels)
      throw Error(Errc::usage,
                  "--levels are ball radii in (0, 1], or how many, 1 to 1000; found \"" + levels_ + "\"");
    levels.clear();
    for (int k = 1; k <= static_cast<int>(count); ++k) levels.push_back(k / count);
    return levels;
  }

  std::string content() const {
    std::string text = counted(iso_.levels.size(), "iso-surface", "iso-surfaces");
    if (iso_.graticule > 0) text += " with graticules";
    if (iso_.lines > 0) text += ", " + counted(static_cast<std::uint64_t>(iso_.lines), "line", "lines");
    if (iso_.sheets > 0) text += ", " + counted(static_cast<std::uint64_t>(iso_.sheets), "sheet", "sheets");
    return text;
  }

  void report(const PolyData& geometry, const fs::path& output, Session& session) const {
    Json parts = Json::array();
    std::vector<std::vector<std::string>> rows{{"part", "faces", "curves"}};
    for (const PolyPart& part : geometry.parts) {
      const std::size_t faces = part.triangles.size() + part.quads.size();
      parts.push_back({{"name", part.name}, {"faces", faces}, {"curves", part.lines.size()}});
      rows.push_back({part.name, grouped(faces), grouped(part.lines.size())});
    }
    session.json()["levels"] = iso_.levels;
    session.json()["points"] = geometry.points.size();
    session.json()["parts"] = parts;
    session.json()["outputs"] = {output.string()};
    std::error_code ignored;
    const auto bytes = fs::file_size(output, ignored);
    session.text() = table(rows, {1, 2}) + "wrote " + output.string() + ", " +
                     counted(geometry.points.size(), "point", "points") + ", " + byteSize(bytes) + "\n";
  }

  fs::path map_;
  std::string levels_;
  IsoOptions iso_;
};

}  // namespace

std::unique_ptr<Command> makeIsoCommand() { return std::make_unique<IsoCommand>(); }

}  // namespace polestar::cli
