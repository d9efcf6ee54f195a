#pragma once
// A triangle soup with shared vertices: what readers produce and what every stage walks over. No invariant is
// implied; ClosedSurface (closed_surface.h) is the type that carries one.

#include <vector>

#include "polestar/core/types.h"

namespace polestar {

struct TriMesh {
  std::vector<Vec3> vertices;
  std::vector<Triangle> triangles;

  const Vec3& corner(std::size_t triangle, int k) const { return vertices[triangles[triangle][k]]; }
};

struct Box {
  Vec3 min = Vec3::Constant(1e300), max = Vec3::Constant(-1e300);
  Vec3 extent() const { return max - min; }
  double diagonal() const { return extent().norm(); }
};

/// Axis-aligned box of the vertices.
Box boundingBox(const TriMesh& mesh);

/// Twice the area of triangle `t` times its unit normal (outward for outward-oriented meshes).
Vec3 areaVector(const TriMesh& mesh, std::size_t t);

double surfaceArea(const TriMesh& mesh);

/// A third of the area of the triangles around each vertex: the lumped mass of linear functions.
std::vector<double> vertexAreas(const TriMesh& mesh);

/// Outward unit normals at the vertices of an outward-oriented mesh, weighted by the triangles' angles:
/// independent of how flat parts are cut into triangles. [Thuermer & Wuethrich 1998]
std::vector<Vec3> vertexNormals(const TriMesh& mesh);

/// Volume and centroid of the enclosed solid, by signed tetrahedra about the box's center; negative volume
/// for an inward-oriented mesh. The centroid is the solid's, not the mean of the vertices. [Xia 2010,
/// sec. 4.1, step 1]
struct VolumeProperties {
  double volume;
  Vec3 centroid;
};
VolumeProperties volumeProperties(const TriMesh& mesh);

}  // namespace polestar
