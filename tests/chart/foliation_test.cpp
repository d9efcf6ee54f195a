#include "polestar/chart/foliation.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "chart/cone.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

using testing::radialCone;

double signedVolume(const Foliation& f, std::size_t id) {
  const auto c = f.cell(id);
  const Vec3& a = f.nodes[c[0]];
  return (f.nodes[c[1]] - a).dot((f.nodes[c[2]] - a).cross(f.nodes[c[3]] - a)) / 6;
}

TEST(Foliation, CellsOfACone) {
  const Foliation f = radialCone(smoothStar(2), {1, 0.8, 0.5, 0.1});
  const CellCounts counts = countCells(f);
  EXPECT_EQ(counts.cells, (3 * 3 + 1) * f.triangles.size());
  EXPECT_EQ(counts.bad(), 0u);
  // They fill the solid: signed volumes telescope to the enclosed one, whatever the inner nodes are.
  double sum = 0;
  for (std::size_t id = 0; id < f.cellCount(); ++id) sum += signedVolume(f, id);
  TriMesh surface{{f.nodes.begin(), f.nodes.begin() + static_cast<std::ptrdiff_t>(f.vertexCount)},
                  f.triangles};
  EXPECT_NEAR(sum, volumeProperties(surface).volume, 1e-12);
}

TEST(Foliation, NeighboursShareWholeFaces) {
  const Foliation f = radialCone(icosphere(1), {1, 0.6, 0.2});
  std::map<std::set<std::uint32_t>, int> faces;
  for (std::size_t id = 0; id < f.cellCount(); ++id) {
    const auto c = f.cell(id);
    for (int skip = 0; skip < 4; ++skip) {
      std::set<std::uint32_t> face(c.begin(), c.end());
      face.erase(c[skip]);
      ++faces[face];
    }
  }
  std::size_t boundary = 0;
  for (const auto& [face, count] : faces) {
    EXPECT_LE(count, 2);
    boundary += count == 1;
  }
  EXPECT_EQ(boundary, f.triangles.size());
}

TEST(Foliation, KnowsLayerAndTriangleOfACell) {
  const Foliation f = radialCone(icosphere(1), {1, 0.6, 0.2});
  for (std::size_t id = 0; id < f.cellCount(); ++id) {
    const Triangle& t = f.triangles[f.triangleOf(id)];
    for (const std::uint32_t node : f.cell(id)) {
      if (node == f.centerNode()) {
        EXPECT_EQ(f.layerOf(id), f.layerCount());
        continue;
      }
      const auto vertex = static_cast<std::int32_t>(node % f.vertexCount);
      EXPECT_TRUE(vertex == t[0] || vertex == t[1] || vertex == t[2]);
      const std::size_t level = node / f.vertexCount;
      EXPECT_TRUE(level == f.layerOf(id) || level == f.layerOf(id) + 1);
    }
  }
}

TEST(Foliation, CountsWhatIsTurnedOverAndWhere) {
  Foliation f = radialCone(icosphere(2), {1, 0.8, 0.5, 0.2});
  f.nodes[f.nodeId(2, 7)] = 1.5 * f.node(0, 7);  // from level 2 through the surface
  const CellCounts counts = countCells(f);
  EXPECT_GT(counts.inverted, 0u);
  EXPECT_EQ(counts.badByLayer[0], 0u);
  EXPECT_GT(counts.badByLayer[1], 0u);
  EXPECT_EQ(counts.badByLayer[3], 0u);

  f = radialCone(icosphere(2), {1, 0.8, 0.5, 0.2});
  f.nodes[f.nodeId(1, 3)] = f.node(0, 3);  // no thickness at all
  EXPECT_GT(countCells(f).flat, 0u);
}

}  // namespace
}  // namespace polestar
