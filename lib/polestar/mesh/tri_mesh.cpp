#include "polestar/mesh/tri_mesh.h"

#include <cmath>

#include <Eigen/Geometry>

namespace polestar {

Box boundingBox(const TriMesh& mesh) {
  Box box;
  for (const Vec3& v : mesh.vertices) {
    box.min = box.min.cwiseMin(v);
    box.max = box.max.cwiseMax(v);
  }
  return box;
}

Vec3 areaVector(const TriMesh& mesh, std::size_t t) {
  const Vec3& a = mesh.corner(t, 0);
  return (mesh.corner(t, 1) - a).cross(mesh.corner(t, 2) - a);
}

double surfaceArea(const TriMesh& mesh) {
  double twice = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) twice += areaVector(mesh, t).norm();
  return 0.5 * twice;
}

std::vector<double> vertexAreas(const TriMesh& mesh) {
  std::vector<double> area(mesh.vertices.size(), 0.0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const double third = areaVector(mesh, t).norm() / 6;
    for (const std::int32_t v : mesh.triangles[t]) area[v] += third;
  }
  return area;
}

std::vector<Vec3> vertexNormals(const TriMesh& mesh) {
  std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = areaVector(mesh, t).normalized();
    for (int k = 0; k < 3; ++k) {
      const Vec3 u = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k),
                 v = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
      normals[mesh.triangles[t][k]] += std::atan2(u.cross(v).norm(), u.dot(v)) * normal;
    }
  }
  for (Vec3& normal : normals) normal.normalize();
  return normals;
}

VolumeProperties volumeProperties(const TriMesh& mesh) {
  // About the box's center: a far-away mesh would otherwise lose its volume to cancellation.
  const Box box = boundingBox(mesh);
  const Vec3 origin = 0.5 * (box.min + box.max);
  double volume = 0;
  Vec3 moment = Vec3::Zero();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a = mesh.corner(t, 0) - origin, b = mesh.corner(t, 1) - origin, c = mesh.corner(t, 2) - origin;
    const double v = a.dot(b.cross(c)) / 6;
    volume += v;
    moment += v * (a + b + c) / 4;
  }
  return {volume, volume != 0 ? Vec3(origin + moment / volume) : origin};
}

}  // namespace polestar
