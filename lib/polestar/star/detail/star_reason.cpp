#include "polestar/star/detail/star_reason.h"

#include <algorithm>
#include <cstdio>
#include <map>
#include <numeric>

namespace polestar::detail {
namespace {

std::string number(double x) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", x);
  return text;
}

std::string point(const Vec3& p) {
  return "(" + number(p[0]) + ", " + number(p[1]) + ", " + number(p[2]) + ")";
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g %%", 100 * share);
  return text;
}

std::string list(const std::vector<std::int32_t>& faces) {
  std::string text;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == faces.size() ? " and " : ", ") + std::to_string(faces[i]);
  }
  return text;
}

std::string whereHidden(const StarReport& report, const ExactVerdict& verdict,
                        const std::optional<BadPatch>& patch) {
  std::string text = percent(report.badAreaFraction) + " of the surface (" +
                     std::to_string(verdict.badFaces.size()) +
                     (verdict.badFaces.size() == 1 ? " face" : " faces") + ")";
  if (patch) {
    text += ", the largest patch of " + std::to_string(patch->faces) + " around " + point(report.badPlace) +
            " (face " + std::to_string(patch->deepestFace) + ")";
  }
  return text;
}

std::string whyGivenCenterFails(const StarReport& report, const ExactVerdict& verdict,
                                const std::optional<BadPatch>& patch,
                                const std::optional<StarReport>& alternative) {
  std::string text = "the given center " + point(report.center) + " does not see " +
                     whereHidden(report, verdict, patch) + "; it lies " + number(-report.centerMargin) +
                     " behind the worst face's plane. ";
  if (alternative) {
    return text + "The center " + point(alternative->center) + " sees all of it, with a margin of " +
           number(alternative->centerMargin) + ".";
  }
  return text + "No other center sees all of it either: the body is not star-shaped (largest margin " +
         number(report.margin) + ").";
}

}  // namespace

BadPatch largestBadPatch(const TriMesh& mesh, const HalfSpaces& halfSpaces, const Vec3& center,
                         const std::vector<std::int32_t>& badFaces) {
  // Union-find over the bad faces, joined at vertices.
  std::vector<std::int32_t> parent(badFaces.size());
  std::iota(parent.begin(), parent.end(), 0);
  auto root = [&](std::int32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  std::map<std::int32_t, std::int32_t> firstAtVertex;
  for (std::size_t i = 0; i < badFaces.size(); ++i) {
    for (const std::int32_t v : mesh.triangles[badFaces[i]]) {
      const auto [entry, isNew] = firstAtVertex.try_emplace(v, static_cast<std::int32_t>(i));
      if (!isNew) parent[root(static_cast<std::int32_t>(i))] = root(entry->second);
    }
  }
  std::map<std::int32_t, BadPatch> patches;
  for (std::size_t i = 0; i < badFaces.size(); ++i) {
    const std::int32_t face = badFaces[i];
    BadPatch& patch = patches[root(static_cast<std::int32_t>(i))];
    const double depth = -halfSpaces[face].slack(center);
    if (patch.deepestFace < 0 || depth > patch.depth) {
      patch.deepestFace = face;
      patch.depth = depth;
    }
    ++patch.faces;
    patch.area += halfSpaces.area(face);
  }
  return std::max_element(patches.begin(), patches.end(),
                          [](const auto& a, const auto& b) { return a.second.area < b.second.area; })
      ->second;
}

std::string whyNotStar(const StarReport& report, const ExactVerdict& verdict,
                       const std::optional<BadPatch>& patch, bool centerWasGiven,
                       const std::optional<StarReport>& alternative) {
  if (verdict.badFaces.empty()) {
    return "not star-shaped: the surface winds " + std::to_string(verdict.windings) + " times around " +
           point(report.center) + " and passes through itself; remove the self-intersections";
  }
  if (report.margin > 0 && verdict.zeroAreaFaces > 0) {
    return "not star-shaped as it is: " + std::to_string(verdict.zeroAreaFaces) +
           " of the faces have no area, such as face " + std::to_string(patch->deepestFace) + " at " +
           point(report.badPlace) + "; flip or collapse them";
  }
  if (centerWasGiven) return whyGivenCenterFails(report, verdict, patch, alternative);
  if (report.margin > 0) {
    return "not star-shaped in double precision: the largest margin of a center, " + number(report.margin) +
           " at " + point(report.center) +
           ", is lost in the rounding of the coordinates; move faces such as " +
           std::to_string(patch->deepestFace) + " at " + point(report.badPlace) + " outward";
  }
  std::string text = "not star-shaped: no point sees the whole surface from inside. The best one found, " +
                     point(report.center) + ", misses " + whereHidden(report, verdict, patch) + ".";
  if (!report.witnessFaces.empty()) {
    text += " Faces " + list(report.witnessFaces) + " alone rule out every center.";
  } else {
    text += " The planes of the surface meet in a point or line without room around it.";
  }
  return text +
         " Smooth or fill what is hidden there (nostrils, ears, folds), or cut the body into star-shaped "
         "parts";
}

}  // namespace polestar::detail
