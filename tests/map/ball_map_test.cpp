#include "polestar/map/ball_map.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/exact_green.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::ballMap;
using testing::pointsInside;
using testing::starShape;

// One map for all tests of this file: three lobes, 2562 vertices.
const BallMap& star() {
  static const BallMap map = ballMap(starShape(smoothStar(4)));
  return map;
}
const StarShape& shapeOf(const BallMap& map) { return map.chart().green().shape(); }

TEST(BallMap, OfABallAboutItsCenterIsTheIdentity) {
  const BallMap map = ballMap(starShape(icosphere(4), Vec3(0, 0, 0)));
  const std::vector<Vec3> x = pointsInside(shapeOf(map), 2000);
  std::vector<Vec3> y(x.size());
  map.forward(x, y);
  for (std::size_t i = 0; i < x.size(); ++i) EXPECT_LT((y[i] - x[i]).norm(), 3e-3) << x[i].transpose();
}

TEST(BallMap, RadiusOfAnOffCenterBallIsExact) {
  const Vec3 pole(0.3, 0.2, -0.1);
  const testing::BallGreen exact{pole};
  const BallMap map = ballMap(starShape(icosphere(4), pole));
  const std::vector<Vec3> x = pointsInside(shapeOf(map), 2000);
  std::vector<Vec3> y(x.size());
  map.forward(x, y);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(y[i].norm(), testing::ballRadius(exact.green(x[i]), exact.harmonicRadius()), 4e-3);
  }
}

TEST(BallMap, RoundTripsFromTheSolid) {
  const std::vector<Vec3> x = pointsInside(shapeOf(star()), 5000);
  std::vector<Vec3> y(x.size()), back(x.size());
  star().forward(x, y);
  star().inverse(y, back);
  for (std::size_t i = 0; i < x.size(); ++i) {
    // Next to the surface R is 1 within the interpolation error, and the inverse stops there.
    const double tolerance = y[i].norm() > 0.995 ? 5e-3 : 1e-8;
    EXPECT_LT((back[i] - x[i]).norm(), tolerance) << "R = " << y[i].norm();
  }
}

TEST(BallMap, RoundTripsFromTheBall) {
  std::vector<Vec3> y = pointsInside(starShape(icosphere(3), Vec3(0, 0, 0)), 5000), x(y.size()),
                    back(y.size());
  star().inverse(y, x);
  star().forward(x, back);
  for (std::size_t i = 0; i < y.size(); ++i)
    EXPECT_LT((back[i] - y[i]).norm(), y[i].norm() > 0.98 ? 1e-3 : 1e-7);
}

void expectEveryPointOfTheBallComesBack(const BallMap& map) {
  std::vector<Vec3> y = pointsInside(starShape(icosphere(3), Vec3(0, 0, 0)), 20000), x(y.size()),
                    back(y.size());
  for (std::size_t i = 0; i < y.size(); i += 2) y[i] = 0.97 * y[i].normalized();
  map.inverse(y, x);
  map.forward(x, back);
  for (std::size_t i = 0; i < y.size(); ++i)
    EXPECT_LT((back[i] - y[i]).norm(), y[i].norm() > 0.98 ? 1e-3 : 1e-9) << y[i].transpose();
}

void expectSmoothCore(const BallMap& map) {
  EXPECT_EQ(map.options().core, CoreMode::smooth);
  EXPECT_EQ(map.imageCells().bad(), 0u);
  EXPECT_EQ(map.levelFlips(), 0u);
  // Outside the core every node is where its line goes.
  const Foliation& f = map.chart().foliation();
  for (std::size_t id = 0; id < f.centerNode(); ++id) {
    const double level = f.levels[id / f.vertexCount];
    EXPECT_NEAR(map.nodeImages().ball[id].norm(), level, 1e-12);
    if (level < map.options().coreRadius) continue;
    ASSERT_LT((map.nodeImages().ball[id] - level * map.sphere().directions[id % f.vertexCount]).norm(),
              1e-12);
  }
}

// Triangles far wider than the legs are thick, lines that crowd, an exponential fall of G: where the table
// has its sharpest kinks.
TEST(BallMap, SharpRealModelsKeepTheirCoreAndEveryPoint) {
  POLESTAR_REQUIRE_MESHES();
  for (const std::string& name :
       testing::chosenModels({"tripod.off", "golevka.stl"}, {"castalia_bump_2.obj"})) {
    SCOPED_TRACE(name);
    const BallMap map = ballMap(testing::starShapeFromFile(*testing::meshFolder() / name));
    expectEveryPointOfTheBallComesBack(map);
    if (name != "tripod.off") expectSmoothCore(map);
  }
}

// Below a sharp edge of the cat's head the field is noise: cells whose own map turns over give 88 of these
// points a second place to come back to.
TEST(BallMap, EveryPointBelowASharpEdgeComesBack) {
  POLESTAR_REQUIRE_MESHES();
  const BallMap map = ballMap(testing::starShapeFromFile(*testing::meshFolder() / "cat_head_capped.ply"));
  std::vector<Vec3> x;
  for (int i = -12; i <= 12; ++i) {
    for (int j = -12; j <= 12; ++j) {
      for (int k = -12; k <= 12; ++k) x.push_back(Vec3(-0.4976, 0.5127, 0.2339) + 0.004 * Vec3(i, j, k));
    }
  }
  std::vector<Vec3> y(x.size()), back(x.size());
  std::vector<Mat3> jacobian(x.size());
  map.forward(x, y);
  map.inverse(y, back);
  map.jacobian(x, jacobian);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_LT((back[i] - x[i]).norm(), 1e-6) << x[i].transpose();
    EXPECT_GT(jacobian[i].determinant(), 0) << x[i].transpose();
  }
}

TEST(BallMap, InverseReachesTheSphereItself) {
  // A cube: along its edges R has no slope at the surface.
  MapOptions options;
  options.boundary = SphereMapKind::fieldLine;
  const BallMap map = mapToBall(starShape(cube(1)), options);
  std::vector<Vec3> y = geodesicSphere(12).vertices, x(y.size()), back(y.size());
  map.inverse(y, x);
  map.forward(x, back);
  std::size_t answered = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    ASSERT_TRUE(x[i].allFinite()) << y[i].transpose();
    EXPECT_NEAR(x[i].cwiseAbs().maxCoeff(), 1, 2e-3) << y[i].transpose();
    if (!back[i].allFinite()) continue;  // moved to mesh units it may lie outside by an ulp
    ++answered;
    EXPECT_LT((back[i] - y[i]).norm(), 1e-3) << y[i].transpose();
  }
  EXPECT_GT(answered, y.size() / 2);
}

TEST(BallMap, CenterSurfaceAndOutside) {
  const StarShape& shape = shapeOf(star());
  const Vec3 center = shape.frame().origin;
  const Vec3 surface = shape.surface().mesh().vertices[17];
  const std::vector<Vec3> x{center, center + (1 - 1e-9) * (surface - center),
                            center + 1.001 * (surface - center), Vec3(50, 0, 0),
                            Vec3::Constant(std::numeric_limits<double>::quiet_NaN())};
  std::vector<Vec3> y(x.size());
  star().forward(x, y);
  EXPECT_EQ(y[0], Vec3::Zero());
  EXPECT_LT((y[1] - star().sphere().directions[17]).norm(), 1e-6);
  EXPECT_TRUE(y[2].hasNaN());
  EXPECT_TRUE(y[3].hasNaN());
  EXPECT_TRUE(y[4].hasNaN());

  std::vector<Vec3> domain{Vec3::Zero(), Vec3(0, 0, 1.01)}, solid(2);
  star().inverse(domain, solid);
  EXPECT_LT((solid[0] - center).norm(), 1e-12);
  EXPECT_TRUE(solid[1].hasNaN());
}

TEST(BallMap, JacobianIsTheDerivativeAndPositive) {
  const std::vector<Vec3> x = pointsInside(shapeOf(star()), 500);
  std::vector<Mat3> jacobian(x.size());
  star().jacobian(x, jacobian);
  int compared = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_GT(jacobian[i].determinant(), 0);
    constexpr double kStep = 1e-7;
    Mat3 difference;
    for (int k = 0; k < 3; ++k) {
      const std::vector<Vec3> ends{x[i] + kStep * Vec3::Unit(k), x[i] - kStep * Vec3::Unit(k)};
      std::vector<Vec3> y(2);
      star().forward(ends, y);
      difference.col(k) = (y[0] - y[1]) / (2 * kStep);
    }
    if (!difference.allFinite()) continue;  // a step over the surface
    // Steps across a face of a cell see two slopes; most do not.
    compared += (difference - jacobian[i]).norm() < 1e-5 * jacobian[i].norm();
  }
  EXPECT_GT(compared, 480);
}

TEST(BallMap, TableAndTracesAgree) {
  const TracedBallMap traced(star());
  const std::vector<Vec3> x = pointsInside(shapeOf(star()), 300);
  std::vector<Vec3> table(x.size()), exact(x.size());
  star().forward(x, table);
  traced.forward(x, exact);
  double worst = 0, sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    ASSERT_TRUE(exact[i].allFinite());
    worst = std::max(worst, (table[i] - exact[i]).norm());
    sum += (table[i] - exact[i]).norm();
  }
  // The mean is 5e-5; with directions linear in the cells it is 9e-4.
  EXPECT_LT(worst, 1e-2);
  EXPECT_LT(sum / static_cast<double>(x.size()), 1e-4);
}

TEST(BallMap, TracedMapInvertsItself) {
  const TracedBallMap traced(star());
  const std::vector<Vec3> y{{0.1, 0.2, 0.3}, {-0.5, 0.4, 0.2}, {0.05, -0.02, 0.01}};
  std::vector<Vec3> x(3), back(3);
  traced.inverse(y, x);
  traced.forward(x, back);
  for (int i = 0; i < 3; ++i) EXPECT_LT((back[i] - y[i]).norm(), 1e-6);
}

TEST(BallMap, JacobianOfTheIdentity) {
  const BallMap table = ballMap(starShape(icosphere(4), Vec3(0, 0, 0)));
  const TracedBallMap traced(table);
  const std::vector<Vec3> x{{0.1, 0.2, 0.3}, {-0.5, 0.4, 0.2}, {0.05, -0.02, 0.01}};
  std::vector<Mat3> a(3), b(3);
  table.jacobian(x, a);
  traced.jacobian(x, b);
  for (int i = 0; i < 3; ++i) {
    // Directions are linear on triangles of edge 0.08: their slopes are right to about that.
    EXPECT_LT((a[i] - Mat3::Identity()).norm(), 0.08);
    EXPECT_LT((b[i] - Mat3::Identity()).norm(), 0.08);
  }
}

TEST(BallMap, SampleContinuesOverTheSurface) {
  const StarShape& shape = shapeOf(star());
  const Vec3 q = shape.surface().mesh().vertices[40], center = shape.frame().origin;
  const std::vector<Vec3> x{center + 1.1 * (q - center), center + 0.5 * (q - center), center};
  std::vector<Vec3> y(3), forward(3);
  std::vector<double> green(3);
  star().sample(x, y, green);
  star().forward(x, forward);
  EXPECT_LT((y[0] - 1.1 * star().sphere().directions[40]).norm(), 1e-9);
  EXPECT_EQ(green[0], 0);
  EXPECT_EQ(y[1], forward[1]);
  EXPECT_NEAR(y[1].norm(), 1 / (1 + star().chart().green().harmonicRadius() * shape.frame().unit * green[1]),
              1e-12);
  EXPECT_EQ(green[2], std::numeric_limits<double>::infinity());
}

TEST(BallMap, SmoothCoreIsDifferentiableAtTheCenterThePapersIsNot) {
  // A boundary map that is no rotation: phi of the conformal map against omega of an elongated body.
  const TriMesh mesh =
      transformed(icosphere(4), [](const Vec3& v) { return Vec3(2.5 * v[0], v[1], 0.7 * v[2]); });
  const StarShape shape = starShape(mesh, Vec3(0, 0, 0));
  const GreenChart chart = traceChart(solveGreen(shape));
  const SphereMap phi = radialSphereMap(shape);
  BallMapOptions paper;
  paper.core = CoreMode::paper;
  // f(t e) / t along opposite and orthogonal rays: linear at the center means additive.
  auto kink = [&](const BallMap& map) {
    constexpr double kDistance = 0.02;
    const std::vector<Vec3> x{kDistance * Vec3(1, 1, 0), kDistance * Vec3(1, 0, 0),
                              kDistance * Vec3(0, 1, 0)};
    std::vector<Vec3> y(3);
    TracedBallMap(map).forward(x, y);
    return (y[0] - y[1] - y[2]).norm() / y[0].norm();
  };
  const double smooth = kink(BallMap(chart, phi)), kinked = kink(BallMap(chart, phi, paper));
  EXPECT_LT(smooth, 2e-3);
  EXPECT_GT(kinked, 2e-2);
}

TEST(BallMap, SameBytesForAnyNumberOfThreads) {
  const std::vector<Vec3> x = pointsInside(shapeOf(star()), 3000);
  std::vector<Vec3> one(x.size()), two(x.size());
  withThreads(1, [&] { star().forward(x, one); });
  withThreads(2, [&] { star().forward(x, two); });
  EXPECT_EQ(one, two);
}

TEST(BallMap, RejectsImpossibleOptions) {
  BallMapOptions options;
  options.coreRadius = 1.5;
  EXPECT_THROW(BallMap(star().chart(), star().sphere(), options), Error);
}

// Three lobes again, with another boundary and radius.
BallMap starWith(SphereMapKind boundary, RadiusKind radius) {
  MapOptions options;
  options.boundary = boundary;
  options.radius = radius;
  BoundaryChoice choice = chooseBoundary(star().chart(), options);
  return BallMap(star().chart(), std::move(choice.sphere), {}, std::move(choice.radius));
}

TEST(BallMapWithRadius, RoundTripsAndHasItsDerivative) {
  for (const BallMap& map : {starWith(SphereMapKind::conformal, RadiusKind::volume),
                             starWith(SphereMapKind::balanced, RadiusKind::balanced)}) {
    const std::vector<Vec3> x = pointsInside(shapeOf(map), 1000);
    std::vector<Vec3> y(x.size()), back(x.size());
    std::vector<Mat3> jacobian(x.size());
    map.forward(x, y);
    map.inverse(y, back);
    map.jacobian(x, jacobian);
    for (std::size_t i = 0; i < x.size(); ++i) {
      EXPECT_LT((back[i] - x[i]).norm(), y[i].norm() > 0.995 ? 5e-3 : 1e-8) << "|f| = " << y[i].norm();
    }
    // Cells meet in kinks of the direction: most differences lie within one cell.
    std::size_t close = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      Mat3 difference;
      for (int k = 0; k < 3; ++k) {
        const std::vector<Vec3> ends{x[i] + 1e-6 * Vec3::Unit(k), x[i] - 1e-6 * Vec3::Unit(k)};
        std::vector<Vec3> images(2);
        map.forward(ends, images);
        difference.col(k) = (images[0] - images[1]) / 2e-6;
      }
      close += (difference - jacobian[i]).norm() < 1e-5 * jacobian[i].norm();
    }
    EXPECT_GT(close, 950u);
  }
}

TEST(BallMapWithRadius, MovesPointsAlongTheirDirectionsOnly) {
  const BallMap volume = starWith(SphereMapKind::conformal, RadiusKind::volume);
  const std::vector<Vec3> x = pointsInside(shapeOf(star()), 500);
  std::vector<Vec3> plain(x.size()), y(x.size());
  star().forward(x, plain);
  volume.forward(x, y);
  for (std::size_t i = 0; i < x.size(); ++i) {
    EXPECT_NEAR(y[i].norm(), volume.radius().value(plain[i].norm()), 1e-12);
    EXPECT_LT((y[i].normalized() - plain[i].normalized()).norm(), 0.02);  // but for the interpolation
  }
}

TEST(BallMapWithRadius, AgreesWithTracedLines) {
  const BallMap map = starWith(SphereMapKind::balanced, RadiusKind::balanced);
  const TracedBallMap traced(map);
  const std::vector<Vec3> x = pointsInside(shapeOf(map), 100);
  std::vector<Vec3> a(x.size()), b(x.size());
  map.forward(x, a);
  traced.forward(x, b);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) sum += (a[i] - b[i]).norm();
  EXPECT_LT(sum / static_cast<double>(x.size()), 3e-3);
}

TEST(FieldLineBallMap, IsOrthogonalAndNeedsNoCore) {
  const BallMap map = starWith(SphereMapKind::fieldLine, RadiusKind::green);
  EXPECT_EQ(map.options().core, CoreMode::paper);
  EXPECT_EQ(map.coreFallbackReason(), "");
  EXPECT_EQ(map.levelFlips(), 0u);
  // Lines of constant direction are field lines, at right angles to the surfaces of constant R: row R of the
  // Jacobian is orthogonal to the directions' rows. At all depths, the center included.
  const std::vector<Vec3> x = pointsInside(shapeOf(map), 500);
  std::vector<Vec3> y(x.size());
  std::vector<Mat3> jacobian(x.size());
  map.forward(x, y);
  map.jacobian(x, jacobian);
  double sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const Mat3 inverse = jacobian[i].inverse();
    const Vec3 u = y[i].normalized(), along = (inverse * u).normalized();
    const Vec3 across = inverse * u.unitOrthogonal();
    sum += std::abs(along.dot(across.normalized()));
  }
  EXPECT_LT(sum / static_cast<double>(x.size()), 0.03);
}

}  // namespace
}  // namespace polestar
