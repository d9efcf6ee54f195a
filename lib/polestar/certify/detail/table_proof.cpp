#include "polestar/certify/detail/table_proof.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "polestar/certify/detail/check_parts.h"
#include "polestar/core/covering_number.h"
#include "polestar/map/map_file.h"

namespace polestar::detail {
namespace {

// Of lengths near 1 that were computed in a few steps.
constexpr double kRadialRounding = 5e-13;

Check proof(const char* name, double value, double limit, std::string what) {
  return check(CheckRole::proof, name, value, limit, std::move(what));
}

Check none(const char* name, std::size_t bad, std::size_t all, const std::string& what) {
  return proof(name, static_cast<double>(bad), 0, counted(bad, all, what));
}

// How far level 0 of the table lies off the surface, in units of what moving and scaling may round.
double detachment(const GreenChart& chart) {
  const StarShape& shape = chart.green().shape();
  const TriMesh& mesh = shape.surface().mesh();
  const Foliation& f = chart.foliation();
  const Frame& frame = shape.frame();
  if (f.triangles != mesh.triangles || f.vertexCount != mesh.vertices.size()) return HUGE_VAL;
  double worst = 0;
  for (std::size_t i = 0; i < f.vertexCount; ++i) {
    const Vec3 inner = frame.toInner(mesh.vertices[i]);
    for (int k = 0; k < 3; ++k) {
      const double allowed =
          8 * std::numeric_limits<double>::epsilon() *
          ((std::abs(mesh.vertices[i][k]) + std::abs(frame.origin[k])) / frame.unit + std::abs(inner[k]));
      const double off = std::abs(inner[k] - f.node(0, i)[k]);
      if (off > 0) worst = std::max(worst, off / allowed);
    }
  }
  return worst;
}

// How far radii of images are off those of their levels; infinite when levels do not fall from 1 or follow
// one another within rounding. Nodes that were moved are of no level.
double radialDeviation(const BallMap& map) {
  const Foliation& f = map.chart().foliation();
  const std::span<const std::size_t> moved = map.chart().movedNodes();
  if (f.levels[0] != 1) return HUGE_VAL;
  double worst = std::abs(map.radius().value(1) - 1), above = HUGE_VAL;
  for (std::size_t level = 0; level < f.levels.size(); ++level) {
    const double radius = map.radius().value(f.levels[level]);
    if (!(radius > 0 && radius < above - kRadialRounding)) return HUGE_VAL;
    above = radius;
    for (std::size_t id = f.nodeId(level, 0); id < f.nodeId(level + 1, 0); ++id) {
      if (level > 0 && std::binary_search(moved.begin(), moved.end(), id)) continue;
      const double off = std::abs(map.nodeImages().ball[id].norm() - radius);
      if (!(off <= worst)) worst = off;
    }
  }
  return worst;
}

Check attached(const GreenChart& chart) {
  const double off = detachment(chart);
  return proof("boundary_attached", off, 1,
               off <= 1 ? "level 0 of the foliation is the surface, to rounding"
                        : "level 0 of the foliation leaves the surface by " + formatted("%.3g", off) +
                              " times what rounding can do");
}

Check degrees(const Foliation& f, std::span<const Vec3> surface, std::span<const Vec3> sphere) {
  const int around = coveringNumber(surface, f.triangles), onto = coveringNumber(sphere, f.triangles);
  return proof("sphere_degree", std::abs(around - 1) + std::abs(onto - 1), 0,
               "the surface covers the directions from the center " + std::to_string(around) +
                   " times, its image the sphere " + std::to_string(onto) + " times");
}

}  // namespace

std::vector<Check> proveTable(const BallMap& map) {
  const GreenChart& chart = map.chart();
  const Foliation& f = chart.foliation();
  const std::vector<Vec3>& images = map.nodeImages().ball;
  const auto surface = std::span(f.nodes).first(f.vertexCount),
             sphere = std::span(images).first(f.vertexCount);
  const std::size_t notFinite = countNotFinite(map), flips = map.levelFlips();
  const double center =
      std::max(f.nodes.back().lpNorm<Eigen::Infinity>(), images.back().lpNorm<Eigen::Infinity>());
  const double radial = radialDeviation(map);
  const CellCounts solid = countCells(f);
  return {proof("finite", static_cast<double>(notFinite), 0,
                std::to_string(notFinite) + " numbers of the map are NaN or infinite"),
          attached(chart),
          proof("center", center, 0,
                center == 0 ? "the center goes to the center" : "the last node is not the center"),
          none("surface_star", countFlips(surface, f.triangles), f.triangles.size(),
               "triangles of the surface turn away from the center"),
          none("sphere_flips", flips, f.triangles.size() * f.levels.size(),
               "triangles are flipped on the sphere, over all levels"),
          degrees(f, surface, sphere),
          proof("image_radii", radial, kRadialRounding,
                "radii of images are off those of their levels by " + formatted("%.2g", radial) + " at most"),
          none("foliation_cells", solid.bad(), solid.cells, "tetrahedra of the foliation inverted or flat"),
          none("image_cells", map.imageCells().bad(), map.imageCells().cells,
               "tetrahedra inverted or flat at their images in the ball")};
}

}  // namespace polestar::detail
