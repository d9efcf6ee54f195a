#include "polestar/star/subdivide.h"

#include <gtest/gtest.h>

#include <cmath>

#include "polestar/mesh/shapes.h"
#include "support/solids.h"

namespace polestar {
namespace {

double widest(const StarShape& shape) {
  const TriMesh& mesh = shape.mesh();
  double angle = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = mesh.corner(t, k), &b = mesh.corner(t, (k + 1) % 3);
      angle = std::max(angle, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  }
  return angle;
}

TEST(Subdivide, CutsWideTrianglesAndKeepsTheSolid) {
  const StarShape coarse = testing::starShape(icosphere(1), Vec3(0.3, 0.1, -0.2));
  const StarShape fine = subdivide(coarse, 0.15);
  EXPECT_GT(widest(coarse), 0.5);
  EXPECT_LE(widest(fine), 0.15);
  EXPECT_EQ(fine.frame().origin, coarse.frame().origin);
  EXPECT_NEAR(volumeProperties(fine.surface().mesh()).volume,
              volumeProperties(coarse.surface().mesh()).volume, 1e-12);
  EXPECT_NEAR(surfaceArea(fine.surface().mesh()), surfaceArea(coarse.surface().mesh()), 1e-12);
  const std::vector<Vec3>& before = coarse.surface().mesh().vertices;
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(fine.surface().mesh().vertices[i], before[i]);
}

TEST(Subdivide, LeavesFineMeshesAlone) {
  const StarShape shape = testing::starShape(icosphere(4), Vec3(0, 0, 0));
  EXPECT_EQ(&subdivide(shape, 0.12).mesh(), &shape.mesh());
}

}  // namespace
}  // namespace polestar
