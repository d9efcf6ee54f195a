// The method of fundamental solutions, against the ball's exact Green's function and by what must not matter.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/green/detail/inside_star.h"
#include "polestar/green/detail/spread_points.h"
#include "polestar/green/green_function.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "support/exact_green.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::BallGreen;
using ::testing::HasSubstr;
using testing::pointsInside;
using testing::starShape;

const Vec3 kPole(0.3, 0.2, -0.1);

GreenOptions mfs(MfsMode mode = MfsMode::paper) {
  GreenOptions options;
  options.solver = GreenSolver::mfs;
  options.mfs.mode = mode;
  return options;
}

GreenOptions layerInOnePass() {
  GreenOptions options;
  options.maxPasses = 1;
  return options;
}

StarShape ball(int levels) { return starShape(icosphere(levels), kPole); }

/// max rho |G - G_exact| at 1000 points of the ball, and on the sphere between the vertices.
struct BallError {
  double inside = 0, onSphere = 0;
};
BallError ballError(const GreenFunction& green, int levels) {
  const Frame& frame = green.shape().frame();
  const BallGreen exact{kPole};
  auto largest = [&](const std::vector<Vec3>& points) {
    double worst = 0;
    for (const Vec3& x : points) {
      const Vec3 inner = frame.toInner(x);
      double value;
      Vec3 gradient;
      green.evaluate({&inner, 1}, {&value, 1}, {&gradient, 1});
      worst = std::max(worst, exact.harmonicRadius() * std::abs(value / frame.unit - exact.green(x)));
    }
    return worst;
  };
  std::vector<Vec3> between = icosphere(levels + 1).vertices;
  between.erase(between.begin(),
                between.begin() + static_cast<std::ptrdiff_t>(icosphere(levels).vertices.size()));
  return {largest(pointsInside(green.shape(), 1000)), largest(between)};
}

std::vector<double> sample(const GreenFunction& green, const std::vector<Vec3>& innerPoints) {
  std::vector<double> value(innerPoints.size());
  std::vector<Vec3> gradient(innerPoints.size());
  green.evaluate(innerPoints, value, gradient);
  return value;
}

const std::vector<Vec3> kProbes{{0.1, 0.2, 0}, {-0.3, 0.1, 0.2}, {0, -0.2, -0.4}, {0.05, 0, 0.01}};

TEST(Mfs, PapersChargesConvergeToTheKelvinImage) {
  const BallError coarse = ballError(solveGreen(ball(2), mfs()), 2),
                  fine = ballError(solveGreen(ball(3), mfs()), 3);
  EXPECT_LT(fine.inside, 1e-2);
  EXPECT_GT(coarse.inside / fine.inside, 4);
}

TEST(Mfs, PapersOwnPointsShowLessThanTheErrorThatThereIs) {
  for (const StarShape& shape : {ball(3), starShape(twelveLobes(10)), starShape(asteroid(9))}) {
    const GreenFunction green = solveGreen(shape, mfs());
    EXPECT_GT(green.boundaryError().max, 1.25 * green.record().mfs->collocationError);
  }
}

TEST(Mfs, SmoothModeIsFarCloserToASmoothSolidThanAnythingOnItsTriangles) {
  const StarShape shape = ball(3);
  const GreenFunction charges = solveGreen(shape, mfs(MfsMode::smooth)),
                      layer = solveGreen(shape, layerInOnePass());
  const BallError ours = ballError(charges, 3);
  EXPECT_LT(ours.inside, 1e-6);
  EXPECT_LT(ours.inside, 1e-3 * ballError(layer, 3).inside);
  // The triangles are chords of the sphere, and G is not 0 there: that is said.
  EXPECT_GT(charges.boundaryError().max, 1e-3);
}

TEST(Mfs, HeldOutVerticesTellTheErrorOnTheSmoothSurface) {
  for (const int levels : {2, 3}) {
    const GreenFunction green = solveGreen(ball(levels), mfs(MfsMode::smooth));
    const BallError error = ballError(green, levels);
    const double told = green.record().mfs->heldOutError;
    EXPECT_LT(error.onSphere, told) << "from above, since the held-out vertices joined the equation";
    EXPECT_GT(error.onSphere, told / 20);
    EXPECT_LE(error.inside, error.onSphere) << "the maximum principle";
  }
}

TEST(Mfs, SmoothModeConvergesFastOnADentedBody) {
  const double coarse = solveGreen(starShape(smoothStar(3)), mfs(MfsMode::smooth)).record().mfs->heldOutError;
  GreenOptions options = mfs(MfsMode::smooth);
  options.mfs.largestSources = 800;
  const double fine = solveGreen(starShape(smoothStar(4)), options).record().mfs->heldOutError;
  EXPECT_LT(fine, 5e-3);
  EXPECT_GT(coarse / fine, 8);  // the layer's order, two, would give 4
}

TEST(Mfs, MovedTurnedAndScaledCopiesAreTheSame) {
  const TriMesh mesh = asteroid(6);
  // A quarter turn, since the offset comes from the axis-aligned box.
  const TriMesh copy = transformed(
      mesh, [](const Vec3& p) { return Vec3(1e-3 * Vec3(-p[1], p[0], p[2]) + Vec3(40, -7, 300)); });
  const StarShape a = starShape(mesh, Vec3(0, 0, 0)), b = starShape(copy, Vec3(40, -7, 300));
  for (const MfsMode mode : {MfsMode::paper, MfsMode::smooth}) {
    std::vector<Vec3> turned = kProbes;
    for (Vec3& p : turned) p = Vec3(-p[1], p[0], p[2]);
    const std::vector<double> first = sample(solveGreen(a, mfs(mode)), kProbes),
                              second = sample(solveGreen(b, mfs(mode)), turned);
    for (std::size_t i = 0; i < first.size(); ++i) EXPECT_NEAR(first[i], second[i], 1e-6 * first[i]);
  }
}

TEST(Mfs, TheNumberingOfVerticesDoesNotMatter) {
  const TriMesh mesh = asteroid(6);  // no symmetry, so no ties between distances
  std::vector<std::int32_t> to(mesh.vertices.size());
  std::iota(to.begin(), to.end(), 0);
  std::shuffle(to.begin(), to.end(), std::mt19937(5));
  TriMesh copy = mesh;
  for (std::size_t i = 0; i < to.size(); ++i)
    copy.vertices[static_cast<std::size_t>(to[i])] = mesh.vertices[i];
  for (Triangle& t : copy.triangles) t = {to[t[0]], to[t[1]], to[t[2]]};
  for (const MfsMode mode : {MfsMode::paper, MfsMode::smooth}) {
    const std::vector<double> first = sample(solveGreen(starShape(mesh, Vec3(0, 0, 0)), mfs(mode)), kProbes),
                              second = sample(solveGreen(starShape(copy, Vec3(0, 0, 0)), mfs(mode)), kProbes);
    for (std::size_t i = 0; i < first.size(); ++i) EXPECT_NEAR(first[i], second[i], 1e-7 * first[i]);
  }
}

TEST(Mfs, SourcesAcrossANarrowDentAreLeftOut) {
  // A ball with a groove around its equator, narrower than the sources are far.
  const StarShape shape =
      starShape(radialShape(3, [](const Vec3& w) { return 1 - 0.6 * std::exp(-60 * w[2] * w[2]); }));
  GreenOptions options = mfs();
  options.mfs.offset = 0.1;
  const GreenFunction green = solveGreen(shape, options);
  const MfsSummary& summary = *green.record().mfs;
  EXPECT_GT(summary.leftOut, 0u);
  const auto placed =
      static_cast<std::size_t>(std::lround(0.6 * static_cast<double>(shape.mesh().vertices.size())));
  EXPECT_EQ(summary.sources + summary.leftOut, placed);
  const detail::InsideStar solid(shape.mesh());
  for (const Vec3& p : std::get<PointSources>(green.sources()).positions) EXPECT_FALSE(solid.contains(p));
}

TEST(Mfs, SourcesAreAsManyAndAsFarAsThePaperSays) {
  const StarShape shape = ball(2);
  const GreenFunction green = solveGreen(shape, mfs());
  const auto& sources = std::get<PointSources>(green.sources());
  EXPECT_EQ(sources.positions.size(), 97u);  // 0.6 * 162
  const double diagonal = boundingBox(shape.mesh()).diagonal();
  for (const Vec3& p : sources.positions) {
    const Vec3 fromCenter = shape.frame().toWorld(p);
    // The sphere's normals are radial up to the mesh's own error.
    EXPECT_NEAR((fromCenter.norm() - 1) / shape.frame().unit, 0.05 * diagonal, 1e-3);
  }
}

TEST(Mfs, ChargesHaveNoLayerAndNoTotal) {
  const GreenFunction green = solveGreen(ball(2), mfs());
  EXPECT_EQ(green.record().summary.solver, "mfs");
  EXPECT_FALSE(green.charge().has_value());
  EXPECT_THROW(green.density(), std::bad_variant_access);
  EXPECT_EQ(green.record().unresolvedArea, 0);
}

TEST(Mfs, RestoredFromItsChargesItIsTheSame) {
  const GreenFunction green = solveGreen(ball(2), mfs());
  EXPECT_EQ(sample(green, kProbes),
            sample(restoreGreen(green.shape(), green.sources(), green.record()), kProbes));
}

TEST(Mfs, SameBytesForAnyNumberOfThreads) {
  for (const MfsMode mode : {MfsMode::paper, MfsMode::smooth}) {
    std::vector<double> one, two;
    withThreads(1, [&] { one = sample(solveGreen(ball(3), mfs(mode)), kProbes); });
    withThreads(2, [&] { two = sample(solveGreen(ball(3), mfs(mode)), kProbes); });
    EXPECT_EQ(one, two);
  }
}

TEST(Mfs, SmallestMeshes) {
  const TriMesh tetrahedron{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
                            {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  for (const MfsMode mode : {MfsMode::paper, MfsMode::smooth}) {
    const GreenFunction green = solveGreen(starShape(tetrahedron), mfs(mode));
    EXPECT_GT(green.boundaryError().max, 0.1) << "a handful of charges cannot do it, and that must show";
  }
}

TEST(Mfs, RefusesAMatrixThatDoesNotFit) {
  GreenOptions options = mfs();
  options.mfs.memoryLimit = 1e6;
  try {
    solveGreen(ball(4), options);
    FAIL() << "2562 x 1537 doubles are more than 1 MB";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::usage);
    EXPECT_THAT(error.what(), HasSubstr("use the layer solver"));
  }
}

TEST(Mfs, StopsWhenCancelled) {
  for (const MfsMode mode : {MfsMode::paper, MfsMode::smooth}) {
    Context context;
    context.onProgress = [&](std::string_view, double fraction) {
      if (fraction > 0.3) context.cancel();
    };
    EXPECT_THROW(solveGreen(ball(3), mfs(mode), context), Error);
  }
}

TEST(Mfs, RejectsImpossibleOptions) {
  for (auto spoil : std::initializer_list<void (*)(MfsOptions&)>{
           [](MfsOptions& o) { o.sourcesPerVertex = 0; }, [](MfsOptions& o) { o.sourcesPerVertex = 1.1; },
           [](MfsOptions& o) { o.offset = 0; }, [](MfsOptions& o) { o.cutoff = 0; },
           [](MfsOptions& o) { o.largestSources = 0; }, [](MfsOptions& o) { o.reachShare = 1; },
           [](MfsOptions& o) { o.heldOutShare = 0.9; }, [](MfsOptions& o) { o.memoryLimit = 0; }}) {
    GreenOptions options = mfs();
    spoil(options.mfs);
    EXPECT_THROW(solveGreen(ball(1), options), Error);
  }
}

TEST(InsideStar, KnowsBothSidesOfEveryTriangle) {
  const TriMesh tetrahedron{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
                            {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  for (const TriMesh& mesh : {tetrahedron, cube(3), starPolyhedron(2), asteroid(6)}) {
    const detail::InsideStar solid(mesh);
    EXPECT_TRUE(solid.contains(Vec3::Zero()));
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      // A corner, an edge and the middle, none quite on the surface.
      for (const Vec3& weights : {Vec3(1, 0, 0), Vec3(0.5, 0.5, 0), Vec3(0.2, 0.3, 0.5)}) {
        const Vec3 q =
            weights[0] * mesh.corner(t, 0) + weights[1] * mesh.corner(t, 1) + weights[2] * mesh.corner(t, 2);
        EXPECT_TRUE(solid.contains((1 - 1e-9) * q));
        EXPECT_FALSE(solid.contains((1 + 1e-9) * q));
      }
    }
  }
}

TEST(SpreadPoints, CoverAndKeepApart) {
  const std::vector<Vec3> points = geodesicSphere(12).vertices;
  const auto chosen = detail::spreadPoints(points, std::vector<double>(points.size(), 1.0), 60);
  double closest = 1e300, farthest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double nearest = 1e300;
    for (const std::size_t c : chosen) {
      const double d = (points[i] - points[c]).norm();
      if (c != i) closest = std::min(closest, std::count(chosen.begin(), chosen.end(), i) ? d : 1e300);
      nearest = std::min(nearest, d);
    }
    farthest = std::max(farthest, nearest);
  }
  // Greedy choice: the next point would be no farther from the chosen ones than they are from each other.
  EXPECT_LE(farthest, closest * (1 + 1e-6));
}

TEST(SpreadPoints, AreDenserWhereLessSpacingIsWanted) {
  const std::vector<Vec3> points = geodesicSphere(20).vertices;
  std::vector<double> spacing(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) spacing[i] = points[i][2] > 0 ? 1 : 3;
  const auto chosen = detail::spreadPoints(points, spacing, 200);
  const auto above =
      std::count_if(chosen.begin(), chosen.end(), [&](std::size_t i) { return points[i][2] > 0; });
  EXPECT_GT(above, 160);  // 9 of 10
}

}  // namespace
}  // namespace polestar
