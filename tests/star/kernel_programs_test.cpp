// The two programs against closed forms and against their own optimality conditions, which prove an optimum.

#include "polestar/star/detail/kernel_programs.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "polestar/mesh/shapes.h"
#include "star/bodies.h"

namespace polestar::detail {
namespace {

struct Body {
  std::string name;
  TriMesh mesh;
};

TriMesh noisyBall(int levels, double roughness, unsigned seed) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<> uniform(-1, 1);
  return radialShape(levels,
                     [&](const Vec3& w) { return 1 + 0.4 * w[0] * w[1] + roughness * uniform(engine); });
}

std::vector<Body> bodies() {
  return {{"cube", cube(3)},
          {"half ball", halfBall(8)},
          {"stella", testing::stellaOctangula()},
          {"smooth star", smoothStar(4)},
          {"letter U", testing::letterU().mesh},
          {"twice around", testing::twiceAround()},
          {"needle", testing::spikedCube(50)},
          {"slightly noisy", noisyBall(4, 0.002, 1)},
          {"noisy", noisyBall(4, 0.02, 2)},
          {"very noisy", noisyBall(5, 0.2, 3)}};
}

double bruteForceMargin(const HalfSpaces& h, const Vec3& c) {
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t f = 0; f < h.size(); ++f) smallest = std::min(smallest, h[f].slack(c));
  return smallest;
}

double marginOf(const TriMesh& mesh) {
  const Frame frame = workingFrame(mesh);
  return frame.unit * largestMargin(HalfSpaces(mesh, frame)).margin;
}

TEST(LargestMargin, CubesAndBoxes) {
  EXPECT_NEAR(marginOf(cube(1)), 1, 1e-10);
  EXPECT_NEAR(marginOf(cube(7)), 1, 1e-10);
  // The optimum of a box is a whole rectangle of centers: every step of the simplex has ties.
  const TriMesh box =
      transformed(cube(5), [](const Vec3& v) { return Vec3(v[0], 2 * v[1] - 7, 3 * v[2] + 5); });
  EXPECT_NEAR(marginOf(box), 1, 1e-10);
}

TEST(LargestMargin, StellaOctangula) {
  EXPECT_NEAR(marginOf(testing::stellaOctangula()), 1 / std::sqrt(3.0), 1e-10);
}

TEST(LargestMargin, ShearedStellaOctangula) {
  // The kernel is the sheared octahedron; its largest ball, by the eight planes alone.
  const Mat3 shear = (Mat3() << 1, 0.7, -0.2, 0, 1.3, 0.4, 0, 0, 0.8).finished();
  const TriMesh mesh =
      transformed(testing::stellaOctangula(), [&](const Vec3& v) { return Vec3(shear * v + Vec3(3, 2, 1)); });
  // Point-symmetric about the image of the origin, so the center is there: the nearest plane decides.
  double nearest = 1e9;
  for (int octant = 0; octant < 4; ++octant) {
    const Vec3 plane(1, octant & 1 ? -1 : 1, octant & 2 ? -1 : 1);  // plane . p = 1
    nearest = std::min(nearest, 1 / (shear.inverse().transpose() * plane).norm());
  }
  EXPECT_NEAR(marginOf(mesh), nearest, 1e-9);
}

TEST(LargestMargin, HalfBallByAOneDimensionalSearch) {
  // Six-fold symmetry and convexity put a best center on the axis, where the margin is concave in the height.
  const TriMesh mesh = halfBall(12);
  const HalfSpaces h(mesh, Frame{});
  double low = 0, high = 1;
  while (high - low > 1e-13) {
    const double a = low + (high - low) / 3, b = high - (high - low) / 3;
    (bruteForceMargin(h, Vec3(0, 0, a)) < bruteForceMargin(h, Vec3(0, 0, b)) ? low : high) =
        bruteForceMargin(h, Vec3(0, 0, a)) < bruteForceMargin(h, Vec3(0, 0, b)) ? a : b;
  }
  const double expected = bruteForceMargin(h, Vec3(0, 0, low));
  EXPECT_NEAR(expected, 0.5, 0.01);  // of the smooth half ball
  EXPECT_NEAR(marginOf(mesh), expected, 1e-10);
}

TEST(LargestMargin, LetterU) { EXPECT_NEAR(marginOf(testing::letterU().mesh), -0.5, 1e-10); }

TEST(LargestMargin, WeightsProveTheOptimum) {
  for (const Body& body : bodies()) {
    SCOPED_TRACE(body.name);
    const HalfSpaces h(body.mesh, workingFrame(body.mesh));
    const LargestMargin result = largestMargin(h);
    // Feasible with that margin ...
    EXPECT_NEAR(bruteForceMargin(h, result.center), result.margin, 1e-15);
    // ... and no point can have more: the weighted half-spaces bound every margin by the weighted offsets.
    Vec3 sum = Vec3::Zero();
    double weights = 0, bound = 0;
    for (const ActiveFace& a : result.active) {
      EXPECT_GT(a.weight, 0);
      sum += a.weight * h[a.face].normal;
      weights += a.weight;
      bound += a.weight * h[a.face].offset;
    }
    EXPECT_LE(result.active.size(), 4u);
    EXPECT_LT(sum.norm(), 1e-11);
    EXPECT_NEAR(weights, 1, 1e-11);
    EXPECT_NEAR(bound, result.margin, 1e-10);
    EXPECT_LT(result.scans, 40);
  }
}

TEST(ClosestCenter, MultipliersProveTheOptimum) {
  std::mt19937 engine(4);
  std::uniform_real_distribution<> uniform(-0.4, 0.4);
  int constrained = 0;
  for (const Body& body : bodies()) {
    SCOPED_TRACE(body.name);
    const HalfSpaces h(body.mesh, workingFrame(body.mesh));
    const LargestMargin largest = largestMargin(h);
    if (largest.margin <= 0) continue;
    for (int trial = 0; trial < 20; ++trial) {
      const Vec3 goal(uniform(engine), uniform(engine), uniform(engine));
      for (const double share : {0.01, 0.25, 0.9, 1 - 1e-9}) {
        const double margin = share * largest.margin;
        const ClosestCenter result = closestCenter(h, goal, margin);
        EXPECT_GT(bruteForceMargin(h, result.center), margin - 1e-12);
        Vec3 pull = Vec3::Zero();
        for (const ActiveFace& a : result.active) {
          EXPECT_GE(a.weight, -1e-15);
          EXPECT_NEAR(h[a.face].slack(result.center), margin, 1e-11);
          pull += a.weight * h[a.face].normal;
        }
        EXPECT_LT((goal - result.center - pull).norm(), 1e-9);
        constrained += !result.active.empty();
      }
    }
  }
  EXPECT_GT(constrained, 200);
}

TEST(ClosestCenter, AGoalInsideStaysWhereItIs) {
  const TriMesh mesh = cube(4);
  const Frame frame = workingFrame(mesh);
  const ClosestCenter result = closestCenter(HalfSpaces(mesh, frame), Vec3(0.01, 0.02, 0.03), 0.1);
  EXPECT_EQ(result.center, Vec3(0.01, 0.02, 0.03));
  EXPECT_TRUE(result.active.empty());
}

TEST(ClosestCenter, AStartOfOtherFacesDoesNotMatter) {
  const TriMesh mesh = smoothStar(4);
  const HalfSpaces h(mesh, workingFrame(mesh));
  const LargestMargin largest = largestMargin(h);
  ASSERT_GT(largest.margin, 0);
  const Vec3 goal(0.3, -0.2, 0.4);
  const Vec3 cold = closestCenter(h, goal, 0.25 * largest.margin).center;
  const Vec3 warm = closestCenter(h, goal, 0.25 * largest.margin, largest.workingSet).center;
  EXPECT_LT((cold - warm).norm(), 1e-11);
}

TEST(HalfSpaces, NeedlesKeepTheirPlanes) {
  // A triangle of width 1e-14 in the plane x + y + z = 1 (exactly: dyadic numbers), seen from far corners.
  const double w = 0x1p-46;
  TriMesh mesh;
  mesh.vertices = {{1, 0, 0}, {0, 1, 0}, {0.5 + w, 0.5 - 2 * w, w}};
  mesh.triangles = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}};
  const HalfSpaces h(mesh, Frame{});
  for (std::size_t f = 0; f < h.size(); ++f) {
    EXPECT_LT((h[f].normal.cwiseAbs() - Vec3::Constant(1 / std::sqrt(3.0))).norm(), 1e-12);
    EXPECT_NEAR(std::abs(h[f].offset), 1 / std::sqrt(3.0), 1e-12);
  }
}

TEST(HalfSpaces, FacesWithoutAreaBoundNothing) {
  TriMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}};
  mesh.triangles = {{0, 1, 2}};
  const HalfSpaces h(mesh, Frame{});
  EXPECT_EQ(h[0].normal, Vec3::Zero());
  EXPECT_GT(h[0].slack(Vec3(1e9, 1e9, 1e9)), 1e100);
}

TEST(HalfSpaces, ScansFindTheFirstTightestFace) {
  const TriMesh mesh = noisyBall(5, 0.1, 6);  // several chunks
  const HalfSpaces h(mesh, workingFrame(mesh));
  std::mt19937 engine(7);
  std::uniform_real_distribution<> uniform(-1, 1);
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3 c(uniform(engine), uniform(engine), uniform(engine));
    const FaceSlack found = h.tightest(c);
    const double expected = bruteForceMargin(h, c);
    EXPECT_NEAR(found.slack, expected, 1e-15);
    EXPECT_NEAR(h[found.face].slack(c), expected, 1e-15);
  }
}

}  // namespace
}  // namespace polestar::detail
