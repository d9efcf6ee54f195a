#include "polestar/render/detail/cut_scene.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <string>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Angle-weighted mean normals at every triangle corner, over the neighbours that meet the triangle without a
/// crease.
std::vector<std::array<Vec3, 3>> creasedNormals(const TriMesh& mesh, double creaseAngle) {
  const std::size_t triangles = mesh.triangles.size();
  std::vector<Vec3> faceNormals(triangles);
  std::vector<std::array<double, 3>> angles(triangles);
  std::vector<std::size_t> begin(mesh.vertices.size() + 1, 0);
  for (std::size_t t = 0; t < triangles; ++t) {
    faceNormals[t] = areaVector(mesh, t).stableNormalized();
    for (int k = 0; k < 3; ++k) {
      const Vec3 a = mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k),
                 b = mesh.corner(t, (k + 2) % 3) - mesh.corner(t, k);
      angles[t][k] = std::atan2(a.cross(b).norm(), a.dot(b));
      ++begin[mesh.triangles[t][k] + 1];
    }
  }
  for (std::size_t v = 0; v + 1 < begin.size(); ++v) begin[v + 1] += begin[v];
  std::vector<std::pair<std::int32_t, std::int32_t>> corners(
      3 * triangles);  // triangle, corner; grouped by vertex
  std::vector<std::size_t> fill(begin.begin(), begin.end() - 1);
  for (std::size_t t = 0; t < triangles; ++t) {
    for (int k = 0; k < 3; ++k) corners[fill[mesh.triangles[t][k]]++] = {static_cast<std::int32_t>(t), k};
  }

  const double smooth = std::cos(creaseAngle);
  std::vector<std::array<Vec3, 3>> normals(triangles);
  parallelChunks(triangles, 4096, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t v = mesh.triangles[t][k];
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = begin[v]; i < begin[v + 1]; ++i) {
          const auto [other, corner] = corners[i];
          if (faceNormals[t].dot(faceNormals[other]) >= smooth)
            sum += angles[other][corner] * faceNormals[other];
        }
        normals[t][k] = sum.norm() > 0 ? Vec3(sum.normalized()) : faceNormals[t];
      }
    }
  });
  return normals;
}

void setRay(RTCRay& ray, const Ray& from, double nearest, double farthest) {
  ray.org_x = static_cast<float>(from.origin[0]);
  ray.org_y = static_cast<float>(from.origin[1]);
  ray.org_z = static_cast<float>(from.origin[2]);
  ray.dir_x = static_cast<float>(from.direction[0]);
  ray.dir_y = static_cast<float>(from.direction[1]);
  ray.dir_z = static_cast<float>(from.direction[2]);
  ray.tnear = static_cast<float>(std::max(0.0, nearest));
  ray.tfar = static_cast<float>(farthest);
  ray.time = 0;
  ray.mask = ~0u;
  ray.id = 0;
  ray.flags = 0;
}

}  // namespace

struct CutScene::Embree {
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  explicit Embree(const TriMesh& mesh) : device(rtcNewDevice(nullptr)) {
    if (!device) {
      throw Error(Errc::io, "Embree cannot start (error " + std::to_string(rtcGetDeviceError(nullptr)) + ")");
    }
    scene = rtcNewScene(device);
    // Robust: neighbouring triangles leave no gap along their edge.
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
    if (vertices && indices) {
      for (const Vec3& v : mesh.vertices) vertices = std::copy_n(v.cast<float>().eval().data(), 3, vertices);
      for (const Triangle& t : mesh.triangles) indices = std::copy_n(t.data(), 3, indices);
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(scene, geometry);
      rtcCommitScene(scene);
    }
    rtcReleaseGeometry(geometry);
    if (const RTCError error = rtcGetDeviceError(device); error != RTC_ERROR_NONE) {
      release();
      throw Error(Errc::io, "Embree cannot build its scene of " + std::to_string(mesh.triangles.size()) +
                                " triangles (error " + std::to_string(error) + ")");
    }
  }
  ~Embree() { release(); }
  Embree(const Embree&) = delete;
  Embree& operator=(const Embree&) = delete;

  void release() {
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
  }

  bool blocked(const Ray& ray, double nearest, double farthest) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay query;
    setRay(query, ray, nearest, farthest);
    rtcOccluded1(scene, &context, &query);
    return query.tfar < 0;
  }
};

CutScene::CutScene(TriMesh surface, std::vector<Plane> planes, double creaseAngle)
    : surface_(std::move(surface)),
      planes_(std::move(planes)),
      cornerNormals_(creasedNormals(surface_, creaseAngle)),
      embree_(std::make_unique<Embree>(surface_)) {}

CutScene::~CutScene() = default;
CutScene::CutScene(CutScene&&) noexcept = default;

bool CutScene::cutAway(const Vec3& point) const {
  return !planes_.empty() && std::all_of(planes_.begin(), planes_.end(), [&](const Plane& plane) {
    return plane.normal.dot(point) > plane.offset;
  });
}

CutScene::Interval CutScene::cutInterval(const Ray& ray) const {
  Interval interval{0, std::numeric_limits<double>::infinity(), -1};
  if (planes_.empty()) interval.end = 0;
  for (std::size_t i = 0; i < planes_.size(); ++i) {
    const double depth = planes_[i].normal.dot(ray.origin) - planes_[i].offset;
    const double speed = planes_[i].normal.dot(ray.direction);
    if (speed > 0) {
      interval.begin = std::max(interval.begin, -depth / speed);
    } else if (speed < 0) {
      if (-depth / speed < interval.end) {
        interval.end = -depth / speed;
        interval.exitPlane = static_cast<int>(i);
      }
    } else if (depth <= 0) {
      interval.end = 0;
    }
  }
  return interval;
}

SolidHit CutScene::skinHit(const Ray& ray, double nearest, double farthest, bool& facesAway) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query;
  setRay(query.ray, ray, nearest, farthest);
  query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene, &context, &query);
  SolidHit hit;
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;

  // In doubles from the triangle, so that the point lies on the very surface that the map knows.
  const std::size_t t = query.hit.primID;
  const double u = std::clamp<double>(query.hit.u, 0, 1), v = std::clamp<double>(query.hit.v, 0, 1 - u),
               w = 1 - u - v;
  hit.kind = HitKind::skin;
  hit.distance = query.ray.tfar;
  hit.position = w * surface_.corner(t, 0) + u * surface_.corner(t, 1) + v * surface_.corner(t, 2);
  hit.normal = areaVector(surface_, t).stableNormalized();
  facesAway = hit.normal.dot(ray.direction) > 0;
  const auto& normals = cornerNormals_[t];
  hit.shadingNormal = (w * normals[0] + u * normals[1] + v * normals[2]).stableNormalized();

  // The smooth surface that the shading normals pretend bulges out of the facet; shadow rays from the facet
  // would show the facets at the edge of the shade [Hanika 2021, "Hacking the shadow terminator"].
  const double weights[3] = {w, u, v};
  hit.shadowOrigin = hit.position;
  for (int k = 0; k < 3; ++k) {
    const double below = (hit.position - surface_.corner(t, k)).dot(normals[k]);
    if (below < 0) hit.shadowOrigin -= weights[k] * below * normals[k];
  }
  return hit;
}

SolidHit CutScene::firstHit(const Ray& ray) const {
  const Interval cut = cutInterval(ray);
  bool facesAway = false;
  if (cut.empty()) return skinHit(ray, 0, kInfinity, facesAway);
  if (cut.begin > 0) {
    const SolidHit before = skinHit(ray, 0, cut.begin, facesAway);
    if (before.kind != HitKind::none) return before;
  }
  if (!std::isfinite(cut.end)) return {};
  SolidHit hit = skinHit(ray, cut.end, kInfinity, facesAway);
  if (hit.kind == HitKind::none || !facesAway) return hit;
  // The next crossing leads out, so the ray is inside the solid where it leaves the region that was cut away.
  hit.kind = HitKind::cut;
  hit.plane = cut.exitPlane;
  hit.distance = cut.end;
  hit.position = ray.origin + cut.end * ray.direction;
  hit.normal = hit.shadingNormal = planes_[cut.exitPlane].normal;
  hit.shadowOrigin = hit.position;
  return hit;
}

bool CutScene::occluded(const Ray& ray) const {
  const Interval cut = cutInterval(ray);
  if (cut.empty()) return embree_->blocked(ray, 0, kInfinity);
  if (cut.begin > 0 && embree_->blocked(ray, 0, cut.begin)) return true;
  return std::isfinite(cut.end) && embree_->blocked(ray, cut.end, kInfinity);
}

}  // namespace polestar::detail
