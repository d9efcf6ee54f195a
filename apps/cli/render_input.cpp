#include "cli/render_input.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "cli/map_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/map_file.h"
#include "polestar/map/similarity_map.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/polycube/polycube_text.h"
#include "polestar/render/grid_appearance.h"
#include "polestar/render/mapped_appearance.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kCoordinates = "coordinates";
constexpr const char* kPlain = "plain";
constexpr const char* kLattice = "lattice";
constexpr const char* kDivisions = "divisions";
constexpr int kMostDivisions = 31;
constexpr double kJustOutside = 1 + 1e-9;  // where a DomainMap answers by the domain's surface itself
constexpr int kBallFrequency = 48;         // of the geodesic sphere that the ball is drawn as

bool isTexture(const std::string& name) {
  return !name.empty() && name != kCoordinates && name != kPlain && name != kLattice;
}

/// --set of the lattice. @throws Error{Errc::usage}
std::optional<int> divisionsOf(const TextureSettings& settings) {
  std::optional<int> divisions;
  for (const auto& [name, value] : settings) {
    if (name != kDivisions || !(value >= 1 && value <= kMostDivisions) || std::fmod(value, 2) != 1)
      throw Error(Errc::usage,
                  "a lattice has one setting, divisions (cubes along a cell), an odd number from 1 to " +
                      std::to_string(kMostDivisions));
    divisions = static_cast<int>(value);
  }
  return divisions;
}

void applyIsoLines(const LookChoices& choices, IsoLines& lines) {
  lines.pixels = choices.linePixels;
  if (!choices.isoLines) return;
  lines.radius = lines.graticule = lines.skinSeams = lines.cutSeams = lines.lattice = false;
  for (const std::string& name : *choices.isoLines) {
    if (name == "radius") lines.radius = true;
    if (name == "graticule") lines.graticule = true;
    if (name == "seams") lines.skinSeams = lines.cutSeams = true;
    if (name == kLattice) lines.lattice = true;
  }
}

const TriMesh& surfaceOf(const BallMap& map) { return map.chart().green().shape().surface().mesh(); }
const Vec3& centerOf(const BallMap& map) { return map.chart().green().shape().frame().origin; }

/// Bodies of a map, all in its world.
class MappedBodies {
 public:
  MappedBodies(MapFile file, const fs::path& path, const LookChoices& choices)
      : file_(std::make_shared<const MapFile>(std::move(file))), path_(path), choices_(choices) {
    if (!file_->domain) return;
    lattice_ = latticeOf(polycubeFromText(file_->domain->shape().cells, path.string()));
    if (choices.texture == kLattice)
      lattice_->divisions = divisionsOf(choices.settings).value_or(lattice_->divisions);
  }

  Subject subject(Body body) const {
    if (body == Body::domain) requireDomain("--show domain");
    Subject subject = body == Body::solid ? solid() : body == Body::ball ? ball() : domain();
    MappedLook look = chooseLook(subject.look);
    applyIsoLines(choices_, look.lines);
    if (look.lines.lattice) requireDomain("--iso-lines lattice");
    std::optional<DomainCoordinates> coordinates;
    if (lattice_) coordinates = domainCoordinates(body);
    // G is known in the solid, not of what lies over it.
    const BallMap* green = body == Body::solid ? &file_->map : nullptr;
    subject.appearance =
        makeMappedAppearance(*subject.coordinates, green, std::move(look), std::move(coordinates));
    return subject;
  }

 private:
  void requireDomain(const std::string& what) const {
    if (lattice_) return;
    throw Error(Errc::usage, what + " is for coordinates in a cube or polycube; those of " + path_.string() +
                                 " are in the ball. map --domain polycube makes others");
  }

  MappedLook chooseLook(std::string& name) const {
    if (choices_.texture == kLattice) requireDomain("--texture lattice");
    name = !choices_.texture.empty() ? choices_.texture : lattice_ ? kLattice : kCoordinates;
    if (name == kLattice) return latticeLook(*lattice_, choices_.linePixels);
    if (name == kPlain) return plainLook();
    if (name == kCoordinates) return coordinateLook(choices_.linePixels);
    MappedLook look;
    look.texture = makeTexture(name, choices_.settings);
    name = "texture " + name;
    return look;
  }

  std::shared_ptr<const BallMap> table() const { return {file_, &file_->map}; }

  Subject solid() const {
    return {
        .surface = surfaceOf(file_->map), .coordinates = table(), .directions = table()->sphere().directions};
  }

  Subject ball() const {
    const SimilarityMap placed = placedBall();
    const TriMesh sphere = geodesicSphere(kBallFrequency);
    return {.surface = transformed(sphere, [&](const Vec3& y) { return placed.toWorld(y); }),
            .coordinates = std::make_shared<const SimilarityMap>(placed),
            .directions = sphere.vertices};
  }

  Subject domain() const {
    const DomainMap& map = *file_->domain;
    const SimilarityMap placed = placedDomain();
    const auto chain = std::make_shared<ComposedMap>();
    chain->thenForward(std::make_shared<const SimilarityMap>(placed))
        .thenForward({file_, &map.domain()})
        .thenInverse({file_, &map.motion()});
    const std::vector<Vec3>& images = map.domain().sphere().directions;
    std::vector<Vec3> directions(images.size());
    map.motion().inverse(images, directions);
    return {.surface = transformed(surfaceOf(map.domain()), [&](const Vec3& p) { return placed.toWorld(p); }),
            .coordinates = chain,
            .directions = std::move(directions)};
  }

  /// With the solid's volume.
  SimilarityMap placedBall() const {
    const double volume = volumeProperties(surfaceOf(file_->map)).volume;
    return {centerOf(file_->map), Mat3::Identity(), std::cbrt(0.75 * volume / std::numbers::pi)};
  }

  /// Where it overlaps the solid best.
  SimilarityMap placedDomain() const {
    const DomainShape& shape = file_->domain->shape();
    return {centerOf(file_->map), shape.axes, shape.unit};
  }

  DomainCoordinates domainCoordinates(Body body) const {
    if (body == Body::domain) {
      Lattice lattice = *lattice_;
      lattice.straight = true;
      return {std::move(lattice),
              [placed = placedDomain()](auto points, auto, auto places) { placed.forward(points, places); }};
    }
    const std::shared_ptr<const DomainMap> map(file_, &*file_->domain);
    const auto toBall = body == Body::ball ? ballLookup(placedBall()) : ballLookup(file_->map);
    return {*lattice_, [map, toBall](auto points, auto skin, auto places) {
              std::vector<Vec3> ball(points.size());
              toBall(points, ball);
              for (std::size_t i = 0; i < ball.size(); ++i) {
                if (skin[i]) ball[i] = kJustOutside * ball[i].stableNormalized();
              }
              map->sampleFromBall(ball, places);
            }};
  }

  /// Points of the world -> the solid's ball, and on outside of it.
  using BallLookup = std::function<void(std::span<const Vec3>, std::span<Vec3>)>;
  static BallLookup ballLookup(const SimilarityMap& placed) {
    return [placed](auto points, auto ball) { placed.forward(points, ball); };
  }
  static BallLookup ballLookup(const BallMap& solid) {
    return [solid](auto points, auto ball) {
      std::vector<double> green(points.size());
      solid.sample(points, ball, green);
    };
  }

  std::shared_ptr<const MapFile> file_;
  fs::path path_;
  const LookChoices& choices_;
  std::optional<Lattice> lattice_;  ///< of the map's domain
};

/// The map's own surface is sharper than what voxels hold of it.
std::optional<TriMesh> surfaceBeside(const fs::path& path, const SampledGrids& grids) {
  const fs::path file = mapFileBeside(path);
  if (!fs::exists(file)) return std::nullopt;
  MapFile map = readMapFile(file);
  if (map.hash != grids.metadata("polestar:map_hash")) return std::nullopt;
  return surfaceOf(map.map);
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
  if (look.lines.lattice) {
    throw Error(Errc::usage,
                "--iso-lines lattice are drawn by a map, not over the colors of a .vdb; name a look with "
                "--texture");
  }
  if (look.lines.ofBall() && !grids.find("rest", true)) {
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
  if (texture == kLattice) {
    divisionsOf(settings);
  } else if (!isTexture(texture)) {
    if (!settings.empty()) throw Error(Errc::usage, "--set shapes a texture; name one with --texture");
  } else {
    makeTexture(texture, settings);
  }
  for (const std::string& name : isoLines.value_or(std::vector<std::string>())) {
    if (name == "none" || name == "radius" || name == "graticule" || name == "seams" || name == kLattice)
      continue;
    throw Error(Errc::usage,
                "--iso-lines are none, radius, graticule, seams or lattice; found \"" + name + "\"");
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

std::vector<Subject> loadSubjects(const fs::path& path, std::span<const Body> bodies,
                                  const LookChoices& choices, Session& session) {
  std::vector<Subject> subjects;
  const bool solidAlone = std::ranges::all_of(bodies, [](Body body) { return body == Body::solid; });
  if (path.extension() == ".vdb" && choices.texture.empty() && solidAlone) {
    const SampledGrids grids = session.timed("read", [&] { return SampledGrids(path); });
    if (findColors(grids)) {
      for (std::size_t i = 0; i < bodies.size(); ++i)
        subjects.push_back(subjectOfColors(path, grids, choices));
      return subjects;
    }
  }
  const MappedBodies mapped(loadMapFile(path, session), path, choices);
  for (const Body body : bodies) subjects.push_back(mapped.subject(body));
  return subjects;
}

Box inputBox(const fs::path& path) {
  if (path.extension() != ".vdb") return boundingBox(surfaceOf(readMapFile(path).map));
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
