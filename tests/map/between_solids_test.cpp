// From one solid into another by way of their balls, and back: with landmarks, aligned, and by a map of the
// surfaces.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/map/alignment.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/surface_table.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/sphere_locator.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar {
namespace {

using ::testing::AllOf;
using testing::ballMap;
using ::testing::HasSubstr;
using testing::starShape;

constexpr double kDegree = std::numbers::pi / 180;

const BallMap& star() {
  static const BallMap map = ballMap(starShape(smoothStar(3)));
  return map;
}
const BallMap& rock() {
  static const BallMap map = ballMap(starShape(asteroid(12)));
  return map;
}
const StarShape& shapeOf(const BallMap& map) { return map.chart().green().shape(); }

ComposedMap between(const BallMap& from, const std::shared_ptr<const VolumeMap>& motion, const BallMap& to) {
  return ComposedMap()
      .thenForward(std::make_shared<BallMap>(from))
      .thenForward(motion)
      .thenInverse(std::make_shared<BallMap>(to));
}

/// There and back again: half a voxel, of 128 on the longest side, is allowed.
void expectRoundTrip(const BallMap& from, const std::shared_ptr<const VolumeMap>& motion, const BallMap& to) {
  const std::vector<Vec3> points = testing::pointsInside(shapeOf(from), 3000);
  std::vector<Vec3> there(points.size()), back(points.size());
  std::vector<Mat3> jacobians(points.size());
  const ComposedMap map = between(from, motion, to);
  map.forward(points, there);
  map.inverse(there, back);
  map.jacobian(points, jacobians);
  const double voxel = boundingBox(shapeOf(from).surface().mesh()).extent().maxCoeff() / 128;
  std::size_t lost = 0, folds = 0;
  double worst = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    // Within rounding of a surface a point may fall on its other side.
    if (!back[i].allFinite()) {
      ++lost;
      continue;
    }
    worst = std::max(worst, (back[i] - points[i]).norm());
    folds += !(jacobians[i].determinant() > 0);
  }
  EXPECT_LT(worst, 0.5 * voxel);
  EXPECT_LE(lost, points.size() / 1000);
  EXPECT_LE(folds, points.size() / 1000) << "cells that fold are the maps' own";
}

/// Some places on a solid: where rays from its center leave it.
std::vector<Vec3> placesOn(const BallMap& map, const std::vector<Vec3>& directions) {
  const TriMesh& mesh = shapeOf(map).mesh();
  const SphereLocator locator(mesh.vertices, mesh.triangles);
  std::vector<Vec3> places;
  for (const Vec3& d : directions)
    places.push_back(shapeOf(map).frame().toWorld(locator.point(*locator.locate(d))));
  return places;
}

/// Directions on the sphere of places on the surface: farther out along their rays, so that no rounding puts
/// them inside.
std::vector<Vec3> onSphere(const BallMap& map, std::vector<Vec3> places) {
  const Vec3& center = shapeOf(map).frame().origin;
  for (Vec3& x : places) x = center + 1.5 * (x - center);
  std::vector<Vec3> ball(places.size());
  std::vector<double> green(places.size());
  map.sample(places, ball, green);
  return ball;
}

TEST(BetweenSolids, LandmarksBringPlacesTogether) {
  const std::vector<Vec3> directions = geodesicSphere(1).vertices;
  std::vector<Vec3> moved;
  for (std::size_t i = 0; i < directions.size(); ++i)
    moved.push_back(Eigen::AngleAxisd(8 * kDegree, directions[(i + 5) % directions.size()]) * directions[i]);
  const std::vector<Vec3> onStar = placesOn(star(), directions), onRock = placesOn(rock(), moved);
  const std::vector<Vec3> a = onSphere(star(), onStar), b = onSphere(rock(), onRock);
  std::vector<LandmarkPair> pairs;
  for (std::size_t i = 0; i < a.size(); ++i) pairs.push_back({a[i], b[i]});
  const LandmarkMatch match = matchLandmarks(pairs);
  EXPECT_TRUE(match.refined);
  EXPECT_LT(match.worst, 0.1 * kDegree) << match.stalled;
  expectRoundTrip(star(), match.motion, rock());
  expectRoundTrip(rock(), std::make_shared<ComposedMap>(ComposedMap().thenInverse(match.motion)), star());
  // A place just below the surface comes out below its partner.
  std::vector<Vec3> below(onStar.size()), out(onStar.size());
  for (std::size_t i = 0; i < onStar.size(); ++i)
    below[i] = shapeOf(star()).frame().origin + 0.999 * (onStar[i] - shapeOf(star()).frame().origin);
  between(star(), match.motion, rock()).forward(below, out);
  for (std::size_t i = 0; i < out.size(); ++i) EXPECT_LT((out[i] - onRock[i]).norm(), 0.02);
}

TEST(BetweenSolids, RoundTripsOnRealModels) {
  POLESTAR_REQUIRE_MESHES();
  for (const std::string& names : testing::chosenModels(
           {"KW4Alpha.obj psyche.obj"},
           {"bennu.ply castalia.obj", "golevka.stl yorp.stl", "geographos.ply itokawa_radar.obj"})) {
    SCOPED_TRACE(names);
    const auto space = names.find(' ');
    const auto folder = *testing::meshFolder();
    const BallMap a = ballMap(testing::starShapeFromFile(folder / names.substr(0, space))),
                  b = ballMap(testing::starShapeFromFile(folder / names.substr(space + 1)));
    const Alignment alignment = alignSolids(shapeOf(a), shapeOf(b));
    EXPECT_GE(alignment.correlation, alignment.correlationBefore - 1e-6);
    const LandmarkMatch match = alignedMotion(a, b, alignment.rotation);
    EXPECT_LT(match.rms, 2 * kDegree);
    expectRoundTrip(a, match.motion, b);
  }
}

/// The triangles of the star, with their vertices on the star and on the rock.
struct SurfacePair {
  TriMesh onStar, onRock;
};
SurfacePair surfaces() {
  SurfacePair pair{smoothStar(3), smoothStar(3)};
  std::vector<Vec3> directions;
  for (const Vec3& x : pair.onStar.vertices) directions.push_back(x - shapeOf(star()).frame().origin);
  pair.onRock.vertices = placesOn(rock(), directions);
  return pair;
}

std::string refusal(const SurfacePair& pair, Errc code) {
  try {
    surfaceTable(star(), pair.onStar, rock(), pair.onRock);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  return "";
}

TEST(SurfaceTable, CarriesVerticesToTheirPartners) {
  const SurfacePair pair = surfaces();
  const auto shells = std::make_shared<ShellMap>(surfaceTable(star(), pair.onStar, rock(), pair.onRock));
  const std::vector<Vec3> a = onSphere(star(), pair.onStar.vertices),
                          b = onSphere(rock(), pair.onRock.vertices);
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_LT((shells->ofDirection(a[i]) - b[i].normalized()).norm(), 1e-9);
  expectRoundTrip(star(), shells, rock());
}

TEST(SurfaceTable, NamesWhatIsWrong) {
  SurfacePair pair = surfaces();
  // A vertex beyond its neighbours: the triangles around it turn over.
  const Triangle& t = pair.onStar.triangles[40];
  std::swap(pair.onRock.vertices[t[0]], pair.onRock.vertices[t[1]]);
  EXPECT_THAT(refusal(pair, Errc::notConverged), AllOf(HasSubstr("turned over or flat on the second solid"),
                                                       HasSubstr("2 of 1280"), HasSubstr(": 40 at -0.48")));
  pair = surfaces();
  for (Vec3& x : pair.onRock.vertices) x *= 1.2;
  EXPECT_THAT(refusal(pair, Errc::usage), AllOf(HasSubstr("642 of 642"), HasSubstr("second")));
  pair = surfaces();
  pair.onStar.vertices[7] *= 0.5;
  EXPECT_THAT(refusal(pair, Errc::usage),
              AllOf(HasSubstr("1 of 642"), HasSubstr("number 7"), HasSubstr("first")));
  pair = surfaces();
  std::swap(pair.onRock.triangles[0], pair.onRock.triangles[1]);
  EXPECT_THAT(refusal(pair, Errc::usage), HasSubstr("same triangles"));
  pair = surfaces();
  for (Vec3& x : pair.onRock.vertices) x = placesOn(rock(), {Vec3(-(x - shapeOf(rock()).frame().origin))})[0];
  EXPECT_THAT(refusal(pair, Errc::notConverged), HasSubstr("1280 of 1280"));
}

}  // namespace
}  // namespace polestar
