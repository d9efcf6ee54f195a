#pragma once
// The radial cone: every level a scaled copy of the surface. A foliation without any field, and never
// inverted.

#include "polestar/chart/foliation.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

inline Foliation radialCone(const TriMesh& mesh, std::vector<double> levels) {
  Foliation f;
  f.vertexCount = mesh.vertices.size();
  f.triangles = mesh.triangles;
  f.levels = std::move(levels);
  for (const double level : f.levels) {
    for (const Vec3& v : mesh.vertices) f.nodes.push_back(level * v);
  }
  f.nodes.push_back(Vec3::Zero());
  return f;
}

}  // namespace polestar::testing
