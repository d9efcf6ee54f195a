// Cubes of a domain's lattice: their colors at known places, in the domain and in solids, and lines between
// them.
#include "polestar/render/lattice.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/io/picture.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/similarity_map.h"
#include "polestar/render/iso_lines.h"
#include "polestar/render/mapped_appearance.h"

namespace polestar {
namespace {

Polycube plus() { return verifyPolycube({{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}); }

Vec3f colorAt(const Lattice& lattice, const Vec3& place, const Mat3& footprint = Mat3::Zero()) {
  const TexturePoint point{place, footprint};
  TextureSample sample;
  makeLatticeTexture(lattice)->sample({&point, 1}, {&sample, 1});
  return sample.color;
}

/// In shades of the tint at a place: 1 for light cubes.
float shadeAt(const Lattice& lattice, const Vec3& place, const Mat3& footprint = Mat3::Zero()) {
  const Vec3f color = colorAt(lattice, place, footprint);
  Vec3f tint;
  for (int k = 0; k < 3; ++k) tint[k] = linearFromSrgbValue(static_cast<float>(0.7 + 0.29 * place[k]));
  EXPECT_NEAR(color[0] / tint[0], color[2] / tint[2], 1e-5);
  return color[0] / tint[0];
}

TEST(Lattice, CubesAreOddDivisionsOfCells) {
  EXPECT_EQ(latticeOf(cubeDomain()).divisions, 7);
  EXPECT_EQ(latticeOf(plus()).divisions, 3);
  std::vector<Cell> row;
  for (int i = -3; i <= 3; ++i) row.push_back({i, 0, 0});
  EXPECT_EQ(latticeOf(verifyPolycube(row)).divisions, 1);
  EXPECT_DOUBLE_EQ(latticeOf(plus()).side(), 2.0 / 9);
}

TEST(Lattice, EveryOtherCubeIsAShadeDeeper) {
  const Lattice lattice{.polycube = plus(), .divisions = 1};
  const double side = lattice.side();
  for (int i = -1; i <= 1; ++i) {
    for (int j = -1; j <= 1; ++j) {
      const Vec3 middle(side * i, side * j, 0), beside(0.3 * side, -0.4 * side, 0.45 * side);
      const float expected = (i + j) % 2 == 0 ? 1.0f : 0.55f;
      EXPECT_NEAR(shadeAt(lattice, middle), expected, 1e-5);
      EXPECT_NEAR(shadeAt(lattice, middle + beside), expected, 1e-5);
    }
  }
  // Places differ where the pattern is the same.
  EXPECT_GT(colorAt(lattice, {side, side, 0})[0], colorAt(lattice, {-side, side, 0})[0]);
}

TEST(Lattice, FootprintsAverageCubes) {
  const Lattice lattice{.polycube = plus(), .divisions = 1};
  const double side = lattice.side();
  Mat3 footprint = Mat3::Zero();
  footprint.col(0) = side * Vec3::UnitX();
  EXPECT_NEAR(shadeAt(lattice, {0.5 * side, 0, 0}, footprint), 0.775, 1e-4);
  // A quarter of it lies in the next cube.
  EXPECT_NEAR(shadeAt(lattice, {0.25 * side, 0, 0}, footprint), 0.75 + 0.25 * 0.55, 1e-4);
  footprint.col(0) *= 40;
  EXPECT_NEAR(shadeAt(lattice, {0.1 * side, 0, 0}, footprint), 0.775, 0.01);
}

TEST(Lattice, PlacesOnTheSurfaceBelongToTheCellBelow) {
  const Lattice lattice{.polycube = plus(), .divisions = 1};
  const double half = 0.5 * lattice.side();
  for (const double rounding : {-1e-7, 0.0, 1e-7}) {
    const Vec3 onFace(3 * half + rounding, 0.2 * half, -0.3 * half);
    EXPECT_EQ(lattice.cellAt(Lattice::insideSurface(onFace)), (Cell{1, 0, 0}));
    EXPECT_NEAR(shadeAt(lattice, Lattice::insideSurface(onFace)), 0.55, 1e-4);
  }
}

double linesAt(const Lattice& lattice, const Vec3& place, const Vec3& first, const Vec3& second, bool skin) {
  IsoLines lines;
  lines.lattice = true;
  lines.pixels = 2;
  return latticeLineCoverage(lines, lattice, {place, first, second, skin}, 1);
}

TEST(Lattice, LinesAreBolderAtEdgesOfTheDomain) {
  const Lattice lattice{.polycube = plus(), .divisions = 1, .straight = true};
  const double half = 0.5 * lattice.side(), pixel = half / 50;
  const Vec3 first = pixel * Vec3::UnitX(), second = pixel * Vec3::UnitY();
  const auto top = [&](double x, double y) { return Vec3(x * half, y * half, half); };
  const auto onTop = [&](double x, double y) { return linesAt(lattice, top(x, y), first, second, true); };
  EXPECT_EQ(onTop(0.3, 0.4), 0) << "the face itself lies in a plane of the lattice";
  EXPECT_NEAR(onTop(1, 0.4), 1, 1e-6);
  // 1.3 pixels off: beyond a line of 2 pixels, within one of 3.4.
  EXPECT_LT(onTop(1 - 0.026, 0.4), 0.25);
  EXPECT_GT(onTop(3 - 0.026, 0.4), 0.8) << "convex";
  EXPECT_LT(onTop(1.6, 0.2), 1e-6);
  // On the side of the cell {1, 0, 0} that looks along y, next to the cell {0, 1, 0}: a reentrant edge.
  const Vec3 beside((1 + 0.026) * half, half, 0.3 * half), along = pixel * Vec3::UnitZ();
  EXPECT_GT(linesAt(lattice, beside, first, along, true), 0.8);
  // A cut has no edges.
  EXPECT_LT(linesAt(lattice, {(3 - 0.026) * half, 0.4 * half, 0.1}, first, second, false), 0.25);
}

/// Where the solid is smooth, places go as powers of the distance from edges: lines keep their width.
TEST(Lattice, LinesKeepTheirWidthWhereCoordinatesBend) {
  const Lattice lattice{.polycube = cubeDomain(), .divisions = 1};
  const auto coverageAt = [&](double pixels) {  // from the edge x = 1, on the face z = 1
    const double reach = 60;                    // pixels over which x falls from 1 to 0
    const double x = 1 - std::sqrt(pixels / reach), slope = 0.5 / std::sqrt(pixels * reach);
    return linesAt(lattice, {x, 0.2, 1}, -slope * Vec3::UnitX(), Vec3::UnitY() / reach, true);
  };
  for (const double pixels : {0.05, 0.3, 0.6, 1.0}) EXPECT_GT(coverageAt(pixels), 0.95) << pixels;
  for (const double pixels : {2.4, 4.0, 10.0}) EXPECT_LT(coverageAt(pixels), 0.01) << pixels;
}

/// The look of a small patch around a point.
SurfaceLook lookAt(const Appearance& appearance, const Vec3& point, const Vec3& normal, double pixel,
                   bool skin) {
  SurfacePatch patch;
  patch.point = point;
  patch.normal = normal;
  patch.first = normal.unitOrthogonal();
  patch.second = normal.cross(patch.first);
  patch.pixelFirst = patch.pixelSecond = pixel;
  patch.skin = skin;
  const SurfaceTap tap;
  SurfaceLook look;
  appearance.look({&patch, 1}, {&tap, 1}, 1, {&look, 1});
  return look;
}

TEST(Lattice, ADomainTurnedAndMovedHasTheColorsOfItsPlaces) {
  const SimilarityMap placed(Vec3(3, -7, 2), rotationXyz({20, -35, 50}), 4);
  const Lattice lattice = latticeOf(cubeDomain());
  const auto appearance = makeMappedAppearance(
      placed, nullptr, latticeLook(lattice, 2),
      DomainCoordinates{lattice, [&](auto points, auto, auto places) { placed.forward(points, places); }});
  EXPECT_LT((appearance->center() - Vec3(3, -7, 2)).norm(), 1e-12);
  for (const Vec3& place :
       {Vec3(0.02, 0.01, 0), Vec3(0.3, -0.55, 0.6), Vec3(1, 0.3, -0.28), Vec3(-0.9, -1, 0.9)}) {
    const bool skin = place.lpNorm<Eigen::Infinity>() == 1;
    const Vec3 face = skin ? Vec3(place.array().abs().floor() * place.array()) : Vec3(Vec3::UnitZ());
    const SurfaceLook look = lookAt(*appearance, placed.toWorld(place),
                                    placed.toWorld(face) - placed.toWorld(Vec3::Zero()), 1e-4, skin);
    ASSERT_TRUE(look.known);
    const Vec3f expected = colorAt(lattice, skin ? Lattice::insideSurface(place) : place);
    EXPECT_LT((look.color - expected).norm(), 1e-3) << place.transpose();
  }
}

TEST(Lattice, LooksByADomainNeedOne) {
  const SimilarityMap ball(Vec3::Zero(), Mat3::Identity(), 1);
  EXPECT_THROW(makeMappedAppearance(ball, nullptr, latticeLook(latticeOf(cubeDomain()), 2)), Error);
  MappedLook lines = plainLook();
  lines.lines.lattice = true;
  EXPECT_THROW(makeMappedAppearance(ball, nullptr, lines), Error);
}

TEST(Lattice, PicturesSideBySideKeepTheirPixels) {
  Picture a(2, 3), b(4, 3);
  for (int y = 0; y < 3; ++y) {
    for (int x = 0; x < 4; ++x) {
      if (x < 2) a.pixel(x, y)[0] = static_cast<float>(10 * y + x);
      b.pixel(x, y)[2] = static_cast<float>(100 + 10 * y + x);
    }
  }
  const Picture row = sideBySide({a, b});
  ASSERT_EQ(row.width, 6);
  ASSERT_EQ(row.height, 3);
  EXPECT_EQ(row.pixel(1, 2)[0], 21);
  EXPECT_EQ(row.pixel(2, 0)[2], 100);
  EXPECT_EQ(row.pixel(5, 2)[2], 123);
  EXPECT_THROW(sideBySide({a, Picture(2, 4)}), Error);
  EXPECT_THROW(sideBySide({}), Error);
}

}  // namespace
}  // namespace polestar
