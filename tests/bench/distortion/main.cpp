// bench_distortion: what the choices of sphere map and radius do to cells, model by model. Prints the page
// docs/bench-distortion.md; what is measured is in measures.h.
//
//     bench_distortion [MODEL ...] > docs/bench-distortion.md      names of files in POLESTAR_MESHES

#include <chrono>
#include <cstdio>
#include <exception>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "measures.h"
#include "polestar/pipeline.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar::bench {
namespace {

constexpr std::size_t kPoints = 40000;
constexpr int kHexahedra = 16;

struct Choice {
  const char* name;
  SphereMapKind boundary;
  RadiusKind radius;
  double volumeWeight = 0.05;
};

constexpr Choice kChoices[] = {
    {"conformal, green", SphereMapKind::conformal, RadiusKind::green},
    {"conformal, mixed", SphereMapKind::conformal, RadiusKind::mixed},
    {"field-line, green", SphereMapKind::fieldLine, RadiusKind::green},
    {"field-line, mixed", SphereMapKind::fieldLine, RadiusKind::mixed},
    {"field-line, volume", SphereMapKind::fieldLine, RadiusKind::volume},
    {"field-line, balanced", SphereMapKind::fieldLine, RadiusKind::balanced},
    {"radial, green", SphereMapKind::radial, RadiusKind::green},
    {"radial, mixed", SphereMapKind::radial, RadiusKind::mixed},
    {"balanced 0", SphereMapKind::balanced, RadiusKind::balanced, 0.0},
    {"balanced 0.03", SphereMapKind::balanced, RadiusKind::balanced, 0.03},
    {"balanced 0.05", SphereMapKind::balanced, RadiusKind::balanced, 0.05},
    {"balanced 0.1", SphereMapKind::balanced, RadiusKind::balanced, 0.1},
};

struct Line {
  SolidDistortion solid;
  HexDistortion hex;
};

/// Sums of how often and by how much a choice was the best one.
struct Score {
  int bestMips = 0, bestVolume = 0, bestHex = 0;
  double mips = 0, volume = 0, hex = 0;
};

std::vector<Line> measureModel(const std::string& name, const std::filesystem::path& path) {
  const StarShape shape = testing::starShapeFromFile(path);
  const GreenFunction green = solveGreen(shape);
  const GreenChart chart = traceChart(green);
  std::printf("\n## %s\n\n", name.c_str());
  std::printf(
      "%zu vertices; %zu of %zu cells of the foliation inverted or flat, %zu flipped triangles of omega.\n\n",
      shape.mesh().vertices.size(), chart.report().cells.bad(), chart.report().cells.cells,
      chart.report().directionFlips);
  std::printf(
      "| boundary, radius | MIPS mean | MIPS p99 | log volume | folded | hex min | hex p1 | hex mean | bad "
      "hex "
      "| qc mean | core | s |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  std::vector<Line> lines;
  for (const Choice& choice : kChoices) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), choice.name);
    MapOptions options;
    options.boundary = choice.boundary;
    options.radius = choice.radius;
    options.balance.volumeWeight = choice.volumeWeight;
    const auto start = std::chrono::steady_clock::now();
    const BoundaryChoice boundary = chooseBoundary(chart, options);
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const BallMap map(chart, boundary.sphere, options.ball, boundary.radius);
    lines.push_back({measureSolid(map, shape, kPoints), measureHexahedra(map, kHexahedra)});
    const auto& [solid, hex] = lines.back();
    std::printf("| %s%s | %.4f | %.3f | %.3f | %zu | %.3f | %.3f | %.3f | %zu | %.3f | %s | %.2f |\n",
                choice.name,
                boundary.sphere.kind == choice.boundary
                    ? ""
                    : (std::string(" (fell back to ") + toString(boundary.sphere.kind) + ")").c_str(),
                solid.mipsMean, solid.mipsP99, solid.logVolumeDeviation, solid.folded, hex.min, hex.p1,
                hex.mean, hex.bad, boundary.sphere.qcMean,
                map.options().core == CoreMode::smooth ? "smooth" : "paper", seconds);
    std::fflush(stdout);
  }
  return lines;
}

void addScores(const std::vector<Line>& lines, std::vector<Score>& scores) {
  std::size_t mips = 0, volume = 0, hex = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].solid.mipsMean < lines[mips].solid.mipsMean) mips = i;
    if (lines[i].solid.logVolumeDeviation < lines[volume].solid.logVolumeDeviation) volume = i;
    if (lines[i].hex.p1 > lines[hex].hex.p1) hex = i;
    scores[i].mips += lines[i].solid.mipsMean;
    scores[i].volume += lines[i].solid.logVolumeDeviation;
    scores[i].hex += lines[i].hex.p1;
  }
  ++scores[mips].bestMips, ++scores[volume].bestVolume, ++scores[hex].bestHex;
}

int run(const std::vector<std::string>& wanted) {
  if (!testing::meshFolder()) {
    std::fprintf(stderr, "bench_distortion: POLESTAR_MESHES does not name a folder of meshes\n");
    return 1;
  }
  std::printf(
      "# Distortion: sphere maps and radii side by side\n\n"
      "This page is written by the program `bench_distortion` (target of the same name with\n"
      "`-DPOLESTAR_BUILD_BENCHMARKS=ON`); its tables were not typed. To make it anew:\n\n"
      "    POLESTAR_MESHES=FOLDER build/release/bench/bench_distortion MODEL ... > "
      "docs/bench-distortion.md\n\n"
      "- *MIPS*: |J|^2 / (3 det J^(2/3)) of the map from solid to ball, 1 for a similarity, at %zu points "
      "spread\n"
      "  evenly over the solid: mean and 99th percentile. *log volume*: standard deviation of ln det J "
      "there.\n"
      "- *hex*: scaled Jacobian of %d hexahedra that are even in the ball (cubed sphere, layers from 0.1 to "
      "1):\n"
      "  the worst, the 1st percentile and the mean. *bad*: not positive, or a corner without a preimage.\n"
      "- *balanced 0.05*: the weight of the volume term. *core*: smooth, or the paper's. *s*: seconds for "
      "sphere map\n"
      "  and radius, after the trace.\n",
      kPoints, 6 * kHexahedra * kHexahedra * kHexahedra);
  std::vector<Score> scores(std::size(kChoices));
  int models = 0;
  for (const std::string& name : wanted) {
    try {
      addScores(measureModel(name, *testing::meshFolder() / name), scores);
      ++models;
    } catch (const std::exception& error) {
      std::printf("\n%s: %s\n", name.c_str(), error.what());
    }
  }
  std::printf(
      "\n## All %d models\n\nHow often a choice is the best of the table, and its mean over the models.\n\n"
      "| boundary, radius | best MIPS | best volume | best hex p1 | MIPS mean | log volume | hex p1 |\n"
      "|---|---|---|---|---|---|---|\n",
      models);
  for (std::size_t i = 0; i < scores.size() && models > 0; ++i) {
    std::printf("| %s | %d | %d | %d | %.4f | %.3f | %.3f |\n", kChoices[i].name, scores[i].bestMips,
                scores[i].bestVolume, scores[i].bestHex, scores[i].mips / models, scores[i].volume / models,
                scores[i].hex / models);
  }
  return 0;
}

}  // namespace
}  // namespace polestar::bench

int main(int argc, char** argv) {
  std::vector<std::string> wanted(argv + 1, argv + argc);
  if (wanted.empty()) {
    wanted = {"castalia.obj",   "golevka.stl", "max_smooth100.off", "geographos.ply",
              "bumpy-cube.obj", "bennu.ply",   "phobos.off"};
  }
  return polestar::bench::run(wanted);
}
