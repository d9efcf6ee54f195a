#include "morph_page.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "page.h"

namespace polestar::bench {
namespace {

constexpr const char* kRemake = R"(# Morphing: polestar beside others

This page is written by the program `bench_morph`; no figure on it was typed. To make it anew (ten minutes and more):

    tests/bench/morph.sh                 # all pairs; --help for parts of it
    tests/bench/morph.sh --missing       # only what bench-morph.jsonl lacks or what failed

The figures are in `bench-morph.jsonl`, one method of one pair a line. Pairs of real bodies want `POLESTAR_MESHES`.

)";

constexpr const char* kRules =
    R"(Both solids have their centers at the origin, a voxel is the longer side of their boxes over the number of voxels. Seconds are processor time of all threads,
a frame; other programs used the machine at the same time, so ratios say more than seconds.

- *straight*, *radial*: `polestar morph --path`. Each frame is mended, proved and judged, its grids are `surface`, `density`, `rest` and `vel`; nothing is
  written. *surface alone*: nodes, mending and proof, without grids. The turned copy is brought into line as by `--align`.
- *vertices, conformal*: linear interpolation of the vertices of the same triangles, from the place where the one map has them to the place where the
  other has them. It has our correspondence, and neither an inside nor a turn that is taken apart:
  of a copy turned by an angle a the cross section at half is cos(a/2)^2 of what it should be.
- *vertices, radial*: the same triangles, but vertices belong together that lie in one direction from the centers. [Kent, Carlson, Parent 1992]
- *LevelSetMorphing*: OpenVDB's, narrow bands of 3 voxels, its default schemes (HJWENO5, TVD-RK2). It knows no end: frames are even shares of the time
  after which its surface is a tenth of a voxel from the target's (root mean square), or comes no nearer.
- *blended distances*: (1 - t) times the one signed distance and t times the other, both in bands as wide as the solids, made a distance again.

*volume*: over the geometric blend of the ends' volumes, V_0^(1-t) V_1^t; the first two lines have what an even blend of volumes, and of lengths (the
cube of the blended cube roots), comes to. *crossings*: pairs of triangles that run through each other, in the worst frame. *hidden*: triangles that
face away from the center, in the worst frame; no fault by itself. *parts* and *handles* of the surface, in the worst frame: 1 and 0 are right. *off*: of the
last frame's vertices from the last solid's surface, root mean square, in voxels. *inside*: frames whose inside is proved to be one to one, and
whose grids are, too: no cell between voxels that is deeper than one is inverted; others are refused by `polestar morph`. *same point*: does a point
of the one solid have a place in the next frame?

)";

double blendOf(const Json& row, double t, double power) {
  const double a = row.at("volumes_of_ends").at(0), b = row.at("volumes_of_ends").at(1);
  if (power == 0) return std::pow(a, 1 - t) * std::pow(b, t);
  return std::pow((1 - t) * std::pow(a, power) + t * std::pow(b, power), 1 / power);
}

/// The largest value of a member among the frames; nothing where they have none.
std::string worst(const Json& row, const char* key) {
  long largest = -1;
  for (const Json& frame : row.at("frames")) largest = std::max(largest, frame.value(key, -1L));
  return largest < 0 ? "-" : std::to_string(largest);
}

const Json& frameNear(const Json& row, double t) {
  const Json& frames = row.at("frames");
  return *std::min_element(frames.begin(), frames.end(), [t](const Json& a, const Json& b) {
    return std::abs(a.at("t").get<double>() - t) < std::abs(b.at("t").get<double>() - t);
  });
}

constexpr std::array kTimes{0.0, 0.25, 0.5, 0.75, 1.0};

std::string line(const std::vector<std::string>& cells) {
  std::string result = "|";
  for (const std::string& cell : cells) result += " " + cell + " |";
  return result + "\n";
}

std::string blendLine(const Json& row, const char* name, double power) {
  std::vector<std::string> cells{name};
  for (const double t : kTimes) cells.push_back(text("%.3f", blendOf(row, t, power) / blendOf(row, t, 0)));
  cells.insert(cells.end(), 8, "");
  return line(cells);
}

bool isOurs(const Json& row) { return row.at("method") == "straight" || row.at("method") == "radial"; }

std::string samePoint(const Json& row) {
  if (isOurs(row)) return "all";
  return row.at("method").get<std::string>().starts_with("vertices") ? "on the surface" : "no";
}

std::string methodLine(const Json& row, const Json* straight) {
  const auto method = row.at("method").get<std::string>();
  if (row.at("status") != "ok") return line({method, row.at("status").get<std::string>()});
  std::vector<std::string> cells{method};
  for (const double t : kTimes) cells.push_back(text("%.3f", relativeVolume(row, frameNear(row, t))));
  for (const char* key : {"crossings", "hidden", "parts", "handles"}) cells.push_back(worst(row, key));
  cells.push_back(text("%.2f", row.at("off_last_voxels").get<double>()));
  long holds = 0;
  for (const Json& frame : row.at("frames")) holds += frame.value("holds", false);
  cells.push_back(isOurs(row) ? std::to_string(holds) + " of " + std::to_string(row.at("frames").size())
                              : "-");
  cells.push_back(samePoint(row));
  const double seconds = row.at("seconds");
  std::string time = text(seconds < 0.1 ? "%.1g" : "%.2f", seconds);
  if (row.contains("seconds_surface"))
    time += text(" (surface alone %.2f)", row.at("seconds_surface").get<double>());
  if (straight && straight != &row) time += text(", x %.2g", seconds / straight->at("seconds").get<double>());
  cells.push_back(time);
  return line(cells);
}

std::string mendingText(const Json& row) {
  long refused = 0, byVoxels = 0, nodes = 0, inverted = 0, filtered = 0;
  for (const Json& frame : row.at("frames")) {
    const bool holds = frame.at("holds");
    refused += !holds;
    byVoxels += !holds && frame.at("inverted") == 0 && frame.at("crossings") == 0;
    nodes = std::max(nodes, frame.at("mended").get<long>());
    inverted = std::max(inverted, frame.at("inverted_before").get<long>());
    filtered = std::max(filtered, frame.at("filtered").get<long>());
  }
  return text(
      "- *%s*: in a frame at most %ld of %ld tetrahedra inverted before mending, %ld nodes moved, %ld voxels "
      "filtered. Refused: %ld frames, %ld of them for cells between voxels alone.\n",
      row.at("method").get<std::string>().c_str(), inverted, row.at("cells").get<long>(), nodes, filtered,
      refused, byVoxels);
}

std::string pairText(const std::string& pair, const std::vector<const Json*>& rows) {
  std::string page = "## " + pair + "\n\n";
  const auto good = [](const Json* row) { return row->at("status") == "ok"; };
  const auto first = std::find_if(rows.begin(), rows.end(), good);
  if (first == rows.end()) return page + rows.front()->at("status").get<std::string>() + "\n\n";
  const auto straight = std::find_if(rows.begin(), rows.end(), [&](const Json* row) {
    return good(row) && row->at("method") == "straight";
  });
  const Json& any = **first;
  page += text("%ld frames at %ld voxels; %ld triangles.", any.at("frame_count").get<long>(),
               any.at("dim").get<long>(), any.at("triangles").get<long>());
  if (straight != rows.end())
    page += text(" Maps and complex, once: %.1f s.", (*straight)->at("seconds_before").get<double>());
  page +=
      "\n\n| | volume at 0 | 1/4 | 1/2 | 3/4 | 1 | crossings | hidden | parts | handles | off | inside | "
      "same point | "
      "seconds a frame, x straight |\n|" +
      [] {
        std::string rule;
        for (int i = 0; i < 14; ++i) rule += "---|";
        return rule;
      }() +
      "\n";
  page += blendLine(any, "even volumes", 1) + blendLine(any, "even lengths", 1.0 / 3);
  for (const Json* row : rows) page += methodLine(*row, straight == rows.end() ? nullptr : *straight);
  page += "\n";
  for (const Json* row : rows) {
    if (good(row) && isOurs(*row)) page += mendingText(*row);
  }
  return page + "\n";
}

}  // namespace

double relativeVolume(const Json& row, const Json& frame) {
  return frame.at("volume").get<double>() / blendOf(row, frame.at("t").get<double>(), 0);
}

std::string summaryLine(const Json& row) {
  std::string name = row.at("pair").get<std::string>() + ": " + row.at("method").get<std::string>();
  if (row.at("status") != "ok") return name + ", " + row.at("status").get<std::string>();
  return name + text(": volume at half %.3f, %.3g s a frame", relativeVolume(row, frameNear(row, 0.5)),
                     row.at("seconds").get<double>());
}

void writeMorphPage(const std::filesystem::path& folder, const std::vector<Json>& results) {
  std::string page = kRemake + machineText(results) + kRules;
  std::vector<std::string> told;
  for (const Json& row : results) {
    const auto pair = row.at("pair").get<std::string>();
    if (std::find(told.begin(), told.end(), pair) != told.end()) continue;
    told.push_back(pair);
    std::vector<const Json*> rows;
    for (const Json& other : results) {
      if (other.at("pair") == pair) rows.push_back(&other);
    }
    page += pairText(pair, rows);
  }
  page.pop_back();
  writeText(folder / "bench-morph.md", page);
}

}  // namespace polestar::bench
