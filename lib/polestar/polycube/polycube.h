#pragma once
// Star-shaped polycubes: domains made of cubic cells that resemble a solid better than a ball does.
// [Xia 2010, sec. 4.2]
//
// The center lies in the middle of a cell. A set of cells is star-shaped about it when every cell that is not
// in the center's layer of an axis has its neighbour towards that layer in the set, for each axis: then a
// face that looks along an axis lies beyond the center on it, by half a cell at least. Each line of cells
// along an axis meets the set in one interval, and around every vertex and edge of the lattice both the set
// and what it leaves out are connected by faces: the surface is a manifold sphere.

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Place of a cell in the lattice; {0, 0, 0} has the center in its middle.
using Cell = std::array<int, 3>;

/// A box of cells, both corners belong to it.
struct CellBox {
  Cell min{0, 0, 0}, max{0, 0, 0};

  int side(int axis) const { return max[axis] - min[axis] + 1; }
  std::size_t size() const {
    return static_cast<std::size_t>(side(0)) * static_cast<std::size_t>(side(1)) *
           static_cast<std::size_t>(side(2));
  }
  bool contains(const Cell& cell) const {
    for (int k = 0; k < 3; ++k) {
      if (cell[k] < min[k] || cell[k] > max[k]) return false;
    }
    return true;
  }
  /// Of a cell of the box, in lexicographic order.
  std::size_t index(const Cell& cell) const {
    return (static_cast<std::size_t>(cell[0] - min[0]) * static_cast<std::size_t>(side(1)) +
            static_cast<std::size_t>(cell[1] - min[1])) *
               static_cast<std::size_t>(side(2)) +
           static_cast<std::size_t>(cell[2] - min[2]);
  }
};

/// A set of cells that was found star-shaped about the middle of cell {0, 0, 0}. Cheap to copy.
///
/// Its *domain frame* has the center as origin, the lattice's axes, and a unit such that the longest side of
/// the polycube's box is 2: the single cell is [-1, 1]^3, with K cells along the longest side a cell has side
/// 2 / K.
class Polycube {
 public:
  /// No cell is farther out than this on any axis.
  static constexpr int kLargestIndex = 64;

  std::span<const Cell> cells() const { return data_->cells; }  ///< sorted
  const CellBox& box() const { return data_->box; }
  bool contains(const Cell& cell) const {
    return box().contains(cell) && data_->filled[box().index(cell)] != 0;
  }
  int longestSide() const;                                 ///< of the box, in cells
  double cellSide() const { return 2.0 / longestSide(); }  ///< domain units

  /// Smallest distance from the center to the plane of a face, in cells: 1/2 or more. (Any point of the
  /// kernel may be farther from all planes than the center is.)
  double margin() const { return data_->margin; }

  /// Vertices of the lattice where the surface is neither flat nor straight, that is, where the eight cells
  /// around do not look the same when moved along some axis: convex and reentrant corners and saddles, each
  /// counted once. 8 for a single cell.
  std::size_t corners() const { return data_->corners; }

  /// The surface in the domain frame: closed, outward, manifold, of genus 0, every face of a cell cut into
  /// `divisions`^2 squares of two triangles. Coordinates on a plane of the lattice are the same number
  /// throughout. With an even number of divisions diagonals start at the vertices of the lattice and
  /// alternate: no triangle has two edges on creases, and a polycube's mirror images have mirrored triangles.
  /// (A square in the middle of a face, as odd numbers have one, cannot be cut into two that mirror one
  /// another.)
  /// @throws Error{Errc::usage} for divisions below 1, or more than 2^31 vertices
  TriMesh surface(int divisions) const;

 private:
  struct Data {
    std::vector<Cell> cells;
    CellBox box;
    std::vector<char> filled;  ///< of the box's cells
    double margin = 0.5;
    std::size_t corners = 0;
  };
  friend Polycube verifyPolycube(std::vector<Cell> cells);
  explicit Polycube(std::shared_ptr<const Data> data) : data_(std::move(data)) {}
  std::shared_ptr<const Data> data_;
};

bool operator==(const Polycube& a, const Polycube& b);

/// The only way to a Polycube; cells in any order. O(n log n).
/// @throws Error{Errc::notStarShaped} naming the cells at fault: no cell at all, no cell {0, 0, 0}, cells
/// whose neighbour towards the center is missing (cells that do not hang together are among these);
/// Error{Errc::usage} for a cell that is listed twice or lies beyond Polycube::kLargestIndex.
Polycube verifyPolycube(std::vector<Cell> cells);

/// The single cell: [-1, 1]^3 in the domain frame.
Polycube cubeDomain();

/// "-2 0 5"
std::string toString(const Cell& cell);

}  // namespace polestar
