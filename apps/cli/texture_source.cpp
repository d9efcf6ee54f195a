#include "cli/texture_source.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <numbers>

#include "cli/map_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"
#include "polestar/map/snapping_map.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kLandmarkReach = 0.05;  // of the box's diagonal

void requireBall(const SampledGrids& grids, const std::string& name) {
  const std::string domain = grids.metadata("polestar:domain");
  if (domain.empty() || domain == "ball" || domain == "solid") return;
  throw Error(Errc::usage, name + " is parameterized over a " + domain +
                               ", the target over the ball: map both over the same domain");
}

/// Six numbers a line.
std::vector<std::pair<Vec3, Vec3>> readPairs(const fs::path& path) {
  std::ifstream in(path);
  if (!in) throw Error(Errc::io, "cannot read " + path.string());
  std::vector<std::pair<Vec3, Vec3>> pairs;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    std::vector<double> values;
    try {
      values = parseNumbers(line);
    } catch (const Error&) {
    }
    if (values.size() != 6) {
      throw Error(Errc::io, path.string() + ":" + std::to_string(number) +
                                ": a pair of landmarks is six numbers, a place on the source and one on the "
                                "target; found \"" +
                                line + "\"");
    }
    pairs.emplace_back(Vec3(values[0], values[1], values[2]), Vec3(values[3], values[4], values[5]));
  }
  if (pairs.empty()) throw Error(Errc::io, path.string() + " holds no landmarks");
  return pairs;
}

/// Ball coordinates of landmarks, whose places may miss the surface.
std::vector<Vec3> toBall(const BallMap& map, const std::vector<Vec3>& places, const std::string& side) {
  const SnappingMap snapping(map, std::make_shared<BallMap>(map), kLandmarkReach);
  std::vector<Vec3> ball(places.size());
  snapping.forward(places, ball);
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (ball[i].allFinite()) continue;
    throw Error(Errc::usage, "landmark " + std::to_string(i + 1) + " is not on the " + side + ": " +
                                 shortPoint(places[i]) + " lies more than " +
                                 shortNumber(snapping.solidReach()) +
                                 " outside; is it in the units and at the place of its mesh?");
  }
  return ball;
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

LandmarkFit fitLandmarkFile(const fs::path& path, const BallMap& target, const std::optional<BallMap>& source,
                            Session& session) {
  const std::vector<std::pair<Vec3, Vec3>> pairs = readPairs(path);
  std::vector<Vec3> onSource, onTarget;
  for (const auto& [from, to] : pairs) {
    onSource.push_back(from);
    onTarget.push_back(to);
  }
  if (source) onSource = toBall(*source, onSource, "source");
  onTarget = toBall(target, onTarget, "target");
  std::vector<LandmarkPair> directions;
  for (std::size_t i = 0; i < pairs.size(); ++i) directions.push_back({onTarget[i], onSource[i]});
  LandmarkFit fit = fitLandmarks(directions);

  const double degree = 180 / std::numbers::pi;
  Json angles = Json::array();
  for (const double angle : fit.angles) angles.push_back(angle * degree);
  session.json()["landmarks"] = {{"pairs", pairs.size()},
                                 {"rotation_only", fit.rotationOnly},
                                 {"rms_degrees", fit.rms * degree},
                                 {"worst_degrees", fit.worst * degree},
                                 {"degrees", angles}};
  return fit;
}

}  // namespace polestar::cli
