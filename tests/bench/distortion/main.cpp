// bench_distortion: what the choices of sphere map and radius do to cells, model by model. Prints the page
// docs/bench-distortion.md; what is measured is in measures.h.
//
//     bench_distortion [MODEL ...] > docs/bench-distortion.md      names of files in POLESTAR_MESHES

#include <chrono>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include "harmonic.h"
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
  double volumeWeight = 0.03;
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

/// Of one choice over all models.
struct Score {
  int bestMips = 0, bestVolume = 0, bestHex = 0;
  int mipsBeatsHarmonic = 0, hexBeatsHarmonic = 0;
  double mips = 0, volume = 0, hex = 0;
};

struct ModelLines {
  std::vector<Line> choices;
  std::optional<Line> harmonic;
};

void printLine(const std::string& name, const Line& line, const std::string& rest) {
  const auto& [solid, hex] = line;
  std::printf("| %s | %.4f | %.3f | %.3f | %zu | %.3f | %.3f | %.3f | %zu | %s |\n", name.c_str(),
              solid.mipsMean, solid.mipsP99, solid.logVolumeDeviation, solid.folded, hex.min, hex.p1,
              hex.mean, hex.bad, rest.c_str());
  std::fflush(stdout);
}

std::string formatted(const char* format, double a, const char* b, double c) {
  char text[96];
  std::snprintf(text, sizeof text, format, a, b, c);
  return text;
}

Line measureChoice(const GreenChart& chart, const Choice& choice) {
  MapOptions options;
  options.boundary = choice.boundary;
  options.radius = choice.radius;
  options.balance.volumeWeight = choice.volumeWeight;
  const auto start = std::chrono::steady_clock::now();
  const BoundaryChoice boundary = chooseBoundary(chart, options);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const BallMap map(chart, boundary.sphere, options.ball, boundary.radius);
  const Line line{measureSolid(map, chart.green().shape(), kPoints), measureHexahedra(map, kHexahedra)};
  std::string name = choice.name;
  if (boundary.sphere.kind != choice.boundary)
    name += std::string(" (fell back to ") + toString(boundary.sphere.kind) + ")";
  printLine(name, line,
            formatted("%.3f | %s | %.2f", boundary.sphere.qcMean,
                      map.options().core == CoreMode::smooth ? "smooth" : "paper", seconds));
  return line;
}

std::optional<Line> measureHarmonic(const StarShape& shape) {
  const SphereMap boundary = conformalSphereMap(shape);
  const auto start = std::chrono::steady_clock::now();
  const std::optional<HarmonicMap> map = HarmonicMap::make(shape, boundary);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (!map) {
    std::printf("\nNo harmonic map: `tetgen` is not installed.\n");
    return std::nullopt;
  }
  const Line line{measureSolid(*map, shape, kPoints), measureHexahedra(*map, kHexahedra)};
  printLine("harmonic map (" + std::to_string(map->inverted()) + " of " + std::to_string(map->tetrahedra()) +
                " tetrahedra inverted)",
            line, formatted("%.3f | %s | %.2f", boundary.qcMean, "", seconds));
  return line;
}

ModelLines measureModel(const std::string& name, const std::filesystem::path& path) {
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
  ModelLines lines;
  for (const Choice& choice : kChoices) {
    std::fprintf(stderr, "%s: %s\n", name.c_str(), choice.name);
    lines.choices.push_back(measureChoice(chart, choice));
  }
  lines.harmonic = measureHarmonic(shape);
  return lines;
}

void addScores(const ModelLines& model, std::vector<Score>& scores) {
  const std::vector<Line>& lines = model.choices;
  std::size_t mips = 0, volume = 0, hex = 0;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (lines[i].solid.mipsMean < lines[mips].solid.mipsMean) mips = i;
    if (lines[i].solid.logVolumeDeviation < lines[volume].solid.logVolumeDeviation) volume = i;
    if (lines[i].hex.p1 > lines[hex].hex.p1) hex = i;
    scores[i].mips += lines[i].solid.mipsMean;
    scores[i].volume += lines[i].solid.logVolumeDeviation;
    scores[i].hex += lines[i].hex.p1;
    if (!model.harmonic) continue;
    scores[i].mipsBeatsHarmonic += lines[i].solid.mipsMean < model.harmonic->solid.mipsMean;
    scores[i].hexBeatsHarmonic += lines[i].hex.p1 > model.harmonic->hex.p1;
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
      "- *harmonic map*: three harmonic functions on TetGen's tetrahedra with the conformal map on the "
      "surface, linear\n"
      "  in each; the tetrahedra are about as large as the surface's triangles.\n"
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
      "\n## All %d models\n\nHow often a choice is the best of them and better than the harmonic map, and "
      "its mean\n"
      "over the models.\n\n"
      "| boundary, radius | best MIPS | best volume | best hex p1 | MIPS below harmonic | hex p1 above "
      "harmonic "
      "| MIPS mean | log volume | hex p1 |\n|---|---|---|---|---|---|---|---|---|\n",
      models);
  for (std::size_t i = 0; i < scores.size() && models > 0; ++i) {
    const Score& score = scores[i];
    std::printf("| %s | %d | %d | %d | %d | %d | %.4f | %.3f | %.3f |\n", kChoices[i].name, score.bestMips,
                score.bestVolume, score.bestHex, score.mipsBeatsHarmonic, score.hexBeatsHarmonic,
                score.mips / models, score.volume / models, score.hex / models);
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
