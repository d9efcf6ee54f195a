#include "polestar/polycube/polycube.h"

#include <algorithm>
#include <limits>
#include <string>
#include <unordered_map>

#include "polestar/core/error.h"

namespace polestar {
namespace {

constexpr std::size_t kNamedCells = 3;  // in a message; how many more there are is told

Cell neighbour(Cell cell, int axis, int step) {
  cell[axis] += step;
  return cell;
}

CellBox boxOf(std::span<const Cell> cells) {
  CellBox box{cells.front(), cells.front()};
  for (const Cell& cell : cells) {
    for (int k = 0; k < 3; ++k) {
      box.min[k] = std::min(box.min[k], cell[k]);
      box.max[k] = std::max(box.max[k], cell[k]);
    }
  }
  return box;
}

void checkEachCell(std::span<const Cell> sorted) {
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    if (i > 0 && sorted[i] == sorted[i - 1])
      throw Error(Errc::usage, "polycube: cell " + toString(sorted[i]) + " is listed twice");
    for (const int index : sorted[i]) {
      if (index < -Polycube::kLargestIndex || index > Polycube::kLargestIndex) {
        throw Error(Errc::usage, "polycube: cell " + toString(sorted[i]) + " lies farther than " +
                                     std::to_string(Polycube::kLargestIndex) +
                                     " cells from the center; make the cells larger");
      }
    }
  }
}

/// Cells with a gap towards the center, in words; empty when there is none.
std::string gapsOf(std::span<const Cell> sorted) {
  std::string named;
  std::size_t count = 0;
  for (const Cell& cell : sorted) {
    for (int axis = 0; axis < 3; ++axis) {
      if (cell[axis] == 0) continue;
      const Cell inner = neighbour(cell, axis, cell[axis] > 0 ? -1 : 1);
      if (std::binary_search(sorted.begin(), sorted.end(), inner)) continue;
      if (++count > kNamedCells) continue;
      named += (count > 1 ? ", " : "") + toString(cell) + " needs " + toString(inner);
    }
  }
  if (count == 0) return {};
  if (count > kNamedCells) named += " and " + std::to_string(count - kNamedCells) + " more";
  return "polycube: not star-shaped about the middle of cell 0 0 0, cells are missing between it and "
         "others: " +
         named + "; add them, or leave out what lies beyond";
}

using Around = std::array<bool, 8>;  // bit k of the index: on the far side along axis k

bool invariantAlong(const Around& around, int axis) {
  for (int i = 0; i < 8; ++i) {
    if (around[i] != around[i ^ (1 << axis)]) return false;
  }
  return true;
}

template <class Contains>
std::size_t countCorners(const CellBox& box, Contains&& contains) {
  std::size_t corners = 0;
  Cell v;  // the vertex at the lower corner of cell v
  for (v[0] = box.min[0]; v[0] <= box.max[0] + 1; ++v[0]) {
    for (v[1] = box.min[1]; v[1] <= box.max[1] + 1; ++v[1]) {
      for (v[2] = box.min[2]; v[2] <= box.max[2] + 1; ++v[2]) {
        Around around;
        for (int i = 0; i < 8; ++i) {
          around[i] = contains(Cell{v[0] - 1 + (i & 1), v[1] - 1 + (i >> 1 & 1), v[2] - 1 + (i >> 2)});
        }
        if (!invariantAlong(around, 0) && !invariantAlong(around, 1) && !invariantAlong(around, 2)) ++corners;
      }
    }
  }
  return corners;
}

/// Vertices of the cut lattice, by three whole numbers that count divisions from the box's lower corner.
class LatticeVertices {
 public:
  LatticeVertices(const CellBox& box, int divisions, int longestSide, TriMesh& mesh)
      : box_(box), divisions_(divisions), longestSide_(longestSide), mesh_(mesh) {
    for (int k = 0; k < 3; ++k) sides_[k] = static_cast<std::uint64_t>(box.side(k)) * divisions + 1;
  }

  std::int32_t at(const std::array<int, 3>& place) {
    const std::uint64_t key =
        (static_cast<std::uint64_t>(place[0]) * sides_[1] + static_cast<std::uint64_t>(place[1])) *
            sides_[2] +
        static_cast<std::uint64_t>(place[2]);
    const auto [entry, isNew] = index_.try_emplace(key, static_cast<std::int32_t>(mesh_.vertices.size()));
    if (isNew) mesh_.vertices.push_back({coordinate(place, 0), coordinate(place, 1), coordinate(place, 2)});
    return entry->second;
  }

 private:
  /// A quotient of whole numbers, rounded once: equal on equal planes, opposite on opposite ones.
  double coordinate(const std::array<int, 3>& place, int axis) const {
    return static_cast<double>(2 * (place[axis] + box_.min[axis] * divisions_) - divisions_) /
           (static_cast<double>(longestSide_) * divisions_);
  }

  CellBox box_;
  int divisions_, longestSide_;
  std::array<std::uint64_t, 3> sides_{};
  std::unordered_map<std::uint64_t, std::int32_t> index_;
  TriMesh& mesh_;
};

/// The face of `cell` (counted from the box's lower corner) on the side `side` of `axis`, cut up.
void addFace(LatticeVertices& vertices, const Cell& cell, int axis, int side, int divisions, TriMesh& mesh) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  const auto vertex = [&](int i, int j) {
    std::array<int, 3> place;
    place[axis] = (cell[axis] + side) * divisions;
    place[u] = cell[u] * divisions + i;
    place[v] = cell[v] * divisions + j;
    return vertices.at(place);
  };
  for (int i = 0; i < divisions; ++i) {
    for (int j = 0; j < divisions; ++j) {
      std::array<std::int32_t, 4> square{vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1),
                                         vertex(i, j + 1)};
      if (side == 0) std::swap(square[1], square[3]);
      // The first triangle's first and last vertices are the diagonal's.
      const int from = (i + j) % 2;
      const auto corner = [&](int k) { return square[(from + k) % 4]; };
      mesh.triangles.push_back({corner(0), corner(1), corner(2)});
      mesh.triangles.push_back({corner(0), corner(2), corner(3)});
    }
  }
}

}  // namespace

std::string toString(const Cell& cell) {
  return std::to_string(cell[0]) + " " + std::to_string(cell[1]) + " " + std::to_string(cell[2]);
}

int Polycube::longestSide() const { return std::max({box().side(0), box().side(1), box().side(2)}); }

bool operator==(const Polycube& a, const Polycube& b) { return std::ranges::equal(a.cells(), b.cells()); }

Polycube verifyPolycube(std::vector<Cell> cells) {
  if (cells.empty())
    throw Error(Errc::notStarShaped, "polycube: it has no cell; it needs cell 0 0 0 at least");
  std::ranges::sort(cells);
  checkEachCell(cells);
  if (!std::ranges::binary_search(cells, Cell{0, 0, 0})) {
    throw Error(Errc::notStarShaped, "polycube: cell 0 0 0, whose middle is the center, is missing among " +
                                         std::to_string(cells.size()) +
                                         " cells; add it, or shift the others to where it is");
  }
  if (const std::string gaps = gapsOf(cells); !gaps.empty()) throw Error(Errc::notStarShaped, gaps);

  auto data = std::make_shared<Polycube::Data>();
  data->box = boxOf(cells);
  data->filled.assign(data->box.size(), 0);
  for (const Cell& cell : cells) data->filled[data->box.index(cell)] = 1;
  data->cells = std::move(cells);
  Polycube polycube(data);
  const auto contains = [&](const Cell& cell) { return polycube.contains(cell); };
  double margin = Polycube::kLargestIndex + 0.5;
  for (const Cell& cell : polycube.cells()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int step : {-1, 1}) {
        if (!contains(neighbour(cell, axis, step))) margin = std::min(margin, std::abs(cell[axis]) + 0.5);
      }
    }
  }
  data->margin = margin;
  data->corners = countCorners(data->box, contains);
  return polycube;
}

Polycube cubeDomain() { return verifyPolycube({{0, 0, 0}}); }

TriMesh Polycube::surface(int divisions) const {
  if (divisions < 1) throw Error(Errc::usage, "polycube: a face needs one division at least");
  std::vector<std::array<int, 5>> faces;  // cell from the box's lower corner, axis, side
  for (const Cell& cell : cells()) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const int side : {0, 1}) {
        if (contains(neighbour(cell, axis, 2 * side - 1))) continue;
        faces.push_back({cell[0] - box().min[0], cell[1] - box().min[1], cell[2] - box().min[2], axis, side});
      }
    }
  }
  // On a sphere of squares there are two vertices more than squares.
  const double vertices = static_cast<double>(faces.size()) * divisions * divisions + 2;
  if (vertices > std::numeric_limits<std::int32_t>::max()) {
    throw Error(Errc::usage, "polycube: " + std::to_string(faces.size()) + " faces of " +
                                 std::to_string(divisions) + "^2 squares are too many for one mesh");
  }
  TriMesh mesh;
  mesh.vertices.reserve(static_cast<std::size_t>(vertices));
  mesh.triangles.reserve(2 * (static_cast<std::size_t>(vertices) - 2));
  LatticeVertices pool(box(), divisions, longestSide(), mesh);
  for (const auto& [i, j, k, axis, side] : faces) addFace(pool, {i, j, k}, axis, side, divisions, mesh);
  return mesh;
}

}  // namespace polestar
