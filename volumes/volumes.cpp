#include "volumes/volumes.h"

#include <cmath>

#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "polestar/texture/procedural.h"
#include "polestar/texture/transfer.h"

namespace polestar {
namespace {

/// Decimals that survive the last bits of any compiler's arithmetic.
TriMesh rounded(const TriMesh& mesh) {
  return transformed(mesh, [](const Vec3& v) -> Vec3 { return (1e6 * v).array().round() / 1e6 + 0.0; });
}

TriMesh ballOffCenter() {
  return rounded(transformed(geodesicSphere(16), [](const Vec3& v) { return Vec3(v + Vec3(0.5, 0, 0)); }));
}

TriMesh fruit() {
  return rounded(transformed(geodesicSphere(16),
                             [](const Vec3& v) -> Vec3 { return v.cwiseProduct(Vec3(0.8, 0.8, 1)); }));
}

}  // namespace

SolidGrids sampleTexture() {
  constexpr int kDim = 48;
  MapOptions mapping;
  mapping.boundary = SphereMapKind::balanced;
  const BallMap map = mapToBall(verifyStarShape(verifyClosedSurface(fruit())), mapping);
  TransferOptions options;
  options.grids.voxelSize = voxelSizeFor(fruit(), kDim);
  options.halfColors = true;
  return transferTexture(TextureRoute(map), *makeTexture("kiwi"), options).grids;
}

std::vector<Volume> shippedVolumes() {
  const Vec3 origin = Vec3::Zero();
  return {
      {"asteroid.ply", "asteroid: stretched body, ridges and craters from seeded noise", origin,
       [] { return asteroid(23); }},
      {"ball_offcenter.ply", "unit ball about (0.5, 0, 0)", origin, ballOffCenter},
      {"cube.obj", "cube [-1, 1]^3", origin, [] { return cube(16); }},
      {"fruit.ply", "ellipsoid of half axes 0.8, 0.8 and 1, long along z: the body of the sample textures",
       origin, fruit},
      {"half_ball.ply", "upper half of the unit ball", Vec3(0, 0, 0.4), [] { return rounded(halfBall(20)); }},
      {"head.ply", "stylized head: blended ellipsoids and cones; looks along -y, crown along +z", origin,
       [] { return stylizedHead(32); }},
      {"pig.ply", "coin box: a pig on four short legs; looks along -y, up is +z", origin,
       [] { return coinPig(32); }},
      {"smooth_star.ply", "three lobes up, three down: radius 1 + 0.3 Y", origin,
       [] { return rounded(smoothStar(4)); }},
      {"star_polyhedron.obj", "small stellated dodecahedron", origin, [] { return starPolyhedron(8); }},
      {"twelve_lobes.ply", "ball with a bump over each vertex of an icosahedron", origin,
       [] { return twelveLobes(16); }},
  };
}

}  // namespace polestar
