#include "polestar/render/detail/creased_normals.h"

#include <Eigen/Geometry>
#include <cmath>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

/// Which corners meet at a vertex: those of vertex v are corners[begin[v]] to corners[begin[v + 1] - 1].
struct VertexCorners {
  std::vector<std::size_t> begin;
  std::vector<std::pair<std::int32_t, std::int32_t>> corners;  ///< triangle, 0 to 2

  explicit VertexCorners(const TriMesh& mesh)
      : begin(mesh.vertices.size() + 1, 0), corners(3 * mesh.triangles.size()) {
    for (const Triangle& t : mesh.triangles) {
      for (const std::int32_t v : t) ++begin[v + 1];
    }
    for (std::size_t v = 0; v + 1 < begin.size(); ++v) begin[v + 1] += begin[v];
    std::vector<std::size_t> fill(begin.begin(), begin.end() - 1);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (int k = 0; k < 3; ++k) corners[fill[mesh.triangles[t][k]]++] = {static_cast<std::int32_t>(t), k};
    }
  }
};

std::array<double, 3> cornerAngles(const TriMesh& mesh, std::size_t t) {
  std::array<double, 3> angles;
  for (int k = 0; k < 3; ++k) {
    const Vec3 a = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k),
               b = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
    angles[k] = std::atan2(a.cross(b).norm(), a.dot(b));
  }
  return angles;
}

}  // namespace

std::vector<std::array<Vec3f, 3>> creasedNormals(const TriMesh& mesh, const std::vector<Vec3>& faceNormals,
                                                 double creaseAngle) {
  const std::size_t triangles = mesh.triangles.size();
  const VertexCorners around(mesh);
  std::vector<std::array<double, 3>> angles(triangles);
  parallelChunks(triangles, 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) angles[t] = cornerAngles(mesh, t);
  });
  const double smooth = std::cos(creaseAngle);
  std::vector<std::array<Vec3f, 3>> normals(triangles);
  parallelChunks(triangles, 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t v = mesh.triangles[t][k];
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = around.begin[v]; i < around.begin[v + 1]; ++i) {
          const auto [other, corner] = around.corners[i];
          if (faceNormals[t].dot(faceNormals[other]) >= smooth)
            sum += angles[other][corner] * faceNormals[other];
        }
        normals[t][k] = (sum.norm() > 0 ? Vec3(sum.normalized()) : faceNormals[t]).cast<float>();
      }
    }
  });
  return normals;
}

}  // namespace polestar::detail
