#include "polestar/mesh/edge_pairs.h"

#include <cstdint>
#include <numeric>
#include <vector>

#include "polestar/core/detail/parallel.h"

namespace polestar {
namespace {

/// Steele's mix of 64 bits (SplitMix64).
std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// Of the edge from a to b; that of b to a is its negative.
std::uint64_t edgeCode(std::int32_t a, std::int32_t b) {
  const auto pair = [](std::int32_t low, std::int32_t high) {
    return std::uint64_t{static_cast<std::uint32_t>(low)} << 32 | static_cast<std::uint32_t>(high);
  };
  return a < b ? mixed(pair(a, b)) : -mixed(pair(b, a));
}

/// Vertices joined by triangles, as trees with halved paths.
class Parts {
 public:
  explicit Parts(const TriMesh& mesh) : parent_(mesh.vertices.size()) {
    std::iota(parent_.begin(), parent_.end(), 0);
    for (const Triangle& t : mesh.triangles) {
      const std::int32_t root = of(t[0]);
      parent_[of(t[1])] = root;
      parent_[of(t[2])] = root;
    }
  }
  std::int32_t of(std::int32_t vertex) {
    while (parent_[vertex] != vertex) vertex = parent_[vertex] = parent_[parent_[vertex]];
    return vertex;
  }

 private:
  std::vector<std::int32_t> parent_;
};

}  // namespace

bool edgesPair(const TriMesh& mesh) {
  const auto sum = detail::reduceChunks(
      mesh.triangles.size(), 16384, std::uint64_t{0},
      [&](std::size_t begin, std::size_t end) {
        std::uint64_t part = 0;
        for (std::size_t t = begin; t < end; ++t) {
          const auto [a, b, c] = mesh.triangles[t];
          part += edgeCode(a, b) + edgeCode(b, c) + edgeCode(c, a);
        }
        return part;
      },
      [](std::uint64_t x, std::uint64_t y) { return x + y; });
  return sum == 0 && !mesh.triangles.empty();
}

bool hasCavities(const TriMesh& mesh) {
  Parts parts(mesh);
  const Box box = boundingBox(mesh);
  const Vec3 middle = 0.5 * (box.min + box.max);
  std::vector<double> volumes(mesh.vertices.size(), 0);
  double whole = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a = mesh.corner(t, 0) - middle, b = mesh.corner(t, 1) - middle, c = mesh.corner(t, 2) - middle;
    const double volume = a.dot(b.cross(c));
    volumes[parts.of(mesh.triangles[t][0])] += volume;
    whole += volume;
  }
  for (const double volume : volumes) {
    if (volume * whole < 0) return true;
  }
  return false;
}

}  // namespace polestar
