#include "cli/warp_route.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "cli/map_input.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/map/map_file.h"

namespace polestar::cli {
namespace {

// Points between two looks at progress and Ctrl-C: well below a second of work.
constexpr std::size_t kPortion = std::size_t{1} << 17, kTracedPortion = 2048;

}  // namespace

Route::End Route::endAt(const BallMap& table, const std::string& kind, const std::filesystem::path& path) {
  std::shared_ptr<const VolumeMap> map;
  if (choices_.exact) {
    map = std::make_shared<TracedBallMap>(table);
  } else {
    map = std::make_shared<BallMap>(table);
  }
  const auto snapping = std::make_shared<SnappingMap>(table, map, choices_.snap);
  maps_.push_back(snapping);
  return {.kind = kind,
          .name = "the " + kind + " of " + path.string(),
          .box = boundingBox(table.chart().green().shape().surface().mesh()),
          .table = table,
          .solid = snapping,
          .strict = map};
}

Route::Route(const RouteChoices& choices, Session& session) : choices_(choices) {
  const MapFile from = loadMapFile(choices_.map, session);
  source_ = endAt(from.map, "solid", choices_.map);
  chain_.thenForward(source_.solid);
  strict_.thenForward(source_.strict);
  if (choices_.to.empty() && from.domain) {
    goOnInto(std::make_shared<const DomainMap>(*from.domain));
  } else if (choices_.to.empty() || choices_.to == kBallName) {
    target_ = {.kind = "ball", .name = "the ball", .box = {Vec3::Constant(-1), Vec3::Constant(1)}};
  } else {
    target_ = endAt(loadMap(choices_.to, session), "solid", choices_.to);
  }
  align(session);
  if (target_.solid) {
    chain_.thenInverse(target_.solid);
    strict_.thenInverse(target_.strict);
  }
  if (choices_.inverse) {
    chain_ = chain_.inverted();
    strict_ = strict_.inverted();
    std::swap(source_, target_);
  }
  reach_ = choices_.snap * source_.box.diagonal();
}

void Route::thenForward(const std::shared_ptr<const VolumeMap>& motion) {
  chain_.thenForward(motion);
  strict_.thenForward(motion);
}

void Route::goOnInto(const std::shared_ptr<const DomainMap>& domain) {
  if (choices_.alignment.any()) {
    throw Error(Errc::usage, choices_.map.string() + " leads on into a " + domain->shape().kind +
                                 ", which has its place; --rotate turns the ball: end there by --to ball");
  }
  target_ = endAt(domain->domain(), domain->shape().kind, choices_.map);
  // The motion lasts as long as the map that it is a part of.
  thenForward(std::shared_ptr<const VolumeMap>(domain, &domain->motion()));
}

// A turn is one outside of the ball, too, where points may still be taken for points of the surface.
void Route::align(Session& session) {
  const AlignmentChoices& alignment = choices_.alignment;
  if (alignment.rotate) {
    chain_.thenRotate(rotationXyz(*alignment.rotate));
    strict_.thenRotate(rotationXyz(*alignment.rotate));
  } else if (alignment.any()) {
    const BallAlignment aligned =
        alignBalls(alignment, source_.table.value(), target_.table.value(), session);
    session.json().update(aligned.report);
    thenForward(aligned.motion);
  }
}

std::size_t Route::answeredByTable() const {
  std::size_t count = 0;
  for (const auto& map : maps_) count += map->answeredByTable();
  return count;
}

MovedPoints Route::move(const std::vector<Vec3>& points, Session& session) const {
  MovedPoints moved;
  moved.points.resize(points.size());
  const std::size_t portion = choices_.exact ? kTracedPortion : kPortion;
  for (std::size_t begin = 0; begin < points.size(); begin += portion) {
    session.context().throwIfCancelled();
    session.context().progress("warping", static_cast<double>(begin) / static_cast<double>(points.size()));
    const std::size_t count = std::min(portion, points.size() - begin);
    strict_.forward(std::span(points).subspan(begin, count), std::span(moved.points).subspan(begin, count));
    retry(points, begin, begin + count, moved);
  }
  session.context().throwIfCancelled();
  session.context().progress("warping", 1);
  return moved;
}

// Few points come here: those on the surface by all but rounding, and those that are somewhere else.
void Route::retry(const std::vector<Vec3>& points, std::size_t begin, std::size_t end,
                  MovedPoints& moved) const {
  std::vector<std::size_t> open;
  std::vector<Vec3> from;
  for (std::size_t i = begin; i < end; ++i) {
    if (moved.points[i].allFinite()) continue;
    open.push_back(i);
    from.push_back(points[i]);
  }
  if (open.empty()) return;
  std::vector<Vec3> to(open.size());
  std::vector<double> distance(open.size());
  chain_.forward(from, to);
  if (source_.solid) {
    source_.solid->outsideSolid(from, distance);
  } else {
    SnappingMap::outsideBall(from, distance);
  }
  for (std::size_t k = 0; k < open.size(); ++k) {
    moved.points[open[k]] = to[k];
    if (to[k].allFinite()) {
      moved.snapped += distance[k] > 0;
      moved.farthestSnapped = std::max(moved.farthestSnapped, distance[k]);
    } else if (distance[k] <= reach_) {
      if (moved.unanswered++ == 0) moved.firstUnanswered = open[k];
    } else {
      if (moved.outside++ == 0) moved.firstOutside = open[k];
      moved.farthestOutside = std::max(moved.farthestOutside, distance[k]);
    }
  }
}

void Route::describe(Json& json) const {
  json["from"] = source_.kind;
  json["to"] = target_.kind;
  json["exact"] = choices_.exact;
  json["snap"] = {{"relative", choices_.snap}, {"length", reach_}};
}

Json describeMoved(const MovedPoints& moved, const std::vector<Vec3>& points) {
  Json json = {{"count", points.size()},
               {"snapped", moved.snapped},
               {"snapped_farthest", moved.farthestSnapped},
               {"outside", moved.outside},
               {"outside_farthest", moved.farthestOutside},
               {"outside_first", nullptr},
               {"unanswered", moved.unanswered},
               {"unanswered_first", nullptr}};
  const auto place = [&](std::size_t i) { return Json{{"id", i}, {"point", toJson(points[i])}}; };
  if (moved.outside > 0) json["outside_first"] = place(moved.firstOutside);
  if (moved.unanswered > 0) json["unanswered_first"] = place(moved.firstUnanswered);
  return json;
}

std::string missingPoints(const MovedPoints& moved, const std::vector<Vec3>& points, const Route& route,
                          const std::string& what) {
  const auto first = [&](std::size_t i) {
    return "the first is number " + std::to_string(i) + ", counted from 0, at " + shortPoint(points[i]);
  };
  const std::string share = " of " + grouped(points.size()) + " " + what;
  if (moved.outside == 0) {
    return grouped(moved.unanswered) + share + " lie inside " + route.sourceName() +
           ", but the map has no answer there; " + first(moved.firstUnanswered) +
           ". A map of a finer mesh may have one, or --exact";
  }
  return grouped(moved.outside) + share + " lie outside " + route.sourceName() + ", up to " +
         shortNumber(moved.farthestOutside) + " away; " + first(moved.firstOutside);
}

}  // namespace polestar::cli
