// Closed or not, hollow or not: whatever the number of parts and handles.
#include "polestar/mesh/edge_pairs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "mesh/bodies.h"
#include "polestar/mesh/shapes.h"

namespace polestar::testing {
namespace {

TriMesh united(TriMesh a, const TriMesh& b) {
  const auto first = static_cast<std::int32_t>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  return a;
}

TriMesh turned(TriMesh mesh) {
  for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

TEST(EdgePairs, AreThoseOfClosedSurfaces) {
  EXPECT_TRUE(edgesPair(icosphere(3)));
  EXPECT_TRUE(edgesPair(torus()));
  EXPECT_TRUE(edgesPair(united(torus(), turned(icosphere(2)))));
  EXPECT_FALSE(edgesPair(TriMesh{}));
  TriMesh open = icosphere(3);
  open.triangles.erase(open.triangles.begin() + 7);
  EXPECT_FALSE(edgesPair(open));
  TriMesh flipped = icosphere(3);
  std::swap(flipped.triangles[5][0], flipped.triangles[5][1]);
  EXPECT_FALSE(edgesPair(flipped));
  TriMesh renumbered = icosphere(3);
  std::reverse(renumbered.triangles.begin(), renumbered.triangles.end());
  EXPECT_TRUE(edgesPair(renumbered));
}

TEST(Cavities, ArePartsThatFaceTheOtherWay) {
  const TriMesh small = transformed(icosphere(2), [](const Vec3& v) -> Vec3 { return 0.4 * v; });
  const TriMesh aside = transformed(icosphere(2), [](const Vec3& v) -> Vec3 { return v + Vec3(1e4, 0, 0); });
  EXPECT_FALSE(hasCavities(icosphere(3)));
  EXPECT_FALSE(hasCavities(united(icosphere(3), aside)));
  EXPECT_TRUE(hasCavities(united(icosphere(3), turned(small))));
  EXPECT_TRUE(hasCavities(turned(united(icosphere(3), turned(small)))));
}

}  // namespace
}  // namespace polestar::testing
