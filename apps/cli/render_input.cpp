#include "cli/render_input.h"

#include <algorithm>

#include "cli/map_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/map/map_file.h"
#include "polestar/render/grid_appearance.h"
#include "polestar/render/mapped_appearance.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCoordinates = "coordinates";
constexpr const char* kPlain = "plain";

bool isTexture(const std::string& name) { return !name.empty() && name != kCoordinates && name != kPlain; }

void applyIsoLines(const LookChoices& choices, IsoLines& lines) {
  lines.pixels = choices.linePixels;
  if (!choices.isoLines) return;
  lines.radius = lines.graticule = lines.skinSeams = lines.cutSeams = false;
  for (const std::string& name : *choices.isoLines) {
    if (name == "radius") lines.radius = true;
    if (name == "graticule") lines.graticule = true;
    if (name == "seams") lines.skinSeams = lines.cutSeams = true;
  }
}

Subject subjectOfMap(BallMap loaded, const LookChoices& choices) {
  Subject subject;
  subject.map = std::make_unique<const BallMap>(std::move(loaded));
  subject.surface = subject.map->chart().green().shape().surface().mesh();
  MappedLook look = choices.texture == kPlain ? plainLook() : coordinateLook(choices.linePixels);
  subject.look = choices.texture == kPlain ? kPlain : kCoordinates;
  if (isTexture(choices.texture)) {
    look = {};
    look.texture = makeTexture(choices.texture, choices.settings);
    subject.look = "texture " + choices.texture;
  }
  applyIsoLines(choices, look.lines);
  subject.appearance = makeMappedAppearance(*subject.map, subject.map.get(), std::move(look));
  return subject;
}

/// The map's own surface is sharper than what voxels hold of it.
std::optional<TriMesh> surfaceBeside(const fs::path& path, const SampledGrids& grids) {
  const fs::path file = mapFileBeside(path);
  if (!fs::exists(file)) return std::nullopt;
  MapFile map = readMapFile(file);
  if (map.hash != grids.metadata("polestar:map_hash")) return std::nullopt;
  return map.map.chart().green().shape().surface().mesh();
}

Subject subjectOfColors(const fs::path& path, const SampledGrids& grids, const LookChoices& choices) {
  Subject subject;
  std::optional<TriMesh> surface = surfaceBeside(path, grids);
  if (!surface) surface = grids.extractSurface();
  if (!surface || surface->triangles.empty()) {
    throw Error(Errc::io, path.string() +
                              " has colors, but no grid surface or density that says where the solid ends; "
                              "--fog draws grids of density alone");
  }
  subject.surface = std::move(*surface);
  GridLook look;
  applyIsoLines(choices, look.lines);
  if (look.lines.any() && !grids.find("rest", true)) {
    throw Error(Errc::usage, path.string() +
                                 " has no grid rest, which --iso-lines are read from; make it with "
                                 "transfer --rest, or leave the lines out");
  }
  subject.look = "colors of the grid " + findColors(grids)->name();
  subject.appearance = makeGridAppearance(grids, look);
  return subject;
}

}  // namespace

void LookChoices::validate() const {
  if (!isTexture(texture)) {
    if (!settings.empty()) throw Error(Errc::usage, "--set shapes a texture; name one with --texture");
  } else {
    makeTexture(texture, settings);
  }
  for (const std::string& name : isoLines.value_or(std::vector<std::string>())) {
    if (name == "none" || name == "radius" || name == "graticule" || name == "seams") continue;
    throw Error(Errc::usage, "--iso-lines are none, radius, graticule or seams; found \"" + name + "\"");
  }
  if (!(linePixels > 0 && linePixels <= 100)) {
    throw Error(Errc::usage, "--line-width must lie between 0 and 100 pixels");
  }
}

std::pair<std::string, double> parseSetting(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) {
    throw Error(Errc::usage, "a setting is name=value such as seeds=40; found \"" + text + "\"");
  }
  const std::vector<double> numbers = parseNumbers(text.substr(equals + 1));
  if (numbers.size() != 1) {
    throw Error(Errc::usage, "a setting is name=value such as seeds=40; found \"" + text + "\"");
  }
  return {text.substr(0, equals), numbers[0]};
}

Subject loadSubject(const fs::path& path, const LookChoices& choices, Session& session) {
  if (path.extension() == ".vdb" && choices.texture.empty()) {
    const SampledGrids grids = session.timed("read", [&] { return SampledGrids(path); });
    if (findColors(grids)) return subjectOfColors(path, grids, choices);
  }
  return subjectOfMap(loadMap(path, session), choices);
}

Box inputBox(const fs::path& path) {
  if (path.extension() != ".vdb")
    return boundingBox(readMapFile(path).map.chart().green().shape().surface().mesh());
  const SampledGrids grids(path);
  // Fog ends where the solid does; other grids are padded.
  if (const SampledGrid* density = grids.find("density", false)) return density->activeBox();
  Box box;
  for (const SampledGrid& grid : grids.grids()) {
    const Box active = grid.activeBox();
    box.min = box.min.cwiseMin(active.min);
    box.max = box.max.cwiseMax(active.max);
  }
  return box;
}

}  // namespace polestar::cli
