// The opponents, held to answers that are known: one that loses because it was written badly here would prove
// nothing.

#include "peers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "galaxy_maps.h"
#include "measures.h"
#include "pages.h"
#include "polestar/mesh/shapes.h"
#include "support/scratch_folder.h"
#include "support/solids.h"
#include "tetgen.h"

namespace polestar::bench {
namespace {

/// The polyhedron of a sphere with its center inside, in one cone of tetrahedra a triangle, cut at half
/// the height: vertices on the surface, halfway, in the middle.
TetMesh shells(const TriMesh& surface) {
  TetMesh mesh;
  mesh.vertices = surface.vertices;
  mesh.surfaceVertices = surface.vertices.size();
  for (const Vec3& v : surface.vertices) mesh.vertices.push_back(0.5 * v);
  mesh.vertices.emplace_back(Vec3::Zero());
  const auto n = static_cast<std::int32_t>(surface.vertices.size());
  for (Triangle t : surface.triangles) {
    // Smallest index first: neighbours then cut the quadrilateral between them along the same diagonal.
    std::sort(t.begin(), t.end());
    const auto [a, b, c] = t;
    mesh.tetrahedra.push_back({a, b, c, n + c});
    mesh.tetrahedra.push_back({a, b, n + b, n + c});
    mesh.tetrahedra.push_back({a, n + a, n + b, n + c});
    mesh.tetrahedra.push_back({n + a, n + b, n + c, 2 * n});
  }
  return mesh;
}

TEST(RadialCone, ScalesEveryRayToLengthOne) {
  const StarShape shape = testing::starShape(
      transformed(icosphere(2), [](const Vec3& v) { return Vec3(2 * v[0], v[1], 0.5 * v[2]); }),
      Vec3(0, 0, 0));
  const TetMesh mesh = shells(shape.mesh());
  const std::vector<Vec3> image = imagesByCone(mesh, shape.mesh());
  const std::size_t n = mesh.surfaceVertices;
  for (std::size_t v = 0; v < n; ++v) {
    EXPECT_LT((image[v] - mesh.vertices[v].normalized()).norm(), 1e-12);
    EXPECT_LT((image[n + v] - 0.5 * mesh.vertices[v].normalized()).norm(), 1e-12);
  }
  EXPECT_EQ(image.back(), Vec3::Zero());
  EXPECT_EQ(measureTetrahedra(mesh, image).inverted, 0U);
}

TEST(HarmonicMap, IsLinearWhereTheBoundaryIs) {
  const TetMesh mesh = shells(icosphere(2));
  Mat3 matrix;
  matrix << 0.9, 0.1, 0, -0.1, 0.7, 0.05, 0, 0.1, 0.8;
  std::vector<Vec3> boundary;
  for (std::size_t v = 0; v < mesh.surfaceVertices; ++v) boundary.push_back(matrix * mesh.vertices[v]);
  const std::vector<Vec3> image = imagesByHarmonicMap(mesh, boundary);
  for (std::size_t v = 0; v < image.size(); ++v)
    EXPECT_LT((image[v] - matrix * mesh.vertices[v]).norm(), 1e-7);
}

TEST(OurImages, AreTheMapInsideAndPhiOnTheSurface) {
  const StarShape shape = testing::starShape(
      transformed(smoothStar(2), [](const Vec3& v) { return Vec3(3 * v + Vec3(7, 8, 9)); }));
  const BallMap map = testing::ballMap(shape);
  const StarShape& cut = map.chart().green().shape();
  const TetMesh mesh = shells(cut.mesh());
  const std::vector<Vec3> image = imagesByMap(mesh, map);
  EXPECT_EQ(image[5], map.sphere().directions[5]);
  const std::size_t inside = mesh.surfaceVertices + 5;
  std::vector<Vec3> there(1);
  const std::vector<Vec3> here{cut.frame().toWorld(mesh.vertices[inside])};
  map.forward(here, there);
  EXPECT_EQ(image[inside], there[0]);
  EXPECT_EQ(image.back(), Vec3::Zero());
}

/// A stand-in for the program, a script, and the variable that names it.
class GalaxyMaps : public ::testing::Test {
 protected:
  void program(const std::string& script) {
    const std::filesystem::path path = folder_ / "galaxy_map";
    std::ofstream(path) << "#!/bin/sh\n" << script;
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    setenv("POLESTAR_GALAXY_MAPS", folder_.path().c_str(), 1);
  }
  void TearDown() override { unsetenv("POLESTAR_GALAXY_MAPS"); }

  test::ScratchFolder folder_;
  TetMesh mesh_ = shells(icosphere(0));
};

TEST_F(GalaxyMaps, AreGivenBothMeshesAndTheirAnswerIsRead) {
  program("[ \"$3\" = -o ] && cp \"$1\" \"$4_object.vtk\" && cp \"$2\" \"$4_parameter.vtk\"\n");
  std::vector<Vec3> image;
  for (const Vec3& v : mesh_.vertices) image.push_back(v / 3);
  ASSERT_TRUE(galaxyMapsProgram());
  const std::optional<GalaxyMap> answer = repairByGalaxyMaps(*galaxyMapsProgram(), mesh_, image, 10);
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->mesh.vertices, mesh_.vertices) << "to the last bit";
  EXPECT_EQ(answer->mesh.tetrahedra, mesh_.tetrahedra);
  EXPECT_EQ(answer->image, image);
}

TEST_F(GalaxyMaps, AreStoppedAndTheirFailuresTold) {
  program("sleep 20\n");
  EXPECT_FALSE(repairByGalaxyMaps(*galaxyMapsProgram(), mesh_, mesh_.vertices, 1));
  program("exit 1\n");
  EXPECT_THROW(repairByGalaxyMaps(*galaxyMapsProgram(), mesh_, mesh_.vertices, 10), std::runtime_error);
  unsetenv("POLESTAR_GALAXY_MAPS");
  EXPECT_FALSE(galaxyMapsProgram());
}

}  // namespace
}  // namespace polestar::bench
