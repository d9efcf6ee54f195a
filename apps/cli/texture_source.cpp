#include "cli/texture_source.h"

#include <charconv>

#include "cli/map_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

void requireBall(const SampledGrids& grids, const std::string& name) {
  const std::string domain = grids.metadata("polestar:domain");
  if (domain.empty() || domain == "ball" || domain == "solid") return;
  throw Error(Errc::usage, name + " is parameterized over a " + domain +
                               ", the target over the ball: map both over the same domain");
}

}  // namespace

TextureKind textureKindOf(const std::string& texture) {
  if (FramePath(texture).numbered()) return TextureKind::slices;
  return fs::path(texture).extension() == ".vdb" ? TextureKind::grids : TextureKind::procedural;
}

TextureSettings parseSettings(const std::vector<std::string>& settings) {
  TextureSettings parsed;
  for (const std::string& setting : settings) {
    const auto equals = setting.find('=');
    double value = 0;
    const char *begin = setting.data() + equals + 1, *end = setting.data() + setting.size();
    const auto [stop, failed] = equals == std::string::npos
                                    ? std::from_chars_result{begin, std::errc::invalid_argument}
                                    : std::from_chars(begin, end, value);
    if (equals == 0 || failed != std::errc() || stop != end)
      throw Error(Errc::usage, "a setting is name=number, such as seeds=40; found \"" + setting + "\"");
    parsed.emplace_back(setting.substr(0, equals), value);
  }
  return parsed;
}

std::string listTextures() {
  std::string text;
  for (const TextureInfo& info : proceduralTextures()) {
    text += std::string(info.name) + ": " + std::string(info.description) + "\n";
    std::vector<std::vector<std::string>> rows;
    for (const TextureParameter& p : info.parameters) {
      rows.push_back({std::string(p.name), shortNumber(p.defaultValue),
                      "[" + shortNumber(p.min) + ", " + shortNumber(p.max) + "]",
                      std::string(p.description)});
    }
    text += table(rows, {1}, "  ");
  }
  return text;
}

Json texturesJson() {
  Json list = Json::array();
  for (const TextureInfo& info : proceduralTextures()) {
    Json parameters = Json::array();
    for (const TextureParameter& p : info.parameters) {
      parameters.push_back({{"name", p.name},
                            {"default", p.defaultValue},
                            {"min", p.min},
                            {"max", p.max},
                            {"description", p.description}});
    }
    list.push_back({{"name", info.name}, {"description", info.description}, {"parameters", parameters}});
  }
  return list;
}

TextureBody loadTextureBody(const std::string& texture, const fs::path& source, const SliceOptions& slices,
                            Session& session) {
  SampledGrids grids = session.timed("load_texture", [&] {
    return textureKindOf(texture) == TextureKind::slices ? readSlices(texture, slices, session.context())
                                                         : SampledGrids(texture);
  });
  requireBall(grids, texture);
  if (!source.empty()) return {std::move(grids), loadMap(source, session)};
  const fs::path beside = mapFileBeside(texture);
  if (textureKindOf(texture) == TextureKind::grids && fs::exists(beside))
    return {std::move(grids), loadMap(texture, session)};
  if (!grids.solidGrid()) {
    throw Error(Errc::usage,
                texture + " does not say which solid it fills: it has no grid surface or density" +
                    (textureKindOf(texture) == TextureKind::slices ? " (no alpha channel)" : "") +
                    "; name the map of its solid by --source");
  }
  BallMap map = mapOwnSurface(grids, texture, "texture", session);
  return {std::move(grids), std::move(map)};
}

}  // namespace polestar::cli
