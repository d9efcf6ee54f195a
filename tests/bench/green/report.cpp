#include "report.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "exact_solid.h"
#include "log_log_plot.h"
#include "page.h"
#include "plan.h"
#include "tables.h"
#include "targets.h"

namespace polestar::bench {
namespace {

constexpr const char* kIntroduction = R"(# Green's function: time, memory and error, side by side

This page is written by the program `bench_green`; no figure on it was typed. To make it anew:

    tests/bench/green.sh                 # everything; see --help for parts of it
    tests/bench/green.sh --quick         # about a minute

The figures are in `bench-green.jsonl`, one row a line. A run replaces the rows that it measures and keeps the others.

)";

constexpr const char* kRules = R"(## What is compared

The problem: G = 1/|x - c| + h inside a solid, G = 0 on its surface. The solids have exact answers: the unit ball with
its pole at (0.3, 0.2, -0.1), the upper half of the unit ball with its pole at (0.1, 0, 0.4), the cube [-1, 1]^3 with its
pole at (0.2, 0.1, -0.15).

| method | what it is |
|---|---|
| polestar, single layer | `solveGreen` with its default options, as the library offers it |
| MFS of the paper | `GreenSolver::mfs`: method of fundamental solutions as in Xia et al. 2010, dense, least squares by SVD |
| MFS at its best | `MfsMode::smooth`: takes the vertices for samples of a smooth surface; offsets bounded by the local reach and chosen, as the cutoff, at vertices held out |
| OpenVDB Poisson | `tools::poisson::solveWithBoundaryConditions` on the voxels whose centers lie inside, h = -1/\|x - c\| at the voxels outside next to them |
| OpenVDB Poisson, cut cells | the same solver on the same voxels; the boundary value stands where the stencil's arm crosses the surface (Gibou et al. 2002), which makes it second order |
| cotangent Laplacian, TetGen | linear finite elements on tetrahedra that TetGen makes of the same triangles, `-pYq1.414a...`, volumes as large as the triangles ask for |

Rules of fairness:

- All solve for the regular part h, never for the singular G; 1/|x - c| is added exactly.
- Everyone's error is max and root mean square of rho |G - G_exact| at the same 2,000 points: 1,500 spread evenly over the volume,
  500 in the last 4 % of the way from the pole to the surface, none in the last 0.4 %.
- G_exact belongs to the smooth solid. OpenVDB is given that solid itself: inside or outside, and where arms cross its surface. Our
  solver and TetGen are given triangles inscribed in it, and pay for the difference, which only the cube does not have; MFS sees
  their vertices alone, which lie on it. The cube's answer is a lattice of images, cut where its rest is about 1e-7.
- The boundary error, max rho |G| over the triangles as given, is the true error of solvers that are given triangles: by the maximum
  principle it bounds theirs everywhere inside. In brackets the same at 18,000 random places that the solver has not sampled.
- OpenVDB: double precision, incomplete Cholesky factors (its Jacobi preconditioner is slower or stops with an error), residuals at which
  a tighter one no longer changes the error: 1e-5, with cut cells 1e-7. Between voxels its h is taken from a fit of harmonic
  polynomials to voxels and boundary values, so that interpolation adds no visible error. That evaluation is not timed.
- Cotangent Laplacian: conjugate gradients scaled by the diagonal to 1e-6, on all cores. Volumes at the size of the surface's triangles gave the
  smallest error for a given time; coarser insides gave larger ones.
- Set-up is what a method needs before it solves and is told apart: for us closedness and star-shape by exact predicates; for OpenVDB
  finding the voxels inside; for the Laplacian TetGen with its files. Plots show set-up and solution together.
- Every row runs alone in a process of its own; memory is the peak of resident memory from the finished mesh to the solution, libraries
  included. CPU time is that of all threads and of TetGen.
- n is the number of surface vertices; for voxels, of voxels with a neighbour outside. Unknowns are what the method solves for.

)";

constexpr const char* kModelRules = R"(## Our solver alone

Default options unless a tolerance is given. `head` is volumes/head.ply, each triangle cut into equal ones, so the creases stay; `asteroid` is the
formula of volumes/asteroid.ply at that many vertices, finer detail included.

)";

std::string targetsText(const std::vector<Json>& results) {
  std::string table = "## Goals\n\n| goal | measured | |\n|---|---|---|\n";
  for (const Target& target : judgeTargets(results)) {
    table += "| " + target.goal + " | " + (target.measured.empty() ? "not measured" : target.measured) +
             " | " + (target.met ? *target.met ? "met" : "**missed**" : "") + " |\n";
  }
  return table +
         "\nWhy goals are missed, where the time goes and what was tried: method.md, \"What a solve "
         "costs\".\n\n";
}

using Coordinate = std::function<double(const Json&)>;

double peak(const Json& r) { return r.at("peak_bytes").get<double>() * 1e-6; }
double surface(const Json& r) { return r.at("surface").get<double>(); }

PlotSeries seriesOf(const std::vector<Json>& results, const std::string& name, int look, const Coordinate& x,
                    const Coordinate& y, const std::function<bool(const Row&)>& belongs) {
  PlotSeries series{name, look, {}};
  for (const Json& r : results) {
    if (succeeded(r) && belongs(rowOf(r))) series.points.push_back({x(r), y(r)});
  }
  std::sort(series.points.begin(), series.points.end(), [](auto& a, auto& b) { return a.x < b.x; });
  return series;
}

LogLogPlot exactPlot(const std::vector<Json>& results, const std::string& xLabel, const Coordinate& x,
                     const std::string& yLabel, const Coordinate& y, std::vector<int> guides) {
  LogLogPlot plot{xLabel, yLabel, std::move(guides), {}};
  for (const ExactSolid& solid : exactSolids()) {
    PlotPanel panel{solid.name, {}};
    for (std::size_t m = 0; m < methods().size(); ++m) {
      PlotSeries series =
          seriesOf(results, methods()[m].title, static_cast<int>(m), x, y, [&](const Row& row) {
            return row.shape == solid.name && row.method == methods()[m].id && row.tolerance == 0;
          });
      if (!series.points.empty()) panel.series.push_back(std::move(series));
    }
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

LogLogPlot scalingPlot(const std::vector<Json>& results) {
  LogLogPlot plot{"n, surface vertices", "time, s", {1, 2}, {{"our solver, default options", {}}}};
  for (std::size_t i = 0; i <= scalingShapes().size(); ++i) {
    const bool files = i == scalingShapes().size();
    const std::string name = files ? "models of others" : scalingShapes()[i];
    PlotSeries series =
        seriesOf(results, name, static_cast<int>(i), surface, wallSeconds, [&](const Row& row) {
          return row.tolerance == 0 && (files ? row.size == 0 : row.shape == scalingShapes()[i]);
        });
    series.joined = !files;
    if (!series.points.empty()) plot.panels[0].series.push_back(std::move(series));
  }
  return plot;
}

/// The picture's link for the page; nothing when there is nothing to draw.
std::string writePlot(const std::filesystem::path& folder, const std::string& what, const LogLogPlot& plot) {
  const std::string svg = drawSvg(plot);
  if (svg.empty()) return {};
  const std::string file = "bench-green-" + what + ".svg";
  writeText(folder / file, svg);
  return "![" + plot.yLabel + " over " + plot.xLabel + "](" + file + ")\n\n";
}

}  // namespace

void writeReport(const std::filesystem::path& folder, const std::vector<Json>& results) {
  auto error = [](const Json& r) { return r.at("error_max").get<double>(); };
  const std::string n = "n, surface vertices (voxels)", seconds = "time, s";
  std::string page = kIntroduction + machineText(results) + targetsText(results) + kRules;
  page += writePlot(folder, "time", exactPlot(results, n, surface, seconds, wallSeconds, {1, 2, 3}));
  page += writePlot(folder, "memory", exactPlot(results, n, surface, "peak memory, MB", peak, {1, 2}));
  page += writePlot(folder, "error",
                    exactPlot(results, seconds, wallSeconds, "largest rho |G - G_exact|", error, {}));
  for (const ExactSolid& solid : exactSolids())
    page += "### The " + solid.name + "\n\n" + exactTable(results, solid.name) + "\n";

  page += kModelRules + writePlot(folder, "scaling", scalingPlot(results));
  page += modelTable(results, [](const Row& row) { return row.size != 0 && !isExactShape(row.shape); });
  page += "\n### Star-shaped models of others\n\n" +
          modelTable(results, [](const Row& row) { return row.size == 0; });
  writeText(folder / "bench-green.md", page);
}

}  // namespace polestar::bench
