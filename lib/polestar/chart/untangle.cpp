#include "polestar/chart/untangle.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <numeric>
#include <unordered_map>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/detail/untangle_tets.h"

namespace polestar {
namespace {

using Cell = std::array<std::uint32_t, 4>;
/// A traced cell serves as its own reference unless it is flatter than this: 6 volume / longest edge^3,
/// against the same of the cell between rays.
constexpr double kSoundShare = 0.05;
constexpr double kLeastFall = 1e-3;
/// Nodes of the largest patch that is tried: minutes otherwise.
constexpr std::size_t kMostNodes = 20000;

// Triangles around every vertex of the surface.
class Surroundings {
 public:
  explicit Surroundings(const Foliation& f) : start_(f.vertexCount + 1, 0) {
    for (const Triangle& t : f.triangles) {
      for (const std::int32_t v : t) ++start_[v + 1];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    triangles_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t t = 0; t < f.triangles.size(); ++t) {
      for (const std::int32_t v : f.triangles[t]) triangles_[next[v]++] = static_cast<std::uint32_t>(t);
    }
  }
  std::span<const std::uint32_t> around(std::size_t vertex) const {
    return std::span(triangles_).subspan(start_[vertex], start_[vertex + 1] - start_[vertex]);
  }

 private:
  std::vector<std::size_t> start_;
  std::vector<std::uint32_t> triangles_;
};

// The cells of one layer of a triangle's column (the cone's for the last).
template <class Visit>
void visitCells(const Foliation& f, std::size_t layer, std::size_t triangle, Visit&& visit) {
  const std::size_t count = f.triangles.size();
  if (layer == f.layerCount()) {
    visit(3 * layer * count + triangle);
    return;
  }
  for (std::size_t j = 0; j < 3; ++j) visit(3 * (layer * count + triangle) + j);
}

// Nodes that may move, as connected sets.
std::vector<std::vector<std::uint32_t>> patchesAround(const Foliation& f, const Surroundings& surroundings,
                                                      const std::vector<std::size_t>& bad, int rings) {
  const std::size_t n = f.vertexCount;
  auto movable = [&](std::uint32_t id) { return id >= n && id < f.centerNode(); };
  std::vector<char> free(f.nodes.size(), 0);
  std::vector<std::uint32_t> front, all;
  auto add = [&](std::uint32_t id, std::vector<std::uint32_t>& to) {
    if (!movable(id) || free[id]) return;
    free[id] = 1;
    to.push_back(id);
    all.push_back(id);
  };
  for (const std::size_t id : bad) {
    for (const std::uint32_t node : f.cell(id)) add(node, front);
  }
  auto neighbours = [&](std::uint32_t id, auto&& visit) {
    // All that may share a cell with it.
    const std::size_t level = id / n, vertex = id % n;
    for (const std::uint32_t t : surroundings.around(vertex)) {
      for (const std::int32_t v : f.triangles[t]) {
        for (std::size_t k = level - 1; k <= level + 1 && k < f.levels.size(); ++k)
          visit(static_cast<std::uint32_t>(f.nodeId(k, v)));
      }
    }
  };
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t id : front) neighbours(id, [&](std::uint32_t other) { add(other, next); });
    front = std::move(next);
  }
  std::sort(all.begin(), all.end());
  std::vector<std::vector<std::uint32_t>> patches;
  for (const std::uint32_t seed : all) {
    if (free[seed] != 1) continue;
    std::vector<std::uint32_t> patch{seed};
    free[seed] = 2;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      neighbours(patch[i], [&](std::uint32_t other) {
        if (movable(other) && free[other] == 1) {
          free[other] = 2;
          patch.push_back(other);
        }
      });
    }
    std::sort(patch.begin(), patch.end());
    patches.push_back(std::move(patch));
  }
  return patches;
}

// The cells around the free nodes, with references. (Those of all cells between rays are positive on a star
// shape, up to rounding.)
class Patch {
 public:
  Patch(const Foliation& f, const Surroundings& surroundings, const std::vector<std::uint32_t>& free)
      : foliation_(f) {
    for (const std::uint32_t id : free) slot(id);
    patch_.free = free.size();
    for (const std::size_t id : cellsAround(free, surroundings)) addCell(f.cell(id));
  }

  detail::TetPatch take() { return std::move(patch_); }

 private:
  std::uint32_t slot(std::uint32_t id) {
    const auto [at, isNew] = slotOf_.try_emplace(id, static_cast<std::uint32_t>(patch_.nodes.size()));
    if (isNew) patch_.nodes.push_back(foliation_.nodes[id]);
    return at->second;
  }

  std::vector<std::size_t> cellsAround(const std::vector<std::uint32_t>& free,
                                       const Surroundings& surroundings) const {
    const std::size_t n = foliation_.vertexCount;
    std::vector<std::size_t> cells;
    for (const std::uint32_t id : free) {
      const std::size_t level = id / n;
      for (const std::uint32_t t : surroundings.around(id % n)) {
        for (const std::size_t layer : {level - 1, level})
          visitCells(foliation_, layer, t, [&](std::size_t cell) { cells.push_back(cell); });
      }
    }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    std::erase_if(cells, [&](std::size_t cell) {
      const Cell c = foliation_.cell(cell);
      return std::none_of(c.begin(), c.end(), [&](std::uint32_t id) { return slotOf_.count(id) > 0; });
    });
    return cells;
  }

  // Where the node would be on the ray of its vertex, were distances from the center to fall from level to
  // level.
  Vec3 onRay(std::uint32_t id) const {
    if (id == foliation_.centerNode()) return Vec3::Zero();
    const std::size_t level = id / foliation_.vertexCount, vertex = id % foliation_.vertexCount;
    const Vec3& q = foliation_.nodes[vertex];
    double distance = q.norm();
    for (std::size_t k = 1; k <= level; ++k)
      distance = std::min(foliation_.node(k, vertex).norm(), (1 - kLeastFall) * distance);
    return distance / q.norm() * q;
  }

  static double soundness(const Mat3& edges) {
    const double longest = std::max(
        {edges.col(0).norm(), edges.col(1).norm(), edges.col(2).norm(), (edges.col(0) - edges.col(1)).norm(),
         (edges.col(1) - edges.col(2)).norm(), (edges.col(2) - edges.col(0)).norm()});
    return edges.determinant() / (longest * longest * longest);
  }

  void addCell(const Cell& cell) {
    Mat3 traced, radial;
    const Vec3 origin = onRay(cell[0]);
    for (int k = 0; k < 3; ++k) {
      traced.col(k) = foliation_.nodes[cell[k + 1]] - foliation_.nodes[cell[0]];
      radial.col(k) = onRay(cell[k + 1]) - origin;
    }
    const double ofRadial = soundness(radial);
    const bool useTraced = !(ofRadial > 0) || soundness(traced) > kSoundShare * ofRadial;
    detail::TetPatch::Tet tet{{}, useTraced ? traced : radial};
    for (int k = 0; k < 4; ++k) tet.node[k] = slot(cell[k]);
    patch_.tets.push_back(tet);
  }

  const Foliation& foliation_;
  std::unordered_map<std::uint32_t, std::uint32_t> slotOf_;
  detail::TetPatch patch_;
};

}  // namespace

Untangling untangle(Foliation& foliation, int rings, const Context& context) {
  Untangling result;
  const std::vector<std::size_t> bad = badCells(foliation, foliation.nodes);
  if (bad.empty()) return result;
  const Surroundings surroundings(foliation);
  auto patches = patchesAround(foliation, surroundings, bad, rings);
  // Patches share no cells: their nodes would be neighbours and they one patch.
  std::vector<std::vector<Vec3>> places(patches.size());
  detail::parallelChunks(patches.size(), 1, [&](std::size_t p, std::size_t) {
    if (patches[p].size() <= kMostNodes)
      places[p] = detail::untangleTets(Patch(foliation, surroundings, patches[p]).take(), context);
  });
  for (std::size_t p = 0; p < patches.size(); ++p) {
    for (std::size_t i = 0; i < places[p].size(); ++i) {
      Vec3& node = foliation.nodes[patches[p][i]];
      result.largestMove = std::max(result.largestMove, (places[p][i] - node).norm());
      if (places[p][i] != node) result.movedNodes.push_back(patches[p][i]);
      node = places[p][i];
    }
  }
  std::sort(result.movedNodes.begin(), result.movedNodes.end());
  return result;
}

}  // namespace polestar
