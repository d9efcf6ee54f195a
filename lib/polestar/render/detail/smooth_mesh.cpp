#include "polestar/render/detail/smooth_mesh.h"

#include "polestar/core/detail/parallel.h"
#include "polestar/render/detail/creased_normals.h"

namespace polestar::detail {
namespace {

std::vector<Vec3> unitNormals(const TriMesh& mesh) {
  std::vector<Vec3> normals(mesh.triangles.size());
  parallelChunks(normals.size(), 16384, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) normals[t] = areaVector(mesh, t).stableNormalized();
  });
  return normals;
}

}  // namespace

SmoothMesh::SmoothMesh(TriMesh mesh, double creaseAngle)
    : mesh_(std::move(mesh)),
      faceNormals_(unitNormals(mesh_)),
      cornerNormals_(creasedNormals(mesh_, faceNormals_, creaseAngle)) {
  vertices_.reserve(mesh_.vertices.size());
  for (const Vec3& v : mesh_.vertices) vertices_.push_back(v.cast<float>());
}

Vec3 SmoothMesh::point(std::size_t triangle, double u, double v) const {
  return (1 - u - v) * mesh_.corner(triangle, 0) + u * mesh_.corner(triangle, 1) +
         v * mesh_.corner(triangle, 2);
}

ShadingPoint SmoothMesh::shadingPoint(std::size_t triangle, float u, float v, float side) const {
  const Triangle& t = mesh_.triangles[triangle];
  const auto& normals = cornerNormals_[triangle];
  const float weights[3] = {1 - u - v, u, v};
  const Vec3f position =
      weights[0] * vertices_[t[0]] + weights[1] * vertices_[t[1]] + weights[2] * vertices_[t[2]];
  ShadingPoint point;
  point.normal = side * faceNormals_[triangle].cast<float>();
  point.shadingNormal =
      side * (weights[0] * normals[0] + weights[1] * normals[1] + weights[2] * normals[2]).stableNormalized();
  // The smooth surface that the shading normals pretend bulges out of the facet; shadow rays from the facet
  // would show the facets at the edge of the shade [Hanika 2021, "Hacking the shadow terminator"].
  point.shadowOrigin = position;
  for (int k = 0; k < 3; ++k) {
    const float below = side * (position - vertices_[t[k]]).dot(normals[k]);
    if (below < 0) point.shadowOrigin -= weights[k] * below * side * normals[k];
  }
  return point;
}

}  // namespace polestar::detail
