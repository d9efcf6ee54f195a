// The measures, held to maps whose distortion is known.

#include "measures.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <functional>

#include "polestar/mesh/shapes.h"
#include "support/solids.h"
#include "tet_map.h"

namespace polestar::bench {
namespace {

/// x -> A x of the ball, to wherever A sends it.
class LinearMap final : public VolumeMap {
 public:
  explicit LinearMap(const Mat3& matrix) : matrix_(matrix) {}
  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override {
    for (std::size_t i = 0; i < solid.size(); ++i) domain[i] = matrix_ * solid[i];
  }
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override {
    for (std::size_t i = 0; i < solid.size(); ++i) solid[i] = matrix_.inverse() * domain[i];
  }
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override {
    for (std::size_t i = 0; i < solid.size(); ++i) derivative[i] = matrix_;
  }

 private:
  Mat3 matrix_;
};

/// A cube of side 2 about the origin in 6 n^3 tetrahedra, half of them negatively oriented; those on the
/// surface first.
TetMesh cubeOfTetrahedra(int n) {
  TetMesh mesh;
  std::vector<std::int32_t> id(static_cast<std::size_t>((n + 1) * (n + 1) * (n + 1)));
  const auto at = [&](int i, int j, int k) -> std::int32_t& {
    return id[static_cast<std::size_t>((i * (n + 1) + j) * (n + 1) + k)];
  };
  for (const bool inside : {false, true}) {
    for (int i = 0; i <= n; ++i) {
      for (int j = 0; j <= n; ++j) {
        for (int k = 0; k <= n; ++k) {
          if (inside != (i % n != 0 && j % n != 0 && k % n != 0)) continue;
          at(i, j, k) = static_cast<std::int32_t>(mesh.vertices.size());
          mesh.vertices.push_back(Vec3(i, j, k) * 2.0 / n - Vec3::Ones());
        }
      }
    }
    if (!inside) mesh.surfaceVertices = mesh.vertices.size();
  }
  // Kuhn: along the axes in any order from corner to corner.
  const int orders[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int cell = 0; cell < n * n * n; ++cell) {
    for (const auto& order : orders) {
      Eigen::Vector3i p(cell / (n * n), cell / n % n, cell % n);
      std::array<std::int32_t, 4> t{at(p[0], p[1], p[2])};
      for (int step = 0; step < 3; ++step) {
        ++p[order[step]];
        t[step + 1] = at(p[0], p[1], p[2]);
      }
      mesh.tetrahedra.push_back(t);
    }
  }
  return mesh;
}

std::vector<Vec3> moved(const TetMesh& mesh, const std::function<Vec3(const Vec3&)>& move) {
  std::vector<Vec3> image;
  for (const Vec3& v : mesh.vertices) image.push_back(move(v));
  return image;
}

Mat3 stretch(double a, double b, double c) { return Vec3(a, b, c).asDiagonal(); }

TEST(SolidDistortion, OfASimilarityIsNone) {
  const Mat3 turn = 0.5 * Eigen::AngleAxisd(1, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  const SolidDistortion none =
      measureSolid(LinearMap(turn), latticePoints(testing::starShape(icosphere(2)), 1000), 0);
  EXPECT_GT(none.points, 900U);
  EXPECT_EQ(none.folded, 0U);
  EXPECT_NEAR(none.mips.mean, 1, 1e-12);
  EXPECT_NEAR(none.mips.p99, 1, 1e-12);
  EXPECT_NEAR(none.logVolumeDeviation, 0, 1e-7);
  EXPECT_NEAR(none.skew.p99, 0, 1e-5);
}

TEST(SolidDistortion, OfAStretchIsItsFormula) {
  const std::vector<Vec3> point{Vec3(1, 1, 0)};
  const SolidDistortion stretched = measureSolid(LinearMap(stretch(2, 1, 1)), point, 0);
  EXPECT_NEAR(stretched.mips.mean, (4 + 1 + 1) / (3 * std::pow(2.0, 2.0 / 3)), 1e-12);
  // The image (2, 1, 0) of (1, 1, 0): the radius comes from (1, 1, 0), the sphere's normal is (4, 1, 0).
  const double cosine = Vec3(1, 1, 0).normalized().dot(Vec3(4, 1, 0).normalized());
  EXPECT_NEAR(stretched.skew.mean, std::acos(cosine) * 180 / std::numbers::pi, 1e-9);
  EXPECT_EQ(measureSolid(LinearMap(stretch(2, 1, 1)), point, 10).skew.mean, 0) << "within the core";
}

TEST(SolidDistortion, CountsFoldedAndFlatPoints) {
  const std::vector<Vec3> point{Vec3(1, 1, 0)};
  EXPECT_EQ(measureSolid(LinearMap(stretch(-1, 1, 1)), point, 0).folded, 1U);
  EXPECT_EQ(measureSolid(LinearMap(stretch(1, 1, 1e-17)), point, 0).folded, 1U);
  EXPECT_EQ(measureSolid(LinearMap(stretch(1, 1, 1e-3)), point, 0).folded, 0U);
}

TEST(HexDistortion, AShearIsWorseThanTheIdentityAndAMirrorIsBad) {
  const HexDistortion identity = measureHexahedra(LinearMap(Mat3::Identity()), 8);
  EXPECT_EQ(identity.cells, 6U * 8 * 8 * 8);
  EXPECT_EQ(identity.bad, 0U);
  // At a corner of the cubed sphere three angles of 120 degrees meet.
  EXPECT_NEAR(identity.min, std::sin(2 * std::numbers::pi / 3), 0.02);
  EXPECT_GT(identity.mean, 0.95);
  Mat3 shear = Mat3::Identity();
  shear(0, 1) = 1;
  const HexDistortion sheared = measureHexahedra(LinearMap(shear), 8);
  EXPECT_LT(sheared.p1, identity.p1 - 0.2);
  EXPECT_LT(sheared.mean, identity.mean);
  EXPECT_EQ(measureHexahedra(LinearMap(stretch(-1, 1, 1)), 8).bad, identity.cells);
}

TEST(TetDistortion, OfALinearMapIsItsFormula) {
  const TetMesh mesh = cubeOfTetrahedra(4);
  const Mat3 matrix = stretch(2, 1, 0.5);
  const TetDistortion result =
      measureTetrahedra(mesh, moved(mesh, [&](const Vec3& v) { return Vec3(matrix * v); }));
  EXPECT_EQ(result.tetrahedra, 6U * 64);
  EXPECT_EQ(result.inverted + result.invertedOnSurface, 0U);
  EXPECT_GT(result.onSurface, 0U);
  for (const Spread& spread : {result.mipsBySolid, result.mipsByBall}) {
    EXPECT_NEAR(spread.mean, (4 + 1 + 0.25) / 3, 1e-12);
    EXPECT_NEAR(spread.p99, (4 + 1 + 0.25) / 3, 1e-12);
  }
  EXPECT_NEAR(result.logVolumeDeviation, 0, 1e-7);
}

TEST(TetDistortion, WeighsByTheSolidOrByTheBall) {
  // One half is stretched eightfold along x: an eighth of the solid's weight, all of the ball's but a ninth.
  const TetMesh mesh = cubeOfTetrahedra(2);
  const std::vector<Vec3> image =
      moved(mesh, [](const Vec3& v) { return Vec3(v[0] > 0 ? 8 * v[0] : v[0], v[1], v[2]); });
  const TetDistortion result = measureTetrahedra(mesh, image);
  const double stretched = (64 + 1 + 1) / (3 * std::pow(8.0, 2.0 / 3));
  EXPECT_NEAR(result.mipsBySolid.mean, (1 + stretched) / 2, 1e-12);
  EXPECT_NEAR(result.mipsByBall.mean, (1 + 8 * stretched) / 9, 1e-12);
  EXPECT_NEAR(result.logVolumeDeviation, std::log(8.0) / 2, 1e-12);
}

TEST(TetDistortion, CountsInversionsInsideAndOnTheSurfaceApartAfterRounding) {
  const TetMesh mesh = cubeOfTetrahedra(2);
  std::vector<Vec3> image = mesh.vertices;
  ASSERT_EQ(mesh.surfaceVertices, 26U);
  image[26] = Vec3(1.5, 0.1, 0.2);  // the middle, out through a side
  const TetDistortion pulled = measureTetrahedra(mesh, image);
  EXPECT_GT(pulled.inverted, 0U);
  EXPECT_EQ(pulled.invertedOnSurface, 0U);
  image = mesh.vertices;
  for (Vec3& v : image) v[0] = -v[0];
  const TetDistortion mirrored = measureTetrahedra(mesh, image);
  EXPECT_EQ(mirrored.invertedOnSurface, mirrored.onSurface);
  EXPECT_EQ(mirrored.inverted + mirrored.onSurface, mirrored.tetrahedra);
  // Thinner than a float: positive in doubles and flat as stored.
  image = moved(mesh, [](const Vec3& v) { return Vec3(1 + 1e-9 * v[0], v[1], v[2]); });
  const TetDistortion thin = measureTetrahedra(mesh, image);
  EXPECT_EQ(thin.inverted + thin.invertedOnSurface, thin.tetrahedra);
}

TEST(TetMap, InterpolatesInvertsAndDiffers) {
  const TetMesh mesh = cubeOfTetrahedra(3);
  Mat3 matrix;
  matrix << 0.3, 0.1, 0, -0.1, 0.4, 0.05, 0, 0.1, 0.2;
  const Frame frame{Vec3(5, 6, 7), 2};
  const TetMap map(frame, mesh, moved(mesh, [&](const Vec3& v) { return Vec3(matrix * v); }));
  const std::vector<Vec3> solid{frame.toWorld(Vec3(0.3, -0.2, 0.77)), frame.toWorld(Vec3(0.3, -0.2, 1.1))};
  std::vector<Vec3> ball(2), back(2);
  std::vector<Mat3> jacobian(2);
  map.forward(solid, ball);
  map.inverse(ball, back);
  map.jacobian(solid, jacobian);
  EXPECT_LT((ball[0] - matrix * Vec3(0.3, -0.2, 0.77)).norm(), 1e-12);
  EXPECT_LT((back[0] - solid[0]).norm(), 1e-12);
  EXPECT_LT((jacobian[0] - matrix / 2).norm(), 1e-12);
  EXPECT_TRUE(ball[1].hasNaN());
}

}  // namespace
}  // namespace polestar::bench
