#include "polestar/mesh/closed_surface.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "polestar/core/detail/edge_table.h"
#include "polestar/core/error.h"
#include "polestar/mesh/detail/boundary_loops.h"

namespace polestar {
namespace {

constexpr std::size_t kMaxListed = SurfaceReport::kMaxListed;

template <class T>
void list(std::vector<T>& some, const T& item) {
  if (some.size() < kMaxListed) some.push_back(item);
}

/// A part of the surface that hangs together by edges.
struct Component {
  std::int32_t firstTriangle;
  std::size_t triangles;
};

class Inspection {
 public:
  explicit Inspection(const TriMesh& mesh) : mesh_(mesh) {}

  SurfaceReport run() {
    report_.vertices = mesh_.vertices.size();
    report_.triangles = mesh_.triangles.size();
    countMalformed();
    if (report_.malformedCount == 0 && report_.triangles > 0) {
      const detail::EdgeTable edges(mesh_.triangles, mesh_.vertices.size());
      countUnusedAndZeroArea();
      countEdges(edges);
      countFans(edges);
      findComponents(edges);
      findHoles(edges);
      report_.volume = volumeProperties(mesh_).volume;
      findGenus();
    }
    describe();
    report_.valid = report_.defect.empty();
    return std::move(report_);
  }

 private:
  void countMalformed() {
    for (std::size_t v = 0; v < mesh_.vertices.size(); ++v) {
      if (mesh_.vertices[v].allFinite()) continue;
      if (report_.malformedCount++ == 0) firstMalformed_ = "vertex " + std::to_string(v) + " is not finite";
    }
    const auto count = static_cast<std::int64_t>(mesh_.vertices.size());
    for (std::size_t i = 0; i < mesh_.triangles.size(); ++i) {
      const Triangle& t = mesh_.triangles[i];
      const bool inRange =
          *std::min_element(t.begin(), t.end()) >= 0 && *std::max_element(t.begin(), t.end()) < count;
      if (inRange && t[0] != t[1] && t[1] != t[2] && t[2] != t[0]) continue;
      if (report_.malformedCount++ == 0) {
        firstMalformed_ = "triangle " + std::to_string(i) + " names vertices " + std::to_string(t[0]) + ", " +
                          std::to_string(t[1]) + ", " + std::to_string(t[2]) + " of " + std::to_string(count);
      }
    }
  }

  void countUnusedAndZeroArea() {
    std::vector<char> used(mesh_.vertices.size(), 0);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      for (const std::int32_t v : mesh_.triangles[t]) used[v] = 1;
      if (!areaVector(mesh_, t).isZero(0)) continue;
      ++report_.zeroAreaTriangleCount;
      list(report_.zeroAreaTriangles, static_cast<std::int32_t>(t));
    }
    report_.unusedVertexCount = static_cast<std::size_t>(std::count(used.begin(), used.end(), 0));
    report_.vertices -= report_.unusedVertexCount;
  }

  void countEdges(const detail::EdgeTable& edges) {
    report_.edges = edges.size();
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto sides = edges.sides(e);
      if (sides.size() == 1) {
        ++report_.boundaryEdges;
      } else if (sides.size() > 2) {
        ++report_.nonManifoldEdgeCount;
        list(report_.nonManifoldEdges, edges.ends(e));
      } else if (edges.forward(sides[0]) == edges.forward(sides[1])) {
        ++report_.misorientedEdgeCount;
        list(report_.misorientedEdges, edges.ends(e));
      }
    }
    report_.euler = static_cast<int>(static_cast<std::int64_t>(report_.vertices) -
                                     static_cast<std::int64_t>(report_.edges) +
                                     static_cast<std::int64_t>(report_.triangles));
  }

  /// The corner of side `side`'s triangle at vertex v, one of the side's ends.
  std::int32_t cornerAt(std::int32_t side, std::int32_t v) const {
    const std::int32_t t = side / 3, k = side % 3;
    return 3 * t + (mesh_.triangles[t][k] == v ? k : (k + 1) % 3);
  }

  /// Corners around a vertex hang together by the edges that leave it; a second group is a second fan.
  void countFans(const detail::EdgeTable& edges) {
    detail::DisjointSets fans(3 * mesh_.triangles.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto sides = edges.sides(e);
      for (std::size_t i = 1; i < sides.size(); ++i) {
        for (const std::int32_t v : edges.ends(e)) fans.unite(cornerAt(sides[0], v), cornerAt(sides[i], v));
      }
    }
    std::vector<std::int32_t> count(mesh_.vertices.size(), 0);
    for (std::int32_t c = 0; c < static_cast<std::int32_t>(3 * mesh_.triangles.size()); ++c) {
      if (fans.find(c) == c) ++count[mesh_.triangles[c / 3][c % 3]];
    }
    for (std::size_t v = 0; v < count.size(); ++v) {
      if (count[v] < 2) continue;
      ++report_.nonManifoldVertexCount;
      list(report_.nonManifoldVertices, static_cast<std::int32_t>(v));
    }
  }

  void findComponents(const detail::EdgeTable& edges) {
    detail::DisjointSets parts(mesh_.triangles.size());
    for (std::size_t e = 0; e < edges.size(); ++e) {
      const auto sides = edges.sides(e);
      for (std::size_t i = 1; i < sides.size(); ++i) parts.unite(sides[0] / 3, sides[i] / 3);
    }
    std::vector<std::int32_t> component(mesh_.triangles.size());
    for (std::int32_t t = 0; t < static_cast<std::int32_t>(mesh_.triangles.size()); ++t) {
      const std::int32_t root = parts.find(t);
      if (root == t) {
        component[t] = static_cast<std::int32_t>(components_.size());
        components_.push_back({t, 0});
      }
      ++components_[component[root]].triangles;
    }
    report_.components = static_cast<int>(components_.size());
  }

  void findHoles(const detail::EdgeTable& edges) {
    if (report_.boundaryEdges == 0) return;
    std::vector<Hole> holes = detail::boundaryLoops(mesh_, edges);
    report_.holeCount = holes.size();
    std::stable_sort(holes.begin(), holes.end(),
                     [](const Hole& a, const Hole& b) { return a.length > b.length; });
    holes.resize(std::min(holes.size(), kMaxListed));
    report_.holes = std::move(holes);
  }

  void findGenus() {
    const bool manifold = report_.boundaryEdges + report_.nonManifoldEdgeCount +
                              report_.nonManifoldVertexCount + report_.misorientedEdgeCount ==
                          0;
    if (manifold && report_.components == 1) report_.genus = (2 - report_.euler) / 2;
  }

  // The words.

  /// "3 edges", "1 edge".
  static std::string counted(std::size_t n, const std::string& one, const std::string& many) {
    return std::to_string(n) + " " + (n == 1 ? one : many);
  }
  static std::string at(const Vec3& x) {
    char text[96];
    std::snprintf(text, sizeof text, "(%.9g, %.9g, %.9g)", x[0], x[1], x[2]);
    return text;
  }
  std::string atVertex(std::int32_t v) const { return std::to_string(v) + " at " + at(mesh_.vertices[v]); }
  std::string edgeNames(const std::vector<std::array<std::int32_t, 2>>& edges) const {
    constexpr std::size_t kNamed = 3;
    std::string text = "vertices ";
    for (std::size_t i = 0; i < std::min(edges.size(), kNamed); ++i) {
      text += (i ? ", " : "") + std::to_string(edges[i][0]) + "-" + std::to_string(edges[i][1]);
    }
    return text + (edges.size() > kNamed ? ", ..." : "") + "; the first near " +
           at(0.5 * (mesh_.vertices[edges[0][0]] + mesh_.vertices[edges[0][1]]));
  }

  struct Defect {
    std::string what, where, remedy;
  };

  /// All defects, first the one to mend first: each may be the cause of those behind it.
  std::vector<Defect> defects() const {
    std::vector<Defect> found;
    const auto add = [&](bool there, auto&& make) {
      if (there) found.push_back(make());
    };
    add(report_.malformedCount > 0, [&] { return malformed(); });
    add(report_.malformedCount == 0 && report_.triangles == 0, [] {
      return Defect{"there are no triangles", "", ""};
    });
    add(report_.zeroAreaTriangleCount > 0, [&] { return zeroArea(); });
    add(report_.nonManifoldEdgeCount > 0, [&] { return nonManifoldEdges(); });
    add(report_.boundaryEdges > 0, [&] { return openEdges(); });
    add(report_.misorientedEdgeCount > 0, [&] { return misoriented(); });
    add(report_.nonManifoldVertexCount > 0, [&] { return nonManifoldVertices(); });
    add(report_.components > 1, [&] { return severalBodies(); });
    add(report_.genus > 0, [&] { return handles(); });
    add(report_.genus >= 0 && report_.volume <= smallestVolume(), [&] { return noInside(); });
    add(report_.unusedVertexCount > 0, [&] {
      return Defect{
          counted(report_.unusedVertexCount, "vertex belongs", "vertices belong") + " to no triangle", "",
          "repairMesh drops them"};
    });
    return found;
  }

  void describe() {
    const std::vector<Defect> found = defects();
    if (found.empty()) return;
    report_.defect = found[0].what;
    if (!found[0].where.empty()) report_.defect += ": " + found[0].where;
    if (!found[0].remedy.empty()) report_.defect += "; " + found[0].remedy;
    // Of the others the second one with its place: what is open is mostly also something else.
    for (std::size_t i = 1; i < found.size(); ++i) {
      report_.defect += (i == 1 ? "; besides: " : ", ") + found[i].what;
      if (i == 1 && !found[i].where.empty()) report_.defect += " (" + found[i].where + ")";
    }
  }

  double smallestVolume() const {
    const double diagonal = boundingBox(mesh_).diagonal();
    return 1e-15 * diagonal * diagonal * diagonal;
  }

  Defect malformed() const {
    return {
        counted(report_.malformedCount, "vertex or triangle is", "vertices or triangles are") + " malformed",
        firstMalformed_,
        "repairMesh drops triangles that repeat a vertex; mend the rest where the mesh was made"};
  }
  Defect zeroArea() const {
    const std::int32_t first = report_.zeroAreaTriangles[0];
    return {counted(report_.zeroAreaTriangleCount, "triangle has", "triangles have") + " no area",
            "triangle " + std::to_string(first) + " at vertex " + atVertex(mesh_.triangles[first][0]),
            "collapse their short edges, or flip their long ones, in a modelling tool"};
  }
  Defect nonManifoldEdges() const {
    return {
        counted(report_.nonManifoldEdgeCount, "edge belongs", "edges belong") + " to three or more triangles",
        edgeNames(report_.nonManifoldEdges), "delete the inner or extra sheets of triangles that meet there"};
  }
  Defect openEdges() const {
    const Hole& hole = report_.holes[0];
    std::string loop = report_.holeCount > 1 ? "the longest" : "it";
    loop += " has " + counted(hole.vertices.size(), "vertex", "vertices") + " (";
    for (std::size_t i = 0; i < std::min(hole.vertices.size(), kMaxListed); ++i) {
      loop += (i ? " " : "") + std::to_string(hole.vertices[i]);
    }
    loop += std::string(hole.vertices.size() > kMaxListed ? " ..." : "") + ") around " + at(hole.center);
    return {"the surface is open, " + counted(report_.holeCount, "hole", "holes") + " with " +
                counted(report_.boundaryEdges, "boundary edge", "boundary edges"),
            loop, "fill the holes in a modelling tool"};
  }
  Defect misoriented() const {
    return {counted(report_.misorientedEdgeCount, "edge has", "edges have") +
                " two triangles facing opposite ways",
            edgeNames(report_.misorientedEdges),
            "repairMesh orients what can be oriented; if that was done the surface is one-sided, like a "
            "Moebius strip"};
  }
  Defect nonManifoldVertices() const {
    std::string names = "vertex " + atVertex(report_.nonManifoldVertices[0]);
    if (report_.nonManifoldVertexCount > 1) names += ", vertex " + atVertex(report_.nonManifoldVertices[1]);
    if (report_.nonManifoldVertexCount > 2) names += ", ...";
    return {counted(report_.nonManifoldVertexCount, "vertex joins", "vertices join") +
                " sheets that only touch there",
            names, "separate the sheets or join them by a neck"};
  }
  Defect severalBodies() const {
    std::string parts;
    for (std::size_t i = 0; i < std::min<std::size_t>(components_.size(), 3); ++i) {
      parts += (i ? ", " : "") + counted(components_[i].triangles, "triangle", "triangles") +
               " from vertex " + atVertex(mesh_.triangles[components_[i].firstTriangle][0]);
    }
    return {counted(components_.size(), "separate part", "separate parts"),
            parts + (components_.size() > 3 ? ", ..." : ""), "keep one part or unite them to one surface"};
  }
  Defect handles() const {
    return {"the surface has genus " + std::to_string(report_.genus),
            counted(static_cast<std::size_t>(report_.genus), "handle or tunnel", "handles or tunnels") +
                " (Euler number " + std::to_string(report_.euler) + ")",
            "only bodies without tunnels can be star-shaped: close them"};
  }
  Defect noInside() const {
    char volume[32];
    std::snprintf(volume, sizeof volume, "%.6g", report_.volume);
    if (report_.volume < -smallestVolume()) {
      return {"the surface faces inward", std::string("its volume is ") + volume, "repairMesh turns it"};
    }
    return {"the surface encloses no volume", std::string("it sums to ") + volume,
            "give the body some thickness"};
  }

  const TriMesh& mesh_;
  SurfaceReport report_;
  std::string firstMalformed_;
  std::vector<Component> components_;
};

}  // namespace

SurfaceReport inspectSurface(const TriMesh& mesh) { return Inspection(mesh).run(); }

ClosedSurface verifyClosedSurface(TriMesh mesh) {
  SurfaceReport report = inspectSurface(mesh);
  if (!report.valid) throw Error(Errc::invalidSurface, "not a closed surface of genus 0: " + report.defect);
  ClosedSurface surface;
  surface.mesh_ = std::make_shared<const TriMesh>(std::move(mesh));
  surface.report_ = std::make_shared<const SurfaceReport>(std::move(report));
  return surface;
}

}  // namespace polestar
