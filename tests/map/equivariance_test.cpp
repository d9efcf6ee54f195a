// Where the model lies, how large it is and how it is turned must not matter.

#include <gtest/gtest.h>

#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::ballMap;
using testing::pointsInside;
using testing::starShape;

// Largest difference between f(x) and Q^T g(move(x)) by traced maps, as `polestar eval` answers.
double difference(const BallMap& a, const BallMap& b, const std::function<Vec3(const Vec3&)>& move,
                  const Mat3& turn, std::size_t count) {
  const std::vector<Vec3> x = pointsInside(a.chart().green().shape(), count);
  std::vector<Vec3> moved, fx(count), gx(count);
  for (const Vec3& p : x) moved.push_back(move(p));
  TracedBallMap(a).forward(x, fx);
  TracedBallMap(b).forward(moved, gx);
  double worst = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // A point within rounding of the surface may fall on its other side.
    if (!fx[i].allFinite() || !gx[i].allFinite()) continue;
    worst = std::max(worst, (fx[i] - turn.transpose() * gx[i]).norm());
  }
  return worst;
}

TEST(Equivariance, RotationTranslationAndScale) {
  const TriMesh mesh = smoothStar(3);
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(0.3, -1, 0.5).normalized()).toRotationMatrix();
  auto move = [&](const Vec3& p) { return Vec3(37 * (turn * p) + Vec3(100, -20, 3)); };
  // As given: on a finer copy of so symmetric a body rounding decides which of equal triangles the solver
  // splits, and the maps differ by what it tolerates.
  MapOptions asGiven;
  asGiven.largestAngle = 0;
  const BallMap a = mapToBall(starShape(mesh), asGiven),
                b = mapToBall(starShape(transformed(mesh, move)), asGiven);
  EXPECT_LT(difference(a, b, move, turn, 300), 1e-5);
}

TEST(Equivariance, WideTrianglesAreCutAlike) {
  const TriMesh mesh = smoothStar(3);
  const Mat3 turn = Eigen::AngleAxisd(0.7, Vec3(0.3, -1, 0.5).normalized()).toRotationMatrix();
  auto move = [&](const Vec3& p) { return Vec3(37 * (turn * p) + Vec3(100, -20, 3)); };
  const TriMesh a = subdivide(starShape(mesh), 0.12).surface().mesh(),
                b = subdivide(starShape(transformed(mesh, move)), 0.12).surface().mesh();
  EXPECT_GT(a.vertices.size(), mesh.vertices.size());
  ASSERT_EQ(a.triangles, b.triangles);
  for (std::size_t i = 0; i < a.vertices.size(); ++i)
    EXPECT_LT((move(a.vertices[i]) - b.vertices[i]).norm(), 1e-12);
}

TEST(Equivariance, FarAndTinyCopiesOfARealModel) {
  POLESTAR_REQUIRE_MESHES();
  const auto folder = *testing::meshFolder();
  const BallMap castalia = ballMap(testing::starShapeFromFile(folder / "castalia.obj"));
  const Vec3 center = castalia.chart().green().shape().frame().origin;
  for (const char* name : {"castalia_far.obj", "castalia_tiny.ply"}) {
    const BallMap copy = ballMap(testing::starShapeFromFile(folder / name));
    const Frame &from = castalia.chart().green().shape().frame(), &to = copy.chart().green().shape().frame();
    auto move = [&](const Vec3& p) { return Vec3(to.origin + to.unit / from.unit * (p - center)); };
    EXPECT_LT(difference(castalia, copy, move, Mat3::Identity(), 300), 1e-6) << name;
  }
}

}  // namespace
}  // namespace polestar
