#pragma once
// Surfaces of known topology, and ways to damage them.

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "polestar/mesh/shapes.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

/// A closed grid of columns x rows squares, by point(column angle, row angle); `twist` glues the last column
/// to the first one with rows reversed (a Klein bottle instead of a torus).
inline TriMesh ringSurface(int columns, int rows, bool twist,
                           const std::function<Vec3(double, double)>& point) {
  TriMesh mesh;
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      mesh.vertices.push_back(point(2 * std::numbers::pi * i / columns, 2 * std::numbers::pi * j / rows));
    }
  }
  const auto vertex = [&](int i, int j) {
    if (i == columns && twist) j = rows - j;
    return static_cast<std::int32_t>((i % columns) * rows + (j + rows) % rows);
  };
  for (int i = 0; i < columns; ++i) {
    for (int j = 0; j < rows; ++j) {
      const std::int32_t a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1),
                         d = vertex(i, j + 1);
      mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
    }
  }
  return mesh;
}

inline TriMesh torus() {
  return ringSurface(16, 10, false, [](double u, double v) {
    const double r = 3 + std::cos(v);
    return Vec3(r * std::cos(u), r * std::sin(u), std::sin(v));
  });
}

inline TriMesh kleinBottle() {
  return ringSurface(16, 10, true, [](double u, double v) {
    const double r = 3 + std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v);
    return Vec3(r * std::cos(u), r * std::sin(u),
                std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v));
  });
}

/// A strip with a half turn: one-sided, one rim.
inline TriMesh moebiusStrip(int columns) {
  TriMesh mesh;
  for (int i = 0; i < columns; ++i) {
    const double u = 2 * std::numbers::pi * i / columns;
    for (const double w : {-0.5, 0.5}) {
      const double r = 2 + w * std::cos(u / 2);
      mesh.vertices.push_back({r * std::cos(u), r * std::sin(u), w * std::sin(u / 2)});
    }
  }
  const auto vertex = [&](int i, int side) {
    return static_cast<std::int32_t>(2 * (i % columns) + (i == columns ? 1 - side : side));
  };
  for (int i = 0; i < columns; ++i) {
    const std::int32_t a = vertex(i, 0), b = vertex(i + 1, 0), c = vertex(i + 1, 1), d = vertex(i, 1);
    mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}});
  }
  return mesh;
}

/// Both meshes as one, nothing shared.
inline TriMesh together(TriMesh a, const TriMesh& b) {
  const auto shift = static_cast<std::int32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
  return a;
}

inline TriMesh insideOut(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

/// Three vertices of its own for each triangle, each moved by up to `jitter` in each coordinate.
inline TriMesh soup(const TriMesh& mesh, double jitter = 0, unsigned seed = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> offset(-jitter, jitter);
  TriMesh result;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto first = static_cast<std::int32_t>(3 * t);
    for (int k = 0; k < 3; ++k) {
      Vec3 v = mesh.corner(t, k);
      if (jitter > 0) v += Vec3(offset(random), offset(random), offset(random));
      result.vertices.push_back(v);
    }
    result.triangles.push_back({first, first + 1, first + 2});
  }
  return result;
}

/// Without the triangles at vertex v.
inline TriMesh withoutStar(TriMesh mesh, std::int32_t v) {
  std::erase_if(mesh.triangles, [&](const Triangle& t) { return t[0] == v || t[1] == v || t[2] == v; });
  return mesh;
}

/// Puts `points` new vertices on edge (a, b) of one triangle only and fills the gap to the other one with
/// zero-area triangles: closed as before, and of the same shape. The edge is side 0 of triangle `t`.
inline TriMesh withZeroArea(TriMesh mesh, std::size_t t, int points) {
  const auto [a, b, c] = mesh.triangles[t];
  const Vec3 from = mesh.vertices[a], to = mesh.vertices[b];
  std::int32_t before = a;
  for (int i = 1; i <= points; ++i) {
    const auto on = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(from + (to - from) * i / (points + 1));
    mesh.triangles.push_back({before, on, c});
    mesh.triangles.push_back({before, b, on});
    before = on;
  }
  mesh.triangles[t] = {before, b, c};
  return mesh;
}

}  // namespace polestar::testing
