#pragma once
// The way that `warp` sends points: through which maps, from where to where, and what becomes of points that
// lie outside.

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cli/ball_alignment.h"
#include "cli/session.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/domain_map.h"
#include "polestar/map/snapping_map.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::cli {

/// What RouteChoices::to calls the ball between the maps.
inline constexpr const char* kBallName = "ball";

struct RouteChoices {
  std::filesystem::path map;
  std::filesystem::path to;    ///< a second map; kBallName; empty: the way ends in the domain of `map`
  bool inverse = false;        ///< the same way backward
  AlignmentChoices alignment;  ///< in the ball; all but a turn want a second map
  bool exact = false;          ///< trace field lines instead of reading the table
  double snap = 1e-6;          ///< box diagonals that count as on the surface
};

/// Points on the other end of a route.
struct MovedPoints {
  std::vector<Vec3> points;  ///< NaN where there is no answer
  std::size_t snapped = 0;   ///< outside within reach, taken for points of the surface
  double farthestSnapped = 0;
  std::size_t outside = 0, firstOutside = 0;
  double farthestOutside = 0;
  std::size_t unanswered = 0, firstUnanswered = 0;  ///< inside, yet the map has no answer

  bool complete() const { return outside == 0 && unanswered == 0; }
};

class Route {
 public:
  /// Loads the maps and aligns their balls. @throws what loadMapFile and alignBalls throw; Error{Errc::usage}
  /// for a turn of the ball where the way goes on into a domain, which has its place.
  Route(const RouteChoices& choices, Session& session);

  const VolumeMap& map() const { return chain_; }
  /// Around all that can come out.
  const Box& targetBox() const { return target_.box; }
  /// "the ball", "the solid of a.pmap" or "the polycube of a.pmap"
  const std::string& sourceName() const { return source_.name; }
  const std::string& targetName() const { return target_.name; }
  /// "ball", "solid", "cube" or "polycube"
  const std::string& targetKind() const { return target_.kind; }
  /// Lengths outside that count as on the surface, in the input's units.
  double reach() const { return reach_; }
  /// Of the box around the source: the unit of --snap.
  double sourceDiagonal() const { return source_.box.diagonal(); }
  /// Points so far that had to be read from the table although --exact was given.
  std::size_t answeredByTable() const;

  /// @throws Error{Errc::cancelled}
  MovedPoints move(const std::vector<Vec3>& points, Session& session) const;

  /// Fills "from", "to", "exact" and "snap".
  void describe(Json& json) const;

 private:
  /// Where the way begins or ends: in a solid, in a domain, which is a solid with a map, too, or in the ball.
  struct End {
    std::string kind, name;
    Box box;
    std::optional<BallMap> table = std::nullopt;  ///< none of the ball
    std::shared_ptr<const SnappingMap> solid = nullptr;
    std::shared_ptr<const VolumeMap> strict = nullptr;  ///< the same without reach
  };
  void retry(const std::vector<Vec3>& points, std::size_t begin, std::size_t end, MovedPoints& moved) const;
  End endAt(const BallMap& table, const std::string& kind, const std::filesystem::path& path);
  void align(Session& session);
  void thenForward(const std::shared_ptr<const VolumeMap>& motion);
  void goOnInto(const std::shared_ptr<const DomainMap>& domain);

  RouteChoices choices_;
  std::vector<std::shared_ptr<const SnappingMap>> maps_;
  ComposedMap chain_, strict_;
  End source_, target_;
  double reach_ = 0;
};

/// "moved" of the answer: how many points, and which had no place to go.
Json describeMoved(const MovedPoints& moved, const std::vector<Vec3>& points);

/// How many points have no answer, why, and where the first is; `what`: "vertices" or "points".
std::string missingPoints(const MovedPoints& moved, const std::vector<Vec3>& points, const Route& route,
                          const std::string& what);

}  // namespace polestar::cli
