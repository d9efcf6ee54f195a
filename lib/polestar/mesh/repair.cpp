#include "polestar/mesh/repair.h"

#include <algorithm>
#include <utility>

#include "polestar/core/detail/edge_table.h"
#include "polestar/core/error.h"
#include "polestar/mesh/detail/duplicates.h"
#include "polestar/mesh/detail/orient.h"
#include "polestar/mesh/detail/weld.h"
#include "polestar/mesh/detail/zero_area.h"

namespace polestar {
namespace {

void requireSound(const TriMesh& mesh) {
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    if (mesh.vertices[v].allFinite()) continue;
    throw Error(Errc::usage, "vertex " + std::to_string(v) +
                                 " has a NaN or infinite coordinate; repairMesh needs finite ones");
  }
  const auto count = static_cast<std::int32_t>(mesh.vertices.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::int32_t v : mesh.triangles[t]) {
      if (v >= 0 && v < count) continue;
      throw Error(Errc::usage, "triangle " + std::to_string(t) + " names vertex " + std::to_string(v) +
                                   " of " + std::to_string(count) + "; repairMesh needs indices in range");
    }
  }
}

bool repeatsVertex(const Triangle& t) { return t[0] == t[1] || t[1] == t[2] || t[2] == t[0]; }

class Repair {
 public:
  Repair(const TriMesh& mesh, const RepairOptions& options) : mesh_(mesh), options_(options) {
    report_.verticesBefore = mesh.vertices.size();
    report_.trianglesBefore = mesh.triangles.size();
  }

  RepairedMesh run() {
    weld();
    report_.degenerateTriangles = std::erase_if(mesh_.triangles, repeatsVertex);
    dropDuplicates();
    report_.zeroAreaTriangles = detail::mendZeroArea(mesh_);
    dropUnused();
    if (options_.orient) orient();
    report_.verticesAfter = mesh_.vertices.size();
    report_.trianglesAfter = mesh_.triangles.size();
    report_.unusedVertices = report_.verticesBefore - report_.weldedVertices - report_.verticesAfter;
    return {std::move(mesh_), report_};
  }

 private:
  void weld() {
    std::vector<char> used(mesh_.vertices.size(), 0);
    for (const Triangle& t : mesh_.triangles) {
      for (const std::int32_t v : t) used[v] = 1;
    }
    std::vector<std::int32_t> target = detail::weldEqual(mesh_.vertices);
    renumber(target);
    if (options_.weldTolerance > 0) {
      const std::vector<std::int32_t> seams = verticesOnOpenEdges();
      const std::vector<std::int32_t> first =
          detail::weldNear(mesh_.vertices, seams, options_.weldTolerance * diagonalOfUsed());
      std::vector<std::int32_t> second(mesh_.vertices.size());
      for (std::size_t v = 0; v < second.size(); ++v) second[v] = static_cast<std::int32_t>(v);
      for (std::size_t i = 0; i < seams.size(); ++i) second[seams[i]] = first[i];
      renumber(second);
      for (std::int32_t& v : target) v = second[v];
    }
    for (std::size_t v = 0; v < target.size(); ++v) {
      if (used[v] && target[v] != static_cast<std::int32_t>(v)) ++report_.weldedVertices;
    }
  }

  void renumber(const std::vector<std::int32_t>& target) {
    for (Triangle& t : mesh_.triangles) t = {target[t[0]], target[t[1]], target[t[2]]};
  }

  /// The seams that a tolerance may close, ascending. Elsewhere the surface hangs together, and merging could
  /// only break thin walls and fine detail.
  std::vector<std::int32_t> verticesOnOpenEdges() const {
    std::vector<Triangle> sound = mesh_.triangles;
    std::erase_if(sound, repeatsVertex);
    const detail::EdgeTable edges(sound, mesh_.vertices.size());
    std::vector<std::int32_t> seams;
    for (std::size_t e = 0; e < edges.size(); ++e) {
      if (edges.sides(e).size() == 1) seams.insert(seams.end(), edges.ends(e).begin(), edges.ends(e).end());
    }
    std::sort(seams.begin(), seams.end());
    seams.erase(std::unique(seams.begin(), seams.end()), seams.end());
    return seams;
  }

  double diagonalOfUsed() const {
    Box box;
    for (const Triangle& t : mesh_.triangles) {
      for (const std::int32_t v : t) {
        box.min = box.min.cwiseMin(mesh_.vertices[v]);
        box.max = box.max.cwiseMax(mesh_.vertices[v]);
      }
    }
    return mesh_.triangles.empty() ? 0 : box.diagonal();
  }

  void dropDuplicates() {
    const std::vector<std::int32_t> again = detail::duplicateTriangles(mesh_);
    if (again.empty()) return;
    report_.duplicateTriangles = again.size();
    for (const std::int32_t t : again) mesh_.triangles[t][0] = -1;
    std::erase_if(mesh_.triangles, [](const Triangle& t) { return t[0] < 0; });
  }

  void dropUnused() {
    std::vector<std::int32_t> number(mesh_.vertices.size(), -1);
    for (const Triangle& t : mesh_.triangles) {
      for (const std::int32_t v : t) number[v] = 0;
    }
    std::int32_t kept = 0;
    for (std::size_t v = 0; v < number.size(); ++v) {
      if (number[v] < 0) continue;
      mesh_.vertices[kept] = mesh_.vertices[v];
      number[v] = kept++;
    }
    mesh_.vertices.resize(kept);
    renumber(number);
  }

  void orient() {
    std::vector<char> turn = detail::turnsForAgreement(mesh_);
    const auto apply = [&](auto&& which) {
      for (std::size_t t = 0; t < turn.size(); ++t) {
        if (which(t)) std::swap(mesh_.triangles[t][1], mesh_.triangles[t][2]);
      }
    };
    apply([&](std::size_t t) { return turn[t] != 0; });
    // The sign of the whole, never of each part: a cavity's own volume is negative, and rightly so.
    if (volumeProperties(mesh_).volume < 0) {
      apply([](std::size_t) { return true; });
      for (char& t : turn) t ^= 1;
    }
    report_.flippedTriangles = static_cast<std::size_t>(std::count(turn.begin(), turn.end(), 1));
    if (!turn.empty() && report_.flippedTriangles == turn.size()) {
      report_.turnedInsideOut = true;
      report_.flippedTriangles = 0;
    }
  }

  TriMesh mesh_;
  RepairOptions options_;
  RepairReport report_;
};

}  // namespace

void RepairOptions::validate() const {
  if (!(weldTolerance >= 0 && weldTolerance <= 0.01)) {
    throw Error(Errc::usage, "the weld tolerance must lie in 0 to 0.01 (share of the box's diagonal), not " +
                                 std::to_string(weldTolerance));
  }
}

bool RepairReport::changedAnything() const {
  return weldedVertices + unusedVertices + degenerateTriangles + zeroAreaTriangles + duplicateTriangles +
                 flippedTriangles >
             0 ||
         turnedInsideOut;
}

std::string RepairReport::summary() const {
  std::string text;
  const auto say = [&](std::size_t n, const std::string& verb, const std::string& what,
                       const std::string& plural) {
    if (n > 0)
      text += (text.empty() ? "" : "; ") + verb + " " + std::to_string(n) + " " + (n == 1 ? what : plural);
  };
  say(weldedVertices, "merged", "vertex", "vertices");
  say(unusedVertices, "dropped", "unused vertex", "unused vertices");
  if (!text.empty())
    text += " (" + std::to_string(verticesBefore) + " to " + std::to_string(verticesAfter) + ")";
  say(degenerateTriangles, "dropped", "triangle that repeats a vertex", "triangles that repeat a vertex");
  say(duplicateTriangles, "dropped", "duplicate triangle", "duplicate triangles");
  say(zeroAreaTriangles, "mended", "triangle without area", "triangles without area");
  say(flippedTriangles, "turned", "triangle", "triangles");
  if (turnedInsideOut)
    text += std::string(text.empty() ? "" : "; ") + "turned the whole surface, which faced inward";
  return text.empty() ? "nothing to repair" : text;
}

RepairedMesh repairMesh(const TriMesh& mesh, const RepairOptions& options) {
  options.validate();
  requireSound(mesh);
  return Repair(mesh, options).run();
}

}  // namespace polestar
