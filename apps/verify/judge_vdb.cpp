#include "judge_vdb.h"

#include <algorithm>
#include <cmath>

#include "coverage.h"
#include "field_checks.h"
#include "voxel_cells.h"

namespace polestar::verify {
namespace {

std::string percent(double share) { return shortNumber(100 * share) + " %"; }

std::string voxelText(const VoxelSolid& solid, std::array<int, 3> place) {
  for (std::size_t k = 0; k < 3; ++k) place[k] += solid.corner[k];
  return "voxel (" + std::to_string(place[0]) + ", " + std::to_string(place[1]) + ", " +
         std::to_string(place[2]) + ")";
}

std::string placeText(const Vec3& p) {
  return "(" + shortNumber(p.x) + ", " + shortNumber(p.y) + ", " + shortNumber(p.z) + ")";
}

/// Whether the values are worth looking at.
bool judgeValues(const VoxelSolid& solid, Report& report) {
  report.atMost("transform", solid.transformFault.empty() ? 0 : 1, 0, true,
                solid.transformFault.empty() ? "all grids share one transform" : solid.transformFault);
  const std::size_t undefined = solid.undefinedRest + solid.undefinedGreen;
  report.atMost("defined", static_cast<double>(undefined), 0, true,
                undefined == 0 ? "every voxel inside has values"
                               : std::to_string(solid.undefinedRest) + " voxels inside have no rest, " +
                                     std::to_string(solid.undefinedGreen) + " no green");
  std::size_t notFinite = solid.notFiniteSurface, first = solid.count();
  for (std::size_t v = 0; v < solid.count(); ++v) {
    // Distances are finite in the file, but not in voxels that floats take for 0.
    if (isFinite(toDouble(solid.rest[v])) && std::isfinite(solid.green[v]) && std::isfinite(solid.surface[v]))
      continue;
    ++notFinite;
    first = std::min(first, v);
  }
  const bool metadata =
      isFinite(solid.center) &&
      (!solid.hasGreen ||
       (solid.harmonicRadius > 0 && solid.greenCap > 0 && std::isfinite(solid.harmonicRadius) &&
        std::isfinite(solid.greenCap) && solid.coreRadius >= 0 && solid.coreRadius < 1));
  report.atMost(
      "finite", static_cast<double>(notFinite) + (metadata ? 0 : 1), 0, true,
      notFinite > 0
          ? std::to_string(notFinite) + " values are not finite" +
                (first < solid.count() ? ", first at " + voxelText(solid, solid.placeOf(first)) : "")
      : metadata       ? "all values are finite"
      : solid.hasGreen ? "metadata center, harmonic_radius, green_cap or core_radius are impossible"
                       : "metadata center is impossible");
  return undefined == 0 && notFinite == 0 && metadata;
}

/// Of how far out in the domain a place is.
std::string gaugeName(const VoxelSolid& solid) {
  return solid.domain.isBall() ? "|rest|" : "rest, as a share of the way out of the domain,";
}

bool judgeRange(const VoxelSolid& solid, Report& report) {
  double longest = 0;
  std::size_t at = 0, badGreen = 0;
  for (std::size_t v = 0; v < solid.count(); ++v) {
    const double radius = solid.domain.gauge(toDouble(solid.rest[v]));
    if (radius > longest) longest = radius, at = v;
    badGreen += solid.green[v] < 0 || solid.green[v] > solid.greenCap * (1 + 1e-5);
  }
  report.atMost("range", longest, 1 + 1e-6, true,
                gaugeName(solid) + " is at most 1 " + std::string(longest >= 1 ? "+ " : "- ") +
                    shortNumber(std::abs(longest - 1)) +
                    (longest > 1 + 1e-6 ? ", at " + voxelText(solid, solid.placeOf(at)) : ""));
  if (solid.hasGreen) {
    report.atMost("green_range", static_cast<double>(badGreen), 0, true,
                  std::to_string(badGreen) + " values of green are negative or above the cap");
  }
  return longest < 2;
}

void judgePole(const VoxelSolid& solid, Report& report) {
  const PoleFit pole = fitPole(solid);
  if (!pole.inside) {
    report.atMost("pole", HUGE_VAL, 0.5, false, "the center is not inside the solid");
    return;
  }
  report.atMost("pole", pole.restOffset, 0.5, false,
                "rest vanishes " + shortNumber(pole.restOffset) + " voxels from the center");
  if (!solid.hasGreen) return;
  report.near(
      "harmonic_radius", pole.ratio, 1, 0.03, false,
      "the harmonic radius by G around the center is " + shortNumber(pole.ratio) + " times the file's");
}

void judgeBoundary(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth, Report& report) {
  const BoundaryFit boundary = fitBoundary(solid, depth);
  report.atMost("surface", static_cast<double>(boundary.tooDeep), 0, false,
                std::to_string(boundary.tooDeep) + " of " + std::to_string(boundary.rim) +
                    " voxels beside the outside lie more than a voxel's diagonal below the surface");
  report.near(
      "boundary", boundary.median, 1, 0.05, false,
      gaugeName(solid) + " continued to the surface is " + shortNumber(boundary.median) + " in the median");
  // Towards a convex edge of a polycube what is left of the way out falls as the root of the depth, and a
  // straight line from a voxel's depth on ends too early.
  report.atLeast("boundary_everywhere", boundary.low, solid.domain.isBall() ? 0.85 : 0.7, false,
                 gaugeName(solid) + " continued to the surface is above " + shortNumber(boundary.low) +
                     " at 99 % of it");
}

void judgeHarmonicity(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth, Report& report) {
  const HarmonicFit harmonic = fitHarmonic(solid, depth);
  report.atMost("harmonic", harmonic.median, 2e-4, false,
                "rho (G - 1/r) is off its mean around by " + shortNumber(harmonic.median) +
                    " in the median of " + std::to_string(harmonic.places) + " places");
  report.atMost("harmonic_nearly_everywhere", harmonic.most, 2e-3, false,
                "by more than " + shortNumber(harmonic.most) + " at 2 % of them");
}

void judgeRadius(const VoxelSolid& solid, Report& report) {
  const RadiusFit radius = fitRadius(solid);
  report.atMost("radius", radius.worst, 1e-3, false,
                (solid.radiusIsOfGreen ? "|rest| is off 1/(1 + rho G) by " : "|rest| falls as G falls, by ") +
                    shortNumber(radius.worst) + " at most, at " + voxelText(solid, solid.placeOf(radius.at)));
}

void judgeLines(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth, Report& report) {
  const LineFit lines = fitLines(solid, depth);
  report.atMost("field_lines", lines.median, 4, false,
                "iso-curves of rest leave the direction of grad G by " + shortNumber(lines.median) +
                    " degrees in the median of " + std::to_string(lines.places) +
                    " places, straight rays by " + shortNumber(lines.straight));
  // Of a body that is nearly a ball about its center, and of a few hundred voxels, the two cannot be told
  // apart.
  const bool canTell = lines.bentStraight >= 1.5 && lines.places >= 200;
  report.atMost("no_straight_rays", canTell ? lines.bentMedian / lines.bentStraight : 0, 0.6, false,
                "where straight rays leave the direction of grad G most, by " +
                    shortNumber(lines.bentStraight) + " degrees, iso-curves leave it by " +
                    shortNumber(lines.bentMedian) +
                    (canTell ? "" : "; too little, or at too few places, to tell"));
}

void judgeField(const VoxelSolid& solid, const std::vector<std::uint16_t>& depth, Report& report) {
  // rest in a polycube follows the polycube's Green's function, too.
  if (solid.domain.isBall()) judgeRadius(solid, report);
  judgeHarmonicity(solid, depth, report);
  if (solid.domain.isBall()) judgeLines(solid, depth, report);
}

void judgeDegree(const VoxelSolid& solid, const Coverage& cover, const CellSums& cells, Report& report) {
  const double whole = solid.domain.volume();
  const double share = static_cast<double>(cover.touched) / static_cast<double>(cover.targets);
  const double degree = share > 0 ? cells.volume / (whole * share) : 0;
  report.near("degree", degree, 1, 0.05, false,
              "the Jacobian's integral is " + shortNumber(cells.volume / whole) +
                  " of the domain, cells cover " + shortNumber(share) + " of it: degree " +
                  shortNumber(degree));
  report.facts.emplace_back("domain_covered", share);
}

void judgeCover(const Coverage& cover, Report& report) {
  const double judged = static_cast<double>(std::max<std::size_t>(cover.judged, 1));
  const double uncovered = static_cast<double>(cover.uncovered) / judged,
               repeated = static_cast<double>(cover.repeated) / judged, share = uncovered + repeated;
  report.atMost("coverage", cover.judged > 0 ? share : 1, 2e-3, false,
                percent(uncovered) + " of the domain below the boundary layer is not covered, " +
                    percent(repeated) + " not once; " + percent(judged / static_cast<double>(cover.targets)) +
                    " of the domain is judged" +
                    (share > 0 ? ", worst around " + placeText(cover.example) : ""));
}

void judgeOrientation(const VoxelSolid& solid, const CellSums& cells, Report& report) {
  report.atMost("cells", static_cast<double>(cells.invertedDeep), 0, false,
                std::to_string(cells.invertedDeep) + " of " + std::to_string(cells.deep) +
                    " cells deeper than one voxel are inverted" +
                    (cells.invertedDeep > 0 ? ", the deepest at " + voxelText(solid, cells.deepest) : ""));
  const std::size_t shallow = cells.cells - cells.deep, inverted = cells.inverted - cells.invertedDeep;
  const double share = static_cast<double>(inverted) / static_cast<double>(std::max<std::size_t>(shallow, 1));
  report.atMost("shallow_cells", share, 0.02, false,
                std::to_string(inverted) + " of " + std::to_string(shallow) +
                    " cells within one voxel of the surface are inverted");
  report.facts.emplace_back("cells", cells.cells);
  report.facts.emplace_back("inverted", cells.inverted);
  report.facts.emplace_back("inverted_deep", cells.invertedDeep);
  report.facts.emplace_back("collapsed", cells.collapsed);
}

}  // namespace

Report judgeVdb(const VoxelSolid& solid) {
  Report report;
  report.kind = "vdb";
  report.facts.emplace_back("voxels", solid.count());
  const std::string defect = solid.domain.defect();
  report.atMost("domain", defect.empty() ? 0 : 1, 0, true,
                !defect.empty()         ? "the domain is not star-shaped: " + defect
                : solid.domain.isBall() ? "the domain is the ball"
                                        : "the domain has " + std::to_string(solid.domain.cellCount()) +
                                              " cells, star-shaped about the middle of one");
  if (solid.hasGreen) {
    report.facts.emplace_back("harmonic_radius_voxels", solid.harmonicRadius);
  } else {
    report.notJudged =
        "green, which a frame of a morph does not have: harmonic_radius, radius, harmonic, field_lines";
  }
  if (!solid.domain.isBall()) {
    report.notJudged =
        "whether rest follows the polycube's own Green's function, which is not in the file: radius, "
        "field_lines";
  }
  if (!defect.empty() || !judgeValues(solid, report) || !judgeRange(solid, report)) return report;
  const std::vector<std::uint16_t> depth = depths(solid);
  const CellSums cells = judgeCells(solid);
  judgePole(solid, report);
  judgeBoundary(solid, depth, report);
  if (solid.hasGreen) judgeField(solid, depth, report);
  const Coverage cover = measureCoverage(solid, depth);
  judgeDegree(solid, cover, cells, report);
  judgeOrientation(solid, cells, report);
  judgeCover(cover, report);
  return report;
}

}  // namespace polestar::verify
