// The shapes in volumes/: the files are what the formulas make, and what a map needs.

#include "volumes/volumes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "polestar/core/predicates.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/shapes.h"
#include "polestar/mesh/write_mesh.h"
#include "polestar/vdb/sampled_grids.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

std::string fileBytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

const fs::path kFolder = POLESTAR_VOLUMES_FOLDER;

/// 1 for an equilateral triangle, 0 for a degenerate one.
double triangleQuality(const TriMesh& mesh, std::size_t t) {
  double squares = 0;
  for (int k = 0; k < 3; ++k) squares += (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).squaredNorm();
  return 2 * std::sqrt(3.0) * areaVector(mesh, t).norm() / squares;
}

class ShippedVolume : public ::testing::TestWithParam<Volume> {};

TEST_P(ShippedVolume, FileIsWhatTheFormulaMakes) {
  const Volume& volume = GetParam();
  const fs::path made = fs::path(::testing::TempDir()) / ("polestar_made_" + volume.file);
  writeMesh(made, volume.make(), volume.comment);
  EXPECT_TRUE(fileBytes(made) == fileBytes(kFolder / volume.file))
      << "write it anew with generate_volumes, and say why in the commit";
  fs::remove(made);
}

TEST_P(ShippedVolume, IsAStarShapedSolid) {
  const Volume& volume = GetParam();
  const TriMesh mesh = readMesh(kFolder / volume.file).mesh;
  const SurfaceReport report = inspectSurface(mesh);
  EXPECT_TRUE(report.valid) << report.defect;
  std::size_t hidden = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto& v = mesh.vertices;
    hidden += orient3d(v[t[0]], v[t[1]], v[t[2]], volume.center) >= 0;
  }
  EXPECT_EQ(hidden, 0u) << "faces that the center does not see from inside";
}

TEST_P(ShippedVolume, HasNoSlivers) {
  const TriMesh mesh = readMesh(kFolder / GetParam().file).mesh;
  std::vector<double> quality;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) quality.push_back(triangleQuality(mesh, t));
  std::sort(quality.begin(), quality.end());
  EXPECT_GT(quality.front(), 0.2);
  EXPECT_GT(quality[quality.size() / 100], 0.5);
  // Neighbours of about one size: lengths of edges at a vertex.
  std::map<std::int32_t, std::pair<double, double>> lengths;
  for (const Triangle& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) {
      const double length = (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm();
      auto& [shortest, longest] = lengths.try_emplace(t[k], length, length).first->second;
      shortest = std::min(shortest, length);
      longest = std::max(longest, length);
    }
  }
  double worst = 1;
  for (const auto& [vertex, range] : lengths) worst = std::max(worst, range.second / range.first);
  EXPECT_LT(worst, 6);
}

TEST_P(ShippedVolume, IsSmallAndInTheReadme) {
  EXPECT_LE(fs::file_size(kFolder / GetParam().file), 600'000u);
  EXPECT_THAT(fileBytes(kFolder / "README.md"), ::testing::HasSubstr("| `" + GetParam().file + "` |"));
}

INSTANTIATE_TEST_SUITE_P(Volumes, ShippedVolume, ::testing::ValuesIn(shippedVolumes()), [](const auto& test) {
  std::string name = test.param.file;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
});

TEST(Volumes, FolderHoldsNothingElse) {
  std::size_t meshes = 0;
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::directory_iterator(kFolder)) {
    const std::string extension = entry.path().extension();
    if (extension != ".ply" && extension != ".obj") continue;
    ++meshes;
    bytes += entry.file_size();
  }
  EXPECT_EQ(meshes, shippedVolumes().size());
  EXPECT_LE(bytes, 3'000'000u);
}

TEST(Bodies, GeodesicSphereCountsAndRadius) {
  for (const int frequency : {1, 2, 5}) {
    const TriMesh mesh = geodesicSphere(frequency);
    EXPECT_EQ(mesh.vertices.size(), 10u * frequency * frequency + 2);
    EXPECT_EQ(mesh.triangles.size(), 20u * frequency * frequency);
    EXPECT_TRUE(inspectSurface(mesh).valid);
    for (const Vec3& v : mesh.vertices) EXPECT_NEAR(v.norm(), 1, 1e-15);
  }
}

TEST(Bodies, SubdividingKeepsTheSurface) {
  const TriMesh base = starPolyhedron(1), fine = subdivided(base, 4);
  EXPECT_EQ(fine.triangles.size(), 16 * base.triangles.size());
  EXPECT_NEAR(surfaceArea(fine), surfaceArea(base), 1e-12);
  EXPECT_NEAR(volumeProperties(fine).volume, volumeProperties(base).volume, 1e-12);
}

TEST(Bodies, StarPolyhedronIsASmallStellatedDodecahedron) {
  // Its 60 triangles lie by fives in 12 planes; edge of the pentagrams a has circumradius a (1 + sqrt 5) / 4
  // * ...: here the planes are found from the mesh and counted.
  const TriMesh mesh = starPolyhedron(1);
  ASSERT_EQ(mesh.triangles.size(), 60u);
  std::vector<std::pair<Vec3, int>> planes;
  for (std::size_t t = 0; t < 60; ++t) {
    const Vec3 normal = areaVector(mesh, t).normalized();
    const Vec3 foot = normal.dot(mesh.corner(t, 0)) * normal;
    const auto same = std::find_if(planes.begin(), planes.end(),
                                   [&](const auto& plane) { return (plane.first - foot).norm() < 1e-5; });
    if (same == planes.end()) {
      planes.emplace_back(foot, 1);
    } else {
      ++same->second;
    }
  }
  EXPECT_EQ(planes.size(), 12u);
  for (const auto& [foot, count] : planes) EXPECT_EQ(count, 5);
}

TEST(Bodies, RelaxingStaysOnTheSurfaceAndEvensTheTriangles) {
  auto radius = [](const Vec3& w) { return 1 / Vec3(w[0] / 2, w[1], w[2] / 0.7).norm(); };
  auto areaRatio = [](const TriMesh& mesh) {
    double least = 1e300, most = 0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      EXPECT_GT(triangleQuality(mesh, t), 0.7);
      least = std::min(least, areaVector(mesh, t).norm());
      most = std::max(most, areaVector(mesh, t).norm());
    }
    return most / least;
  };
  const TriMesh relaxed = relaxedRadialShape(10, radius);
  EXPECT_GT(areaRatio(relaxedRadialShape(10, radius, {}, 0)), 6);
  EXPECT_LT(areaRatio(relaxed), 3);
  for (const Vec3& v : relaxed.vertices) EXPECT_NEAR(Vec3(v[0] / 2, v[1], v[2] / 0.7).norm(), 1, 1e-12);
}

TEST(Bodies, DensityMakesEdgesShorter) {
  auto sphere = [](const Vec3&) { return 1.0; };
  const TriMesh mesh = relaxedRadialShape(
      12, sphere, [](const Vec3& p) { return p[2] > 0 ? 4.0 : 1.0; }, 100);
  const auto up =
      std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const Vec3& v) { return v[2] > 0; });
  EXPECT_GT(up, 0.58 * mesh.vertices.size());
}

TEST(Bodies, AsteroidDependsOnItsSeedAlone) {
  const TriMesh one = asteroid(6, 3), same = asteroid(6, 3), other = asteroid(6, 4);
  EXPECT_EQ(one.vertices, same.vertices);
  EXPECT_NE(one.vertices, other.vertices);
}

TEST(Bodies, HeadIsSymmetricAndLooksForward) {
  const TriMesh head = stylizedHead(16);
  const Box box = boundingBox(head);
  EXPECT_NEAR(box.min[0], -box.max[0], 0.02);
  // The tip of the nose is what reaches farthest forward; it lies in the middle, below the center.
  const auto tip = std::min_element(head.vertices.begin(), head.vertices.end(),
                                    [](const Vec3& a, const Vec3& b) { return a[1] < b[1]; });
  EXPECT_LT(std::abs((*tip)[0]), 0.1);
  EXPECT_LT((*tip)[2], 0);
  EXPECT_GT((*tip)[2], -0.4);
  EXPECT_GT(box.extent()[2], 2);
}

// Seen from afar: four feet on the floor, a snout in front in the middle, ears on top, one pig in two halves.
TEST(Bodies, PigStandsOnFourFeetAndLooksForward) {
  const TriMesh pig = coinPig(16);
  const Box box = boundingBox(pig);
  EXPECT_NEAR(box.min[0], -box.max[0], 0.02);
  EXPECT_GT(box.extent()[1], 1.3 * box.extent()[0]);
  std::map<std::pair<bool, bool>, int> feet;
  for (const Vec3& v : pig.vertices) {
    if (v[2] < box.min[2] + 0.02) ++feet[{v[0] > 0, v[1] > 0}];
    if (v[1] < box.min[1] + 0.02) {
      EXPECT_LT(std::hypot(v[0], v[2] - 0.1), 0.3) << "of the snout";
    }
    if (v[2] > box.max[2] - 0.02) {
      EXPECT_GT(std::abs(v[0]), 0.3) << "of an ear";
    }
  }
  EXPECT_EQ(feet.size(), 4u);
  for (const Vec3& v : pig.vertices) EXPECT_GT(v.norm(), 0.5);
}

// The sample is what the texture of that name is now.
TEST(SampleTexture, IsWhatTheProgramMakes) {
  const SampledGrids shipped(kFolder / kSampleTexture);
  const SampledGrids made = sampleTexture().lookUp();
  std::vector<Vec3> points;
  for (int i = 0; i < 2000; ++i) {
    const double a = 2.4 * i, z = 1 - (i + 0.5) / 1000, r = 0.75 * std::cbrt(((i * 37) % 2000 + 0.5) / 2000);
    points.emplace_back(r * std::sqrt(1 - z * z) * Vec3(std::cos(a), std::sin(a), 0) + r * Vec3(0, 0, z));
  }
  for (const char* name : {"Cd", "fiber"}) {
    std::vector<Vec3f> before(points.size()), now(points.size());
    std::vector<float> weights(points.size());
    ASSERT_NE(shipped.find(name, true), nullptr);
    shipped.find(name, true)->sample(points, {}, before, weights);
    made.find(name, true)->sample(points, {}, now, weights);
    double mean = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_GT(weights[i], 0.99f);
      mean += (before[i] - now[i]).norm() / static_cast<double>(points.size());
    }
    EXPECT_LT(mean, 2e-3) << name;
  }
}

}  // namespace
}  // namespace polestar
