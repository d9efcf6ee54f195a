// `surface` and `density` against brute force: distances to every triangle, and the side by solid angles.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>
#include <numbers>
#include <random>

#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"
#include "vdb/read_vdb.h"

namespace polestar {
namespace {

using test::FileGrid;
using test::Index;
using test::toVec3;

// Distance to a segment and, when the foot of the perpendicular is inside, to the triangle's plane.
double segmentDistance(const Vec3& p, const Vec3& a, const Vec3& b) {
  const double t = std::clamp((p - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
  return (p - a - t * (b - a)).norm();
}

double triangleDistance(const Vec3& p, const Vec3& a, const Vec3& b, const Vec3& c) {
  const Vec3 n = (b - a).cross(c - a);
  const auto leftOf = [&](const Vec3& u, const Vec3& v) { return (v - u).cross(p - u).dot(n) >= 0; };
  if (leftOf(a, b) && leftOf(b, c) && leftOf(c, a)) return std::abs((p - a).dot(n.normalized()));
  return std::min({segmentDistance(p, a, b), segmentDistance(p, b, c), segmentDistance(p, c, a)});
}

double meshDistance(const TriMesh& mesh, const Vec3& p) {
  double distance = 1e300;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    distance =
        std::min(distance, triangleDistance(p, mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)));
  }
  return distance;
}

// Winding number: total solid angle / 4 pi [Van Oosterom, Strackee 1983].
bool encloses(const TriMesh& mesh, const Vec3& p) {
  double angle = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 a = mesh.corner(t, 0) - p, b = mesh.corner(t, 1) - p, c = mesh.corner(t, 2) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle > 2 * std::numbers::pi;
}

FileGrid writtenSurface(const TriMesh& mesh, const GridOptions& options) {
  const test::ScratchFolder folder;
  SolidGrids(mesh, options).write(folder / "a.vdb");
  return test::readVdb(folder / "a.vdb").at("surface");
}

struct BandCheck {
  double worstVoxels = 0;        // |stored - exact distance| in the band, in voxels
  std::size_t missing = 0;       // voxels nearer than the band's width that are not active
  std::size_t wrongSide = 0;     // side by solid angles differs
  std::size_t wrongOutside = 0;  // inactive voxels that do not hold +-band
  std::size_t voxels = 0;
};

// Every voxel of the box, the band around it included.
BandCheck checkBand(const TriMesh& mesh, const GridOptions& options) {
  const FileGrid surface = writtenSurface(mesh, options);
  const double h = options.voxelSize;
  BandCheck check;
  Index low = surface.activeMin, high = surface.activeMax;
  for (int k = 0; k < 3; ++k) {
    --low[k];
    ++high[k];
  }
  test::forEachIndex(low, high, [&](const Index& i) {
    const Vec3 p = surface.origin + h * toVec3(i);
    const float stored = surface.value(i)[0];
    const double exact = meshDistance(mesh, p);
    ++check.voxels;
    if (surface.active(i)) {
      check.worstVoxels = std::max(check.worstVoxels, std::abs(std::abs(stored) - exact) / h);
    } else {
      check.missing += exact < h * options.halfWidth * (1 - 1e-6);
      check.wrongOutside += std::abs(stored) != surface.background[0];
    }
    if (exact > 1e-6 * h) check.wrongSide += (stored < 0) != encloses(mesh, p);
  });
  return check;
}

void expectExact(const TriMesh& mesh, const GridOptions& options) {
  const BandCheck check = checkBand(mesh, options);
  EXPECT_GT(check.voxels, 1000u);
  EXPECT_LT(check.worstVoxels, 2e-6) << "single precision of the stored value is what may be lost";
  EXPECT_EQ(check.missing, 0u);
  EXPECT_EQ(check.wrongSide, 0u);
  EXPECT_EQ(check.wrongOutside, 0u);
}

TriMesh turned(const TriMesh& mesh) {
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(1, 2, -0.5).normalized()).toRotationMatrix();
  return transformed(mesh, [&](const Vec3& v) -> Vec3 { return turn * v; });
}

TEST(LevelSet, IsTheExactDistanceToAFineMesh) {
  const TriMesh mesh = turned(smoothStar(3));
  expectExact(mesh, {.voxelSize = voxelSizeFor(mesh, 24)});
}

TEST(LevelSet, IsTheExactDistanceToTrianglesLargerThanTheBand) {
  const TriMesh mesh = turned(cube(1));
  expectExact(mesh, {.voxelSize = voxelSizeFor(mesh, 30), .halfWidth = 5});
}

TEST(LevelSet, IsTheExactDistanceToTrianglesSmallerThanAVoxel) {
  const TriMesh mesh = turned(icosphere(4));
  expectExact(mesh, {.voxelSize = voxelSizeFor(mesh, 12)});
}

// A disk of 0.6 voxels: hardly a voxel center is inside, both walls share every voxel.
TEST(LevelSet, KeepsTheSideInABladeThinnerThanAVoxel) {
  const TriMesh blade =
      transformed(icosphere(3), [](const Vec3& v) { return Vec3(v.x(), v.y(), 0.025 * v.z()); });
  expectExact(turned(blade), {.voxelSize = 2.0 / 24});
}

// Radial slots, open to the outside by half a voxel to three: a flood from outside cannot enter most of their
// length.
TEST(LevelSet, KeepsTheSideInSlotsThinnerThanAVoxel) {
  const TriMesh slotted = radialShape(4, [](const Vec3& d) {
    const double slot =
        std::pow(std::abs(std::sin(2 * std::atan2(d.y(), d.x()))), 0.5) * std::hypot(d.x(), d.y());
    return 0.35 + 0.65 * std::min(1.0, 2 * slot) * (1 - d.z() * d.z());
  });
  expectExact(turned(slotted), {.voxelSize = 2.0 / 26});
}

// Voxel centers lie in the planes of faces and on edges and vertices: parity must not count an edge twice.
TEST(LevelSet, KeepsTheSideWhereCentersLieOnFacesEdgesAndVertices) {
  const TriMesh mesh = transformed(cube(4), [](const Vec3& v) -> Vec3 { return 4.5 * v; });
  // Box [-4.5, 4.5]: centers at -4, -3, ... meet the inner edges and the diagonals of all squares.
  const FileGrid surface = writtenSurface(mesh, {.voxelSize = 1});
  std::size_t inside = 0;
  test::forEachIndex({-4, -4, -4}, {13, 13, 13}, [&](const Index& i) { inside += surface.value(i)[0] < 0; });
  EXPECT_EQ(inside, 9u * 9u * 9u);

  // The same cube half a voxel larger: its faces pass through centers, which then are on the surface, not
  // inside.
  const FileGrid onCenters = writtenSurface(cube(4), {.voxelSize = 2.0 / 4.5});
  test::forEachIndex({-3, -3, -3}, {7, 7, 7}, [&](const Index& i) {
    const Vec3 p = onCenters.origin + (2.0 / 4.5) * toVec3(i);
    const double reach = p.cwiseAbs().maxCoeff();
    if (std::abs(reach - 1) < 1e-9) return;
    EXPECT_EQ(onCenters.value(i)[0] < 0, reach < 1) << p.transpose();
  });
}

TEST(LevelSet, OfASphereIsItsRadius) {
  const TriMesh mesh = icosphere(5);
  const double h = voxelSizeFor(mesh, 32);
  const FileGrid surface = writtenSurface(mesh, {.voxelSize = h});
  // The polyhedron lies between the sphere and its own inscribed ball.
  double inscribed = 1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    inscribed = std::min(inscribed, areaVector(mesh, t).normalized().dot(mesh.corner(t, 0)));
  }
  std::size_t active = 0;
  test::forEachIndex(surface.activeMin, surface.activeMax, [&](const Index& i) {
    if (!surface.active(i)) return;
    ++active;
    const double exact = (surface.origin + h * toVec3(i)).norm() - 1, error = surface.value(i)[0] - exact;
    EXPECT_GT(error, -1e-6);
    EXPECT_LT(error, 1 - inscribed + 1e-6);
  });
  EXPECT_EQ(active, surface.activeCount);
  EXPECT_LT(1 - inscribed, 5e-4) << "or the mesh says little about the sphere";
  EXPECT_FLOAT_EQ(surface.background[0], static_cast<float>(3 * h));
}

TEST(SolidGrids, InsideVoxelsFillTheVolume) {
  const TriMesh mesh = turned(smoothStar(4));
  const double volume = volumeProperties(mesh).volume;
  for (const int dim : {16, 32, 64}) {
    const SolidGrids grids(mesh, {.voxelSize = voxelSizeFor(mesh, dim)});
    const double counted = static_cast<double>(grids.insideVoxels()) * std::pow(grids.voxelSize(), 3);
    // Lattice points in a smooth body: errors at random on the surface's voxels, so as the root of their
    // number.
    const double surfaceVoxels = surfaceArea(mesh) / std::pow(grids.voxelSize(), 2);
    EXPECT_NEAR(counted, volume, 3 * std::sqrt(surfaceVoxels) * std::pow(grids.voxelSize(), 3)) << dim;
    EXPECT_GT(grids.activeVoxels(), grids.insideVoxels());
  }
  EXPECT_EQ(SolidGrids(cube(2), {.voxelSize = voxelSizeFor(cube(2), 20)}).insideVoxels(), 8000u);
}

TEST(Density, RampsAcrossTheSurface) {
  const test::ScratchFolder folder;
  const TriMesh mesh = turned(smoothStar(4));
  const double h = voxelSizeFor(mesh, 40);
  SolidGrids(mesh, {.voxelSize = h}).write(folder / "a.vdb");
  const auto grids = test::readVdb(folder / "a.vdb");
  const FileGrid &surface = grids.at("surface"), &density = grids.at("density");
  EXPECT_EQ(density.background[0], 0);
  std::size_t between = 0;
  test::forEachIndex(surface.activeMin, surface.activeMax, [&](const Index& i) {
    const double voxels = surface.value(i)[0] / h, value = density.value(i)[0];
    EXPECT_NEAR(value, std::clamp(0.5 - 0.5 * voxels, 0.0, 1.0), 1e-6);
    EXPECT_EQ(density.active(i), value > 0);
    between += value > 0 && value < 1;
  });
  EXPECT_GT(between, 5000u);
}

// A ramp h deep on both sides is the mean of the solids offset by -h .. h: of a ball of radius 1, mass V (1 +
// h^2).
TEST(Density, KeepsTheMass) {
  const test::ScratchFolder folder;
  const TriMesh ball = icosphere(5);
  const double h = voxelSizeFor(ball, 30);
  SolidGrids(ball, {.voxelSize = h}).write(folder / "a.vdb");
  const FileGrid density = test::readVdb(folder / "a.vdb").at("density");
  double mass = 0;
  test::forEachIndex(density.activeMin, density.activeMax,
                     [&](const Index& i) { mass += density.value(i)[0] * h * h * h; });
  EXPECT_NEAR(mass / volumeProperties(ball).volume, 1 + h * h, 3e-4);
}

}  // namespace
}  // namespace polestar
