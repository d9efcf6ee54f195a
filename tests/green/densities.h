#pragma once
// Layers whose bounds are looked at: a mesh and densities at its vertices.

#include <random>
#include <vector>

#include "polestar/mesh/shapes.h"

namespace polestar::testing {

/// A density that has nothing to do with G: every second derivative is there to be bounded.
inline std::vector<double> roughDensity(const TriMesh& mesh) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-0.3, 0.1);
  std::vector<double> density;
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) density.push_back(uniform(random));
  return density;
}

inline std::vector<double> smoothDensity(const TriMesh& mesh) {
  std::vector<double> density;
  for (const Vec3& v : mesh.vertices) density.push_back(-0.1 + 0.03 * v[0] + 0.05 * v[1] * v[2]);
  return density;
}

inline TriMesh needles() {
  TriMesh mesh = icosphere(2);
  for (Vec3& v : mesh.vertices) v = v.cwiseProduct(Vec3(1, 0.5, 0.08));
  return mesh;
}

}  // namespace polestar::testing
