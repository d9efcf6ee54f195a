#include "polestar/mesh/detail/boundary_loops.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

namespace polestar::detail {
namespace {

class LoopTracer {
 public:
  LoopTracer(const TriMesh& mesh, const EdgeTable& edges) : mesh_(mesh), edges_(edges) {
    for (std::size_t e = 0; e < edges.size(); ++e) {
      if (edges.sides(e).size() == 1) sides_.push_back(edges.sides(e)[0]);
    }
    std::sort(sides_.begin(), sides_.end());
    pairEnds();
  }

  std::vector<Hole> run() {
    std::vector<char> used(sides_.size(), 0);
    std::vector<Hole> holes;
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      if (used[i]) continue;
      // Back to where the path begins, or once around the loop.
      End start{static_cast<std::int32_t>(i), 0};
      while (mate(start).side >= 0) {
        start = other(mate(start));
        if (start.side == static_cast<std::int32_t>(i)) break;
      }
      trace(start, used, holes);
    }
    return holes;
  }

 private:
  /// An end of boundary side sides_[side]: 0 where the side begins, 1 where it ends.
  struct End {
    std::int32_t side = -1;
    std::int32_t which = 0;
  };

  std::int32_t vertexOf(End end) const {
    const std::int32_t side = sides_[end.side];
    return mesh_.triangles[side / 3][(side % 3 + end.which) % 3];
  }
  static End other(End end) { return {end.side, 1 - end.which}; }
  End mate(End end) const { return mates_[2 * end.side + end.which]; }
  void pair(End a, End b) {
    mates_[2 * a.side + a.which] = b;
    mates_[2 * b.side + b.which] = a;
  }

  /// Ends at the same vertex meet, first those of the same sheet.
  void pairEnds() {
    mates_.assign(2 * sides_.size(), End{});
    struct Entry {
      std::int32_t vertex;
      End end;
    };
    std::vector<Entry> ends;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(sides_.size()); ++i) {
      for (const std::int32_t which : {0, 1}) ends.push_back({vertexOf({i, which}), {i, which}});
    }
    std::stable_sort(ends.begin(), ends.end(),
                     [](const Entry& a, const Entry& b) { return a.vertex < b.vertex; });
    for (std::size_t begin = 0, end = 0; begin < ends.size(); begin = end) {
      while (end < ends.size() && ends[end].vertex == ends[begin].vertex) ++end;
      for (std::size_t i = begin; i < end && end - begin > 2; ++i) {
        if (mate(ends[i].end).side >= 0) continue;
        const End across = acrossFan(ends[i].end);
        if (across.side >= 0) pair(ends[i].end, across);
      }
      End waiting;
      for (std::size_t i = begin; i < end; ++i) {
        if (mate(ends[i].end).side >= 0) continue;
        if (waiting.side >= 0) {
          pair(waiting, ends[i].end);
          waiting = End{};
        } else {
          waiting = ends[i].end;
        }
      }
    }
  }

  /// The boundary end on the far side of the fan of triangles around the end's vertex, if the fan leads to
  /// one.
  End acrossFan(End end) const {
    const std::int32_t v = vertexOf(end);
    std::int32_t side = sides_[end.side];
    for (;;) {
      const std::int32_t t = side / 3, k = side % 3;
      // The triangle's other side at v.
      const std::int32_t leaving = 3 * t + (mesh_.triangles[t][k] == v ? (k + 2) % 3 : (k + 1) % 3);
      const auto sides = edges_.sides(edges_.edgeOf(leaving));
      if (sides.size() == 1) {
        const auto found = std::lower_bound(sides_.begin(), sides_.end(), leaving);
        const bool begins = mesh_.triangles[t][leaving % 3] == v;
        return {static_cast<std::int32_t>(found - sides_.begin()), begins ? 0 : 1};
      }
      if (sides.size() > 2) return {};
      side = sides[0] == leaving ? sides[1] : sides[0];
    }
  }

  /// Follows the chain from `start`; where it comes back to one of its vertices, a loop is complete and cut
  /// out. Two holes that touch in a vertex are two loops.
  void trace(End start, std::vector<char>& used, std::vector<Hole>& holes) const {
    std::vector<std::int32_t> path;
    std::unordered_map<std::int32_t, std::size_t> position;
    End at = start;
    for (;;) {
      const std::int32_t v = vertexOf(at);
      const auto seen = position.find(v);
      if (seen != position.end()) {
        const auto loop = path.begin() + static_cast<std::ptrdiff_t>(seen->second);
        for (auto member = loop; member != path.end(); ++member) position.erase(*member);
        holes.push_back(measured({loop, path.end()}, true));
        path.erase(loop, path.end());
      }
      position[v] = path.size();
      path.push_back(v);
      if (used[at.side]) return;
      used[at.side] = 1;
      const End next = mate(other(at));
      if (next.side < 0) {
        path.push_back(vertexOf(other(at)));
        holes.push_back(measured(std::move(path), false));
        return;
      }
      at = next;
    }
  }

  Hole measured(std::vector<std::int32_t> vertices, bool closed) const {
    Hole hole;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      const Vec3& here = mesh_.vertices[vertices[i]];
      hole.center += here / static_cast<double>(vertices.size());
      if (closed || i > 0)
        hole.length += (here - mesh_.vertices[vertices[i > 0 ? i - 1 : vertices.size() - 1]]).norm();
    }
    hole.vertices = std::move(vertices);
    return hole;
  }

  const TriMesh& mesh_;
  const EdgeTable& edges_;
  std::vector<std::int32_t> sides_;
  std::vector<End> mates_;
};

}  // namespace

std::vector<Hole> boundaryLoops(const TriMesh& mesh, const EdgeTable& edges) {
  return LoopTracer(mesh, edges).run();
}

}  // namespace polestar::detail
