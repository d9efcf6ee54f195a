#include "polestar/chart/foliation.h"

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar {

std::size_t Foliation::triangleOf(std::size_t cellId) const {
  const std::size_t prismCells = 3 * layerCount() * triangles.size();
  return cellId < prismCells ? cellId / 3 % triangles.size() : cellId - prismCells;
}

std::array<std::uint32_t, 4> Foliation::cell(std::size_t id) const {
  const Triangle& corner = triangles[triangleOf(id)];
  const std::size_t layer = layerOf(id), n = vertexCount;
  if (layer == layerCount()) {
    const auto base = static_cast<std::uint32_t>(layer * n);
    return {static_cast<std::uint32_t>(centerNode()), base + corner[0], base + corner[1], base + corner[2]};
  }
  // Turn the triangle until its smallest vertex comes first.
  int first = 0;
  for (int k = 1; k < 3; ++k) {
    if (corner[k] < corner[first]) first = k;
  }
  const auto base = static_cast<std::uint32_t>(layer * n);
  const auto step = static_cast<std::uint32_t>(n);
  const std::uint32_t a = base + corner[first], b = base + corner[(first + 1) % 3],
                      c = base + corner[(first + 2) % 3];
  const std::uint32_t d = a + step, e = b + step, f = c + step;  // the inner ends
  switch (id % 3) {
    case 0:
      return {d, e, f, a};
    case 1:
      return b < c ? std::array{a, e, f, b} : std::array{a, e, f, c};
    default:
      return b < c ? std::array{a, b, f, c} : std::array{a, e, c, b};
  }
}

CellCounts countCells(const Foliation& foliation, std::span<const Vec3> positions) {
  const std::size_t count = foliation.cellCount();
  CellCounts zero;
  zero.badByLayer.assign(foliation.layerCount() + 1, 0);
  auto combine = [](CellCounts a, const CellCounts& b) {
    a.cells += b.cells;
    a.inverted += b.inverted;
    a.flat += b.flat;
    for (std::size_t i = 0; i < a.badByLayer.size(); ++i) a.badByLayer[i] += b.badByLayer[i];
    return a;
  };
  return detail::reduceChunks(
      count, 1 << 14, zero,
      [&](std::size_t begin, std::size_t end) {
        CellCounts part = zero;
        for (std::size_t id = begin; id < end; ++id) {
          const auto node = foliation.cell(id);
          const int sign =
              orient3d(positions[node[0]], positions[node[1]], positions[node[2]], positions[node[3]]);
          ++part.cells;
          part.inverted += sign < 0;
          part.flat += sign == 0;
          part.badByLayer[foliation.layerOf(id)] += sign <= 0;
        }
        return part;
      },
      combine);
}

std::vector<std::size_t> badCells(const Foliation& foliation, std::span<const Vec3> positions) {
  using Ids = std::vector<std::size_t>;
  return detail::reduceChunks(
      foliation.cellCount(), 1 << 14, Ids{},
      [&](std::size_t begin, std::size_t end) {
        Ids bad;
        for (std::size_t id = begin; id < end; ++id) {
          const auto c = foliation.cell(id);
          if (orient3d(positions[c[0]], positions[c[1]], positions[c[2]], positions[c[3]]) <= 0)
            bad.push_back(id);
        }
        return bad;
      },
      [](Ids all, const Ids& part) {
        all.insert(all.end(), part.begin(), part.end());
        return all;
      });
}

}  // namespace polestar
