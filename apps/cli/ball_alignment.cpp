#include "cli/ball_alignment.h"

#include <Eigen/Geometry>
#include <fstream>
#include <numbers>
#include <utility>

#include "cli/options.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/map/alignment.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/landmarks.h"
#include "polestar/map/snapping_map.h"
#include "polestar/map/surface_table.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

constexpr double kLandmarkReach = 0.05;  // of the box's diagonal
constexpr double kDegree = std::numbers::pi / 180;

/// Three numbers a solid and line: those of the first, and those of another.
std::vector<std::pair<Vec3, Vec3>> readPairs(const fs::path& path, const AlignedSolid& which) {
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
    if (values.size() != 3 * which.solids) {
      const std::string rule =
          which.solids == 2
              ? "a pair of landmarks is six numbers, a place on the source and one on the target"
              : "landmarks are " + std::to_string(3 * which.solids) +
                    " numbers a line, a place on each of the " + std::to_string(which.solids) + " solids";
      throw Error(Errc::io,
                  path.string() + ":" + std::to_string(number) + ": " + rule + "; found \"" + line + "\"");
    }
    const auto placeOn = [&](std::size_t solid) {
      return Vec3(values[3 * solid], values[3 * solid + 1], values[3 * solid + 2]);
    };
    pairs.emplace_back(placeOn(0), placeOn(which.number));
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

Json matchJson(const LandmarkMatch& match) {
  return {{"pairs", match.angles.size()},
          {"rotation_only", match.rotationOnly},
          {"refined", match.refined},
          {"rms_degrees", match.rms / kDegree},
          {"worst_degrees", match.worst / kDegree},
          {"largest_dilatation", match.largestDilatation},
          {"stalled", match.stalled.empty() ? Json() : Json(match.stalled)}};
}

Json rotationJson(const Mat3& rotation) {
  Json rows = Json::array();
  for (int k = 0; k < 3; ++k) rows.push_back(toJson(rotation.row(k)));
  return rows;
}

/// " of head.vdb" where warnings have to say which of several solids they mean.
std::string ofWhich(const AlignedSolid& which) { return which.solids > 2 ? " of " + which.to : ""; }

BallAlignment byLandmarks(const fs::path& path, const std::optional<BallMap>& from, const BallMap& to,
                          Session& session, const AlignedSolid& which) {
  std::vector<Vec3> onFrom, onTo;
  for (const auto& [first, second] : readPairs(path, which)) {
    onFrom.push_back(first);
    onTo.push_back(second);
  }
  if (from) onFrom = toBall(*from, onFrom, which.from);
  onTo = toBall(to, onTo, which.to);
  std::vector<LandmarkPair> pairs;
  for (std::size_t i = 0; i < onTo.size(); ++i) pairs.push_back({onFrom[i], onTo[i]});
  const LandmarkMatch match =
      session.timed("landmarks", [&] { return matchLandmarks(pairs, {}, session.context()); });

  Json json = matchJson(match);
  json["degrees"] = Json::array();
  for (const double angle : match.angles) json["degrees"].push_back(angle / kDegree);
  if (!match.stalled.empty())
    session.context().log(LogLevel::warning, "landmarks" + ofWhich(which) + ": " + match.stalled);
  return {match.motion, match.rotation, {{"landmarks", json}}};
}

BallAlignment byRadii(const BallMap& from, const BallMap& to, Session& session, const AlignedSolid& which) {
  const Alignment found = session.timed("align", [&] {
    return alignSolids(from.chart().green().shape(), to.chart().green().shape(), session.context());
  });
  const LandmarkMatch match =
      session.timed("match", [&] { return alignedMotion(from, to, found.rotation, {}, session.context()); });
  const Json json = {
      {"rotation", rotationJson(found.rotation)},
      {"degrees", Eigen::AngleAxisd(found.rotation).angle() / kDegree},
      {"correlation", found.correlation},
      {"correlation_before", found.correlationBefore},
      {"runner_up", {{"rotation", rotationJson(found.runnerUp)}, {"correlation", found.runnerUpCorrelation}}},
      {"ambiguous", found.ambiguous},
      {"directions", matchJson(match)}};
  if (found.ambiguous) {
    const double apart =
        Eigen::AngleAxisd(Mat3(found.rotation * found.runnerUp.transpose())).angle() / kDegree;
    session.context().log(
        LogLevel::warning,
        "--align" + ofWhich(which) +
            (found.correlation == 0
                 ? ": one of the solids is round, or they have nothing in "
                   "common; nothing was turned"
                 : ": a turn that differs by " + shortNumber(apart) +
                       " degrees fits about as well (correlation " + shortNumber(found.runnerUpCorrelation) +
                       " to " + shortNumber(found.correlation) + "); --landmarks decides"));
  }
  return {match.motion, match.rotation, {{"alignment", json}}};
}

BallAlignment bySurfaces(const std::vector<fs::path>& meshes, const BallMap& from, const BallMap& to,
                         Session& session, const AlignedSolid& which) {
  const TriMesh onFrom = loadMesh(meshes[0], session).mesh,
                onTo = loadMesh(meshes[which.number], session).mesh;
  const auto shells = session.timed(
      "surface_map", [&] { return std::make_shared<const ShellMap>(surfaceTable(from, onFrom, to, onTo)); });
  const Json json = {{"vertices", onFrom.vertices.size()},
                     {"triangles", onFrom.triangles.size()},
                     {"largest_dilatation", shells->largestDilatation()}};
  return {shells, shells->rotation(), {{"surface_map", json}}};
}

}  // namespace

void addAlignmentOptions(CLI::App& app, AlignmentChoices& choices, const AlignmentNames& names) {
  CLI::Option* rotate =
      addPointOption(app, "--rotate", choices.rotate, names.rotateHelp)->type_name("ax,ay,az");
  CLI::Option* landmarks =
      app.add_option("--landmarks", choices.landmarks,
                     "Bring places of " + names.from + " to places of " + names.to +
                         ": a file of lines \"ax,ay,az,bx,by,bz" + (names.more ? "[,cx,cy,cz...]" : "") +
                         "\" in the units of their meshes")
          ->type_name("FILE");
  CLI::Option* align =
      app.add_flag("--align", choices.align,
                   "Turn " + names.from + " so that its shape agrees best with that of " + names.to +
                       ", and bring points in the same direction from the centers together");
  CLI::Option* surfaceMap = app.add_option("--surface-map", choices.surfaceMap,
                                           "Follow a map of the surfaces: a mesh on that of " + names.from +
                                               ", and one with the same triangles on that of " + names.to)
                                ->expected(2, names.more ? CLI::detail::expected_max_vector_size : 2)
                                ->type_name(names.more ? "A B [C...]" : "A B");
  landmarks->excludes(rotate);
  align->excludes(rotate)->excludes(landmarks);
  surfaceMap->excludes(rotate)->excludes(landmarks)->excludes(align);
}

void addAlignmentInputs(const AlignmentChoices& choices, Session& session) {
  if (!choices.landmarks.empty()) session.addInput(choices.landmarks);
  for (const fs::path& mesh : choices.surfaceMap) session.addInput(mesh);
}

BallAlignment alignBalls(const AlignmentChoices& choices, const std::optional<BallMap>& from,
                         const BallMap& to, Session& session, const AlignedSolid& which) {
  if (choices.rotate) {
    const Mat3 rotation = rotationXyz(*choices.rotate);
    return {std::make_shared<const BallMotion>(rotation), rotation};
  }
  if (!choices.landmarks.empty()) return byLandmarks(choices.landmarks, from, to, session, which);
  if (!choices.needsBoth()) return {};
  if (!from)
    throw Error(Errc::usage, "--align and --surface-map are for two solids; a texture by name has none");
  return choices.align ? byRadii(*from, to, session, which)
                       : bySurfaces(choices.surfaceMap, *from, to, session, which);
}

}  // namespace polestar::cli
