#include "polestar/mesh/shapes.h"

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

namespace polestar {
namespace {

TriMesh icosahedron() {
  const double g = std::numbers::phi;
  TriMesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (Vec3& v : mesh.vertices) v.normalize();
  return mesh;
}

/// Vertices by integer key, so that patches share their seams.
template <class Key>
class VertexPool {
 public:
  explicit VertexPool(TriMesh& mesh) : mesh_(mesh) {}
  template <class Make>
  std::int32_t at(const Key& key, Make&& make) {
    const auto [entry, isNew] = index_.try_emplace(key, static_cast<std::int32_t>(mesh_.vertices.size()));
    if (isNew) mesh_.vertices.push_back(make());
    return entry->second;
  }

 private:
  TriMesh& mesh_;
  std::map<Key, std::int32_t> index_;
};

}  // namespace

TriMesh icosphere(int levels) {
  TriMesh mesh = icosahedron();
  for (int level = 0; level < levels; ++level) {
    VertexPool<std::pair<std::int32_t, std::int32_t>> midpoints(mesh);
    auto midpoint = [&](std::int32_t a, std::int32_t b) {
      return midpoints.at(std::minmax(a, b),
                          [&] { return Vec3((mesh.vertices[a] + mesh.vertices[b]).normalized()); });
    };
    std::vector<Triangle> finer;
    finer.reserve(4 * mesh.triangles.size());
    for (const Triangle& t : mesh.triangles) {
      const std::int32_t a = midpoint(t[0], t[1]), b = midpoint(t[1], t[2]), c = midpoint(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

TriMesh radialShape(int levels, const std::function<double(const Vec3&)>& radius) {
  return transformed(icosphere(levels),
                     [&](const Vec3& direction) { return Vec3(radius(direction) * direction); });
}

TriMesh cube(int divisions) {
  TriMesh mesh;
  VertexPool<std::array<int, 3>> pool(mesh);
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 2; ++side) {
      auto vertex = [&](int i, int j) {
        std::array<int, 3> key;
        key[axis] = side * divisions;
        key[(axis + 1) % 3] = i;
        key[(axis + 2) % 3] = j;
        return pool.at(key, [&] {
          return Vec3(2.0 * key[0] / divisions - 1, 2.0 * key[1] / divisions - 1,
                      2.0 * key[2] / divisions - 1);
        });
      };
      for (int i = 0; i < divisions; ++i) {
        for (int j = 0; j < divisions; ++j) {
          const std::int32_t a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1),
                             d = vertex(i, j + 1);
          if (side == 1) {
            mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
          } else {
            mesh.triangles.insert(mesh.triangles.end(), {{a, c, b}, {a, d, c}});
          }
        }
      }
    }
  }
  return mesh;
}

TriMesh halfBall(int rings) {
  // Ring k of either cap has 6 k vertices; the two caps share the equator, ring `rings`.
  TriMesh mesh;
  VertexPool<std::array<int, 3>> pool(mesh);
  auto vertex = [&](bool dome, int ring, int i) {
    const int count = std::max(1, 6 * ring);
    return pool.at({ring == rings ? 0
                    : dome        ? 1
                                  : -1,
                    ring, i % count},
                   [&] {
                     const double angle = 2 * std::numbers::pi * (i % count) / count;
                     const double share = static_cast<double>(ring) / rings;
                     const double polar = share * std::numbers::pi / 2;
                     const double r = dome || ring == rings ? std::sin(polar) : share;
                     const double z = dome && ring < rings ? std::cos(polar) : 0;
                     return Vec3(r * std::cos(angle), r * std::sin(angle), z);
                   });
  };
  for (const bool dome : {true, false}) {
    for (int ring = 0; ring < rings; ++ring) {
      for (int sector = 0; sector < 6; ++sector) {
        for (int i = 0; i <= ring; ++i) {
          const std::int32_t outer = vertex(dome, ring + 1, sector * (ring + 1) + i);
          const std::int32_t outerNext = vertex(dome, ring + 1, sector * (ring + 1) + i + 1);
          const std::int32_t inner = vertex(dome, ring, sector * ring + i);
          Triangle t{inner, outer, outerNext};
          if (!dome) std::swap(t[1], t[2]);
          mesh.triangles.push_back(t);
          if (i < ring) {
            Triangle u{inner, outerNext, vertex(dome, ring, sector * ring + i + 1)};
            if (!dome) std::swap(u[1], u[2]);
            mesh.triangles.push_back(u);
          }
        }
      }
    }
  }
  return mesh;
}

TriMesh smoothStar(int levels) {
  constexpr double kLargest = 0.32475952641916445;  // of z (x^3 - 3 x y^2) on the sphere: 3 sqrt(3) / 16
  return radialShape(levels, [](const Vec3& w) {
    return 1 + 0.3 * w[2] * (w[0] * w[0] * w[0] - 3 * w[0] * w[1] * w[1]) / kLargest;
  });
}

TriMesh transformed(TriMesh mesh, const std::function<Vec3(const Vec3&)>& move) {
  for (Vec3& v : mesh.vertices) v = move(v);
  return mesh;
}

}  // namespace polestar
