#include "pages.h"

#include <algorithm>
#include <optional>

#include "choices.h"
#include "page.h"

namespace polestar::bench {
namespace {

using Pointer = Json::json_pointer;
using Cells = std::vector<std::string>;

constexpr const char* kRemake =
    R"(This page is written by the program `bench_maps`; no figure on it was typed. To make it anew:

    tests/bench/maps.sh                  # every star-shaped model of the mesh folder; --help for parts of it
    tests/bench/maps.sh --missing        # only what bench-maps.jsonl lacks or what failed: goes on after a stop

The figures are in `bench-maps.jsonl`, one row a line: `map`, `choices` and `comparison` of a model. The other page: )";

constexpr const char* kMapsRules =
    R"(Default options (`conformal`, s = R), grids of 128 voxels along the longest side, every model that is star-shaped;
beside its verdict those of the field-line and of the balanced map.

"bad" are tetrahedra of the foliation inverted or flat, at the nodes and at their images in the ball (exact): none at both is the theorem of
verify.md. "moved" are nodes off their field lines, by how much in the ball. "deep" are cells between voxels, inverted and more than a voxel below
the surface. A map with any of either is `failed`, and `polestar map` refuses it. Seconds are those of solving, tracing, the sphere map, sampling
and judging, without reading and writing; memory is the peak of the process.

)";

constexpr const char* kComparisonRules = R"(## Other methods, on one mesh

TetGen fills each model with tetrahedra about as large as its triangles; every method moves the same vertices, and is measured as the map
that is linear in between, ours too. Wins and losses are both here.

- ours: *conformal, green* is the paper's choice, *field-line* and *balanced* are ours; vertices by `forward`.
- *radial cone*: x over the distance of the surface in its direction.
- *harmonic map*: three harmonic functions by cotangents, our conformal map on the surface. [Wang et al. 2004]
- *Galaxy Maps*: the authors' program [Hinderink, Campen 2023], given the harmonic map to repair; it adds tetrahedra. Named by
  `POLESTAR_GALAXY_MAPS`, the executable `galaxy_map` or its folder.
- *inverted*: turned over or flat after rounding the images to float (exact). Those with four vertices on the surface are apart: the map of the
  surface alone decides their sign.
- *MIPS*: |J|^2 / (3 det J^(2/3)), 1 for a similarity; mean and 99th percentile, by volume in the solid and by volume in the ball, inverted
  ones left out. *log volume*: standard deviation of ln det J by volume in the solid.
- *hex*: scaled Jacobian of 24,576 hexahedra that are even in the ball (cubed sphere, layers from 0.1 to 1): the worst, the 1st percentile, the
  mean. *bad*: not positive, or a corner without a preimage.
- *skew*: degrees between images of radii and normals of images of spheres, 0 where they are orthogonal; mean and 99th percentile over the
  solid outside the largest of the cores.
- *s*: seconds from the surface to the images of the vertices: ours with Green's function and its field lines, others with our conformal
  map; TetGen not counted, files of programs are.

)";

constexpr const char* kChoicesRules = R"(## Boundary and radius

The maps themselves, not their values on tetrahedra: MIPS, ln det J and skew at 40,000 points spread evenly over the solid. *balanced 0.05*: the
weight of even volumes, `--balance-volume`. The best of a row is bold. A choice that fell back to another boundary is marked by a star.

)";

std::string line(const Cells& cells) {
  std::string result = "|";
  for (const std::string& cell : cells) result += " " + cell + " |";
  return result + "\n";
}

std::string header(const Cells& cells) {
  std::string rule = "|";
  for (std::size_t i = 0; i < cells.size(); ++i) rule += "---|";
  return line(cells) + rule + "\n";
}

std::optional<double> number(const Json& row, const char* path) {
  const Pointer pointer(path);
  if (!row.contains(pointer) || !row.at(pointer).is_number()) return std::nullopt;
  return row.at(pointer).get<double>();
}

std::string cell(const Json& row, const char* path, const char* format = "%.0f") {
  const std::optional<double> value = number(row, path);
  return value ? text(format, *value) : "-";
}

std::string word(const Json& row, const char* key) { return row.at(key).get<std::string>(); }

bool succeeded(const Json& row) { return row.at("status") == "ok"; }

std::vector<Json> rowsOf(const std::vector<Json>& results, const char* part) {
  std::vector<Json> rows;
  std::copy_if(results.begin(), results.end(), std::back_inserter(rows),
               [&](const Json& row) { return row.at("part") == part; });
  return rows;
}

/// Models without figures, and why.
std::string notMeasured(const std::vector<Json>& rows) {
  std::string list;
  for (const Json& row : rows) {
    if (!succeeded(row)) list += "- " + word(row, "model") + ": " + word(row, "status") + "\n";
  }
  return list.empty() ? "" : list + "\n";
}

double totalSeconds(const Json& map) {
  double sum = 0;
  for (const auto& [stage, seconds] : map.at("seconds").items()) sum += seconds.get<double>();
  return sum;
}

std::string mapsTable(const std::vector<Json>& maps) {
  Cells titles{"model", "V", "verdict"};
  for (const Choice& choice : choices().subspan(1)) {
    if (choice.compared) titles.emplace_back(choice.name);
  }
  for (const char* title :
       {"boundary error", "unresolved %", "charge + 1", "bad in solid", "bad in ball",
        "lines retraced, added, replaced, bent", "nodes moved", "by (ball)", "deep", "inverted", "collapsed",
        "voxels filtered", "cells", "round trip (voxels)", "qc", "green, trace (s)", "seconds", "MB"})
    titles.emplace_back(title);
  std::string table = header(titles);
  for (const Json& m : maps) {
    if (!succeeded(m)) continue;
    Cells cells{word(m, "model"), cell(m, "/vertices"), word(m, "verdict")};
    for (const Json& other : m.at("others")) cells.push_back(word(other, "verdict"));
    const Cells rest{cell(m, "/boundary_error", "%.1e"),
                     text("%.2g", 100 * *number(m, "/unresolved_area")),
                     text("%.0e", *number(m, "/charge") + 1),
                     cell(m, "/chart/bad"),
                     cell(m, "/image_cells_bad"),
                     cell(m, "/chart/retraced") + ", " + cell(m, "/chart/added") + ", " +
                         cell(m, "/chart/replaced") + ", " + cell(m, "/chart/rays"),
                     cell(m, "/nodes_moved"),
                     cell(m, "/chart/largest_move_ball", "%.1e"),
                     cell(m, "/voxel_cells/inverted_deep"),
                     cell(m, "/voxel_cells/inverted"),
                     cell(m, "/voxel_cells/collapsed"),
                     cell(m, "/voxel_cells/filtered_voxels"),
                     cell(m, "/voxel_cells/cells"),
                     cell(m, "/round_trip/voxels", "%.2f") + " (" + cell(m, "/round_trip/lost") + " lost)",
                     cell(m, "/qc_mean", "%.3f"),
                     cell(m, "/seconds/green", "%.1f") + ", " + cell(m, "/seconds/trace", "%.1f"),
                     text("%.1f", totalSeconds(m)),
                     text("%.0f", *number(m, "/peak_bytes") * 1e-6)};
    cells.insert(cells.end(), rest.begin(), rest.end());
    table += line(cells);
  }
  return table + "\n";
}

std::string refusals(const std::vector<Json>& maps) {
  std::string list;
  const auto add = [&](const Json& map, const std::string& of, const Json& judged) {
    if (judged.at("verdict") == "failed")
      list += "- " + word(map, "model") + of + ": " + word(judged, "failure") + "\n";
  };
  for (const Json& m : maps) {
    if (!succeeded(m)) continue;
    add(m, "", m);
    for (const Json& other : m.at("others")) add(m, " (" + word(other, "choice") + ")", other);
  }
  return list.empty() ? "" : "Refused, and why:\n\n" + list + "\n";
}

std::string comparisonTable(const std::vector<Json>& comparisons) {
  std::string table =
      header({"model", "method", "tetrahedra", "inverted", "on the surface", "MIPS solid", "p99", "MIPS ball",
              "p99", "log volume", "hex min", "p1", "mean", "bad", "skew", "p99", "s"});
  for (const Json& row : comparisons) {
    if (!succeeded(row)) continue;
    for (const Json& m : row.at("methods")) {
      Cells cells{word(row, "model"), word(m, "method")};
      if (!succeeded(m)) {
        cells.push_back(word(m, "status"));
        cells.resize(17);
      } else {
        for (const char* count : {"/tetrahedra", "/inverted", "/inverted_on_surface"})
          cells.push_back(cell(m, count));
        for (const char* mips : {"/mips_by_solid/mean", "/mips_by_solid/p99", "/mips_by_ball/mean",
                                 "/mips_by_ball/p99", "/log_volume", "/hex/min", "/hex/p1", "/hex/mean"})
          cells.push_back(cell(m, mips, "%.3f"));
        cells.push_back(cell(m, "/hex/bad"));
        for (const char* rest : {"/skew/mean", "/skew/p99", "/seconds"})
          cells.push_back(cell(m, rest, "%.1f"));
      }
      table += line(cells);
    }
  }
  return table + "\n";
}

constexpr Measure kMeasures[] = {{"inverted", "/inverted"},
                                 {"MIPS solid", "/mips_by_solid/mean"},
                                 {"MIPS solid p99", "/mips_by_solid/p99"},
                                 {"MIPS ball", "/mips_by_ball/mean"},
                                 {"log volume", "/log_volume"},
                                 {"hex min", "/hex/min", true},
                                 {"hex p1", "/hex/p1", true},
                                 {"hex mean", "/hex/mean", true},
                                 {"skew", "/skew/mean"},
                                 {"seconds", "/seconds"}};

const Json* methodOf(const Json& comparison, const std::string& name) {
  for (const Json& m : comparison.at("methods")) {
    if (m.at("method") == name && succeeded(m)) return &m;
  }
  return nullptr;
}

std::string scoreTable(const std::vector<Json>& comparisons) {
  Cells titles{"ours", "against"};
  for (const Measure& measure : kMeasures) titles.emplace_back(measure.title);
  std::string table = "### Wins : losses of ours, by model\n\n" + header(titles);
  for (const Choice& choice : choices()) {
    if (!choice.compared) continue;
    for (const char* other : {kRadialCone, kHarmonicMap, kGalaxyMaps}) {
      Cells cells{choice.name, other};
      for (const Measure& measure : kMeasures) {
        const Score score = scoreOf(comparisons, choice.name, other, measure);
        cells.push_back(std::to_string(score.wins) + " : " + std::to_string(score.losses) +
                        (score.ties > 0 ? " (" + std::to_string(score.ties) + " even)" : ""));
      }
      table += line(cells);
    }
  }
  return table + "\n";
}

/// A measure of all choices on all models.
struct ChoiceTable {
  const char* title;
  const char* path;
  const char* format;
  bool largerIsBetter = false;
};
constexpr ChoiceTable kChoiceTables[] = {
    {"MIPS, mean over the solid", "/mips/mean", "%.3f"},
    {"MIPS, 99th percentile", "/mips/p99", "%.2f"},
    {"log volume", "/log_volume", "%.2f"},
    {"Hexahedra, 1st percentile of the scaled Jacobian", "/hex/p1", "%.3f", true},
    {"Hexahedra that are bad, of 24,576", "/hex/bad", "%.0f"},
    {"Skew, mean in degrees", "/skew/mean", "%.1f"},
    {"Inverted tetrahedra of the foliation's image (exact)", "/image_cells_bad", "%.0f"},
    {"Round trip through floats, worst of 10,000 points, in diagonals", "/round_trip/diagonals", "%.0e"},
    {"Seconds after the trace", "/seconds", "%.2f"}};

Cells choiceNames(const char* first) {
  Cells names{first};
  for (const Choice& choice : choices()) names.emplace_back(choice.name);
  return names;
}

/// Of a row's values; nothing where all are the same.
std::optional<double> bestOf(const Json& row, const ChoiceTable& of) {
  std::vector<double> values;
  for (const Json& choice : row.at("choices")) {
    if (const auto value = number(choice, of.path)) values.push_back(*value);
  }
  if (values.empty()) return std::nullopt;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  if (*least == *most) return std::nullopt;
  return of.largerIsBetter ? *most : *least;
}

bool fellBack(const Json& choice) {
  for (const Choice& known : choices()) {
    if (choice.at("choice") == known.name) return choice.at("boundary") != polestar::toString(known.boundary);
  }
  return false;
}

std::string choiceTable(const std::vector<Json>& rows, const ChoiceTable& of) {
  std::string table = "### " + std::string(of.title) + "\n\n" + header(choiceNames("model"));
  for (const Json& row : rows) {
    if (!succeeded(row)) continue;
    Cells cells{word(row, "model")};
    const std::optional<double> best = bestOf(row, of);
    for (const Json& choice : row.at("choices")) {
      std::string value = cell(choice, of.path, of.format);
      if (best && number(choice, of.path) == best) value = "**" + value + "**";
      cells.push_back(value + (fellBack(choice) ? "\\*" : ""));
    }
    table += line(cells);
  }
  return table + "\n";
}

std::string meansTable(const std::vector<Json>& rows) {
  std::string table = "### Means over the models\n\n" + header(choiceNames("measure"));
  for (const ChoiceTable& of : kChoiceTables) {
    Cells cells{of.title};
    for (std::size_t c = 0; c < choices().size(); ++c) {
      double sum = 0;
      int count = 0;
      for (const Json& row : rows) {
        if (!succeeded(row)) continue;
        if (const auto value = number(row.at("choices").at(c), of.path)) sum += *value, ++count;
      }
      cells.push_back(count > 0 ? text(of.format, sum / count) : "-");
    }
    table += line(cells);
  }
  return table + "\n";
}

}  // namespace

Score scoreOf(const std::vector<Json>& comparisons, const std::string& ours, const std::string& other,
              const Measure& measure) {
  Score score;
  for (const Json& comparison : comparisons) {
    if (!succeeded(comparison)) continue;
    const Json *a = methodOf(comparison, ours), *b = methodOf(comparison, other);
    if (!a || !b) continue;
    const auto mine = number(*a, measure.path), theirs = number(*b, measure.path);
    if (!mine || !theirs) continue;
    ++(*mine == *theirs                              ? score.ties
       : (*mine > *theirs) == measure.largerIsBetter ? score.wins
                                                     : score.losses);
  }
  return score;
}

void writePages(const std::filesystem::path& folder, const std::vector<Json>& results) {
  const std::vector<Json> maps = rowsOf(results, "map"), chosen = rowsOf(results, "choices"),
                          comparisons = rowsOf(results, "comparison");
  writeText(folder / "bench-maps.md", "# Maps of all models\n\n" + std::string(kRemake) +
                                          "bench-distortion.md.\n\n" + machineText(maps) + kMapsRules +
                                          mapsTable(maps) + refusals(maps) + notMeasured(maps));
  std::string page = "# Distortion: other methods, boundaries and radii side by side\n\n" +
                     std::string(kRemake) +
                     "bench-maps.md. What follows for defaults: method.md, \"Distortion\".\n\n" +
                     machineText(chosen) + kComparisonRules + comparisonTable(comparisons) +
                     notMeasured(comparisons) + scoreTable(comparisons) + kChoicesRules;
  for (const ChoiceTable& of : kChoiceTables) page += choiceTable(chosen, of);
  writeText(folder / "bench-distortion.md", page + meansTable(chosen) + notMeasured(chosen));
}

std::string summaryLine(const Json& row) {
  std::string line = word(row, "model") + ", " + word(row, "part") + ": ";
  if (!succeeded(row)) return line + word(row, "status");
  if (row.contains("verdict")) return line + word(row, "verdict") + ", " + text("%.1f s", totalSeconds(row));
  const bool comparison = row.contains("methods");
  for (const Json& entry : row.at(comparison ? "methods" : "choices")) {
    line += word(entry, comparison ? "method" : "choice") + " " +
            cell(entry, comparison ? "/mips_by_solid/mean" : "/mips/mean", "%.3f") + "; ";
  }
  return line + "mean MIPS";
}

}  // namespace polestar::bench
