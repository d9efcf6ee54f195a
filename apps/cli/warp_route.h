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
#include "polestar/map/snapping_map.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::cli {

struct RouteChoices {
  std::filesystem::path map;
  std::filesystem::path to;    ///< a second map; empty: the way ends in the ball
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
  /// Loads the maps and aligns their balls. @throws what loadMap and alignBalls throw.
  Route(const RouteChoices& choices, Session& session);

  bool fromBall() const { return !source_.solid; }
  bool toBall() const { return !target_.solid; }
  const VolumeMap& map() const { return chain_; }
  /// Around all that can come out.
  const Box& targetBox() const { return target_.box; }
  /// "the ball" or "the solid of a.pmap"
  const std::string& sourceName() const { return source_.name; }
  const std::string& targetName() const { return target_.name; }
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
  /// Where the way begins or ends; without a solid, in the ball.
  struct End {
    std::shared_ptr<const SnappingMap> solid;
    std::optional<BallMap> table;
    std::shared_ptr<const VolumeMap> strict;  ///< the same without reach
    std::string name;
    Box box;
  };
  void retry(const std::vector<Vec3>& points, std::size_t begin, std::size_t end, MovedPoints& moved) const;
  End load(const std::filesystem::path& path, Session& session);
  void align(Session& session);

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
