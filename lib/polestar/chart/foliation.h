#pragma once
// The table of the map: every vertex of the surface followed inward along its field line, one node at each of
// a common set of levels of R. Two neighbouring levels and a triangle of the surface span a prism, cut into
// three tetrahedra; a cone of tetrahedra joins the innermost level to the center.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// Node ids: level * vertexCount + vertex, levels from the surface (0) inward; the last id is the center.
struct Foliation {
  std::size_t vertexCount = 0;
  std::vector<Triangle> triangles;  ///< of the surface
  std::vector<double> levels;       ///< R, strictly falling from 1
  std::vector<Vec3> nodes;  ///< inner frame; level 0 are the surface's vertices, the last node is the origin

  std::size_t layerCount() const { return levels.size() - 1; }
  std::size_t centerNode() const { return levels.size() * vertexCount; }
  std::size_t nodeId(std::size_t level, std::size_t vertex) const { return level * vertexCount + vertex; }
  const Vec3& node(std::size_t level, std::size_t vertex) const { return nodes[nodeId(level, vertex)]; }

  /// Tetrahedra: 3 a prism, ordered by layer, then triangle; then one a triangle around the center.
  std::size_t cellCount() const { return (3 * layerCount() + 1) * triangles.size(); }
  /// Node ids of a cell, positively oriented when the map is. Prisms are cut along the diagonals from the
  /// outer end of the line with the smaller vertex id to the inner end of the other, so that neighbours
  /// agree.
  std::array<std::uint32_t, 4> cell(std::size_t id) const;
  /// Layer of a cell; layerCount() for the cone.
  std::size_t layerOf(std::size_t cellId) const { return cellId / (3 * triangles.size()); }
  /// Triangle of the surface above a cell.
  std::size_t triangleOf(std::size_t cellId) const;
};

/// Exact counts over all cells.
struct CellCounts {
  std::size_t cells = 0;
  std::size_t inverted = 0;             ///< negative orientation
  std::size_t flat = 0;                 ///< exactly zero volume
  std::vector<std::size_t> badByLayer;  ///< inverted or flat, a layer; the last entry is the cone

  std::size_t bad() const { return inverted + flat; }
};

/// By orient3d on the given positions of the nodes: those of the foliation, or their images in the domain.
/// Parallel, linear in the cells.
CellCounts countCells(const Foliation& foliation, std::span<const Vec3> positions);
/// Ids of the cells that are inverted or flat there, ascending.
std::vector<std::size_t> badCells(const Foliation& foliation, std::span<const Vec3> positions);
inline CellCounts countCells(const Foliation& foliation) { return countCells(foliation, foliation.nodes); }

}  // namespace polestar
