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

TEST(Bisect, CutsWhatIsMarkedOnceAndKeepsTheSolid) {
  const StarShape shape = testing::starShape(cube(2));
  std::vector<char> marked(shape.mesh().triangles.size(), 0);
  marked[5] = 1;
  const std::optional<RefinedShape> finer = bisect(shape, marked);
  ASSERT_TRUE(finer);
  const std::vector<Vec3>&before = shape.mesh().vertices, &after = finer->shape.mesh().vertices;
  ASSERT_EQ(after.size(), before.size() + finer->parents.size());
  EXPECT_EQ(finer->parents.size(), 1u);  // both triangles at the diagonal, and no other edge
  EXPECT_EQ(finer->shape.mesh().triangles.size(), shape.mesh().triangles.size() + 2);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_EQ(after[i], before[i]);
  const auto [a, b] = finer->parents[0];
  EXPECT_LT((after.back() - 0.5 * (before[a] + before[b])).norm(), 1e-15);
  EXPECT_EQ(finer->shape.frame().origin, shape.frame().origin);
  EXPECT_EQ(finer->shape.frame().unit, shape.frame().unit);
}

}  // namespace
}  // namespace polestar
