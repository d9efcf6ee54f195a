#include "polestar/star/detail/ray_count.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <numeric>
#include <string>
#include <type_traits>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 2048;

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;

void throwOnFailure(RTCDevice device) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return;
  throw Error(Errc::notConverged, "the count of rays failed inside Embree (error " + std::to_string(error) +
                                      (error == RTC_ERROR_OUT_OF_MEMORY ? ", out of memory" : "") +
                                      "); ask for 0 rays to do without it");
}

Scene buildScene(RTCDevice device, const TriMesh& mesh) {
  Scene scene(rtcNewScene(device));
  rtcSetSceneFlags(scene.get(), static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST |
                                                           RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  if (vertices && indices) {
    for (const Vec3& v : mesh.vertices) {
      for (int k = 0; k < 3; ++k) *vertices++ = static_cast<float>(v[k]);
    }
    for (const Triangle& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) *indices++ = static_cast<unsigned>(t[k]);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene.get(), geometry);
  }
  rtcReleaseGeometry(geometry);
  throwOnFailure(device);
  rtcJoinCommitScene(scene.get());  // within the caller's threads
  throwOnFailure(device);
  return scene;
}

struct Hit {
  float distance;
  unsigned face;
};

/// Collects every hit along a ray; its first member is what Embree sees of it.
struct HitList {
  RTCIntersectContext context;
  static constexpr int kCapacity = 64;  // a vertex of more faces than that counts as a failure
  std::array<Hit, kCapacity> hits;
  int size;

  HitList() : size(0) {
    rtcInitIntersectContext(&context);
    context.filter = &HitList::collect;
  }
  HitList(const HitList&) = delete;
  HitList& operator=(const HitList&) = delete;

  static void collect(const RTCFilterFunctionNArguments* arguments) {
    auto* list = reinterpret_cast<HitList*>(arguments->context);
    if (list->size < kCapacity) {
      list->hits[list->size] = {RTCRayN_tfar(arguments->ray, arguments->N, 0),
                                RTCHitN_primID(arguments->hit, arguments->N, 0)};
    }
    ++list->size;
    arguments->valid[0] = 0;  // go on to the next hit
  }
};

bool shareVertex(const Triangle& s, const Triangle& t) {
  return std::any_of(s.begin(), s.end(),
                     [&](std::int32_t v) { return std::find(t.begin(), t.end(), v) != t.end(); });
}

// Hits on faces around one edge or vertex at the same distance, up to single precision, are one crossing.
bool crossesOnce(HitList& list, const TriMesh& mesh) {
  if (list.size <= 1) return list.size == 1;
  if (list.size > HitList::kCapacity) return false;
  constexpr float kSameDistance = 1e-4f;
  const Hit& first = list.hits[0];
  for (int i = 1; i < list.size; ++i) {
    const Hit& hit = list.hits[i];
    // Embree may report a face twice when its hierarchy splits it.
    const bool same = std::abs(hit.distance - first.distance) <= kSameDistance * first.distance &&
                      shareVertex(mesh.triangles[hit.face], mesh.triangles[first.face]);
    if (!same) return false;
  }
  return true;
}

// Every hit of the ray from the origin along its whole length.
void shoot(RTCScene scene, const Vec3& direction, HitList& list) {
  RTCRayHit query{};
  query.ray.dir_x = static_cast<float>(direction[0]);
  query.ray.dir_y = static_cast<float>(direction[1]);
  query.ray.dir_z = static_cast<float>(direction[2]);
  query.ray.tnear = 0;
  query.ray.tfar = std::numeric_limits<float>::infinity();
  query.ray.mask = ~0u;
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  list.size = 0;
  rtcIntersect1(scene, &list.context, &query);
}

bool meetsOnce(RTCScene scene, const TriMesh& mesh, const Vec3& direction) {
  if (direction.isZero(0)) return false;
  HitList list;
  shoot(scene, direction, list);
  if (list.size == 0) {
    // Aimed at a vertex, a ray can slip between its faces by rounding. A hole would let the neighbouring ray
    // through too.
    const Vec3 aside = direction.unitOrthogonal() * (1e-5 * direction.norm());
    shoot(scene, direction + aside, list);
  }
  return crossesOnce(list, mesh);
}

// The i-th of n directions on a spiral that gives each the same area.
Vec3 spiralDirection(std::size_t i, std::size_t n) {
  const double z = 1 - (2.0 * static_cast<double>(i) + 1) / static_cast<double>(n);
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  const double angle = static_cast<double>(i) * std::numbers::pi * (3 - std::sqrt(5.0));
  return {r * std::cos(angle), r * std::sin(angle), z};
}

}  // namespace

RayCount countRayHits(const TriMesh& inner, std::size_t count,
                      const std::function<Vec3(std::size_t)>& direction, const Context& context) {
  const Device device(rtcNewDevice(nullptr));
  if (!device) throwOnFailure(nullptr);
  const Scene scene = buildScene(device.get(), inner);
  std::vector<std::size_t> failed((count + kChunk - 1) / kChunk, 0);
  parallelChunks(count, kChunk, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!meetsOnce(scene.get(), inner, direction(i))) ++failed[begin / kChunk];
    }
  });
  return {count, std::accumulate(failed.begin(), failed.end(), std::size_t{0})};
}

RayCount countRayHits(const TriMesh& inner, int sphereRays, const Context& context) {
  const std::size_t faces = inner.triangles.size(), spread = static_cast<std::size_t>(sphereRays);
  auto direction = [&](std::size_t i) {
    return i < faces ? Vec3((inner.corner(i, 0) + inner.corner(i, 1) + inner.corner(i, 2)).normalized())
                     : spiralDirection(i - faces, spread);
  };
  return countRayHits(inner, faces + spread, direction, context);
}

}  // namespace polestar::detail
