#include "support.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/mesh/shapes.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar::testing {

Mat3 someRotation() {
  return Eigen::AngleAxisd(1.234, Vec3(0.3, -0.7, 0.55).normalized()).toRotationMatrix();
}

double largestDifference(std::span<const Vec3> a, std::span<const Vec3> b) {
  double most = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) most = std::max(most, (a[i] - b[i]).norm());
  return most;
}

double largestDifferenceUpToRotation(std::span<const Vec3> a, std::span<const Vec3> b) {
  const std::vector<double> ones(a.size(), 1.0);
  return largestDifference(rotated(bestRotation(a, b, ones), a), b);
}

std::vector<Vec3> rotated(const Mat3& turn, std::span<const Vec3> directions) {
  std::vector<Vec3> result;
  for (const Vec3& s : directions) result.push_back(turn * s);
  return result;
}

TriMesh shuffledCube(int divisions, unsigned seed) {
  TriMesh mesh = cube(divisions);
  std::mt19937 random(seed);
  // cube() writes the two triangles of a square one after the other.
  for (std::size_t t = 0; t + 1 < mesh.triangles.size(); t += 2) {
    const Triangle first = mesh.triangles[t], second = mesh.triangles[t + 1];
    if (random() % 2 == 0) continue;
    for (int k = 0; k < 3; ++k) {
      for (int l = 0; l < 3; ++l) {
        if (first[k] != second[(l + 1) % 3] || first[(k + 1) % 3] != second[l]) continue;
        const std::int32_t a = first[k], b = first[(k + 1) % 3], c = first[(k + 2) % 3],
                           d = second[(l + 2) % 3];
        mesh.triangles[t] = {a, d, c};
        mesh.triangles[t + 1] = {d, b, c};
      }
    }
  }
  return mesh;
}

TriMesh withNeedles(TriMesh mesh, int count, double height, unsigned seed) {
  std::mt19937 random(seed);
  for (int i = 0; i < count; ++i) {
    const std::size_t t = random() % mesh.triangles.size();
    const int k = static_cast<int>(random() % 3);
    const std::int32_t a = mesh.triangles[t][k], b = mesh.triangles[t][(k + 1) % 3],
                       c = mesh.triangles[t][(k + 2) % 3];
    const double along = 0.1 + 0.8 * static_cast<double>(random() % 1000) / 1000;
    const Vec3 foot = (1 - along) * mesh.vertices[a] + along * mesh.vertices[b];
    const auto added = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back((1 - height) * foot + height * mesh.vertices[c]);
    mesh.triangles[t] = {a, b, added};
    mesh.triangles.push_back({b, c, added});
    mesh.triangles.push_back({c, a, added});
  }
  return mesh;
}

TriMesh drum(int sides, double halfHeight) {
  TriMesh mesh;
  for (const double z : {-halfHeight, halfHeight}) {
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::numbers::pi * i / sides;
      mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), z);
    }
  }
  for (int i = 0; i < sides; ++i) {
    const int j = (i + 1) % sides;
    mesh.triangles.push_back({i, j, sides + j});
    mesh.triangles.push_back({i, sides + j, sides + i});
  }
  for (int i = 1; i + 1 < sides; ++i) {
    mesh.triangles.push_back({sides, sides + i, sides + i + 1});
    mesh.triangles.push_back({0, i + 1, i});
  }
  return mesh;
}

}  // namespace polestar::testing
