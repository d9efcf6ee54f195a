#include "polestar/render/detail/solid_scene.h"

#include <embree3/rtcore.h>

#include <Eigen/Geometry>
#include <cmath>
#include <string>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/render/detail/creased_normals.h"

namespace polestar::detail {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kPacket = 16;

std::vector<Vec3> unitNormals(const TriMesh& mesh) {
  std::vector<Vec3> normals(mesh.triangles.size());
  parallelChunks(normals.size(), 16384, [&](std::size_t first, std::size_t last) {
    for (std::size_t t = first; t < last; ++t) normals[t] = areaVector(mesh, t).stableNormalized();
  });
  return normals;
}

}  // namespace

/// One stretch of a ray.
struct SolidScene::Query {
  std::uint32_t ray;
  float near, far;
  std::int16_t plane;  ///< where the stretch begins; -1: in the open
};

struct SolidScene::Embree {
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
};

namespace {

/// Fills a packet with stretches of rays, moved by -shift; returns which lanes are in use.
template <class Packet, class Query>
void fillPacket(Packet& packet, int* valid, const RayBundle& rays, std::span<const Query> queries,
                const Vec3f& shift) {
  for (int i = 0; i < kPacket; ++i) {
    const bool used = i < static_cast<int>(queries.size());
    const Query& query = queries[used ? i : 0];
    valid[i] = used ? -1 : 0;
    packet.org_x[i] = rays.origin[0][query.ray] - shift[0];
    packet.org_y[i] = rays.origin[1][query.ray] - shift[1];
    packet.org_z[i] = rays.origin[2][query.ray] - shift[2];
    packet.dir_x[i] = rays.direction[0][query.ray];
    packet.dir_y[i] = rays.direction[1][query.ray];
    packet.dir_z[i] = rays.direction[2][query.ray];
    packet.tnear[i] = query.near;
    packet.tfar[i] = query.far;
    packet.time[i] = 0;
    packet.mask[i] = ~0u;
    packet.id[i] = 0;
    packet.flags[i] = 0;
  }
}

/// Is a crossing so close to its triangle's edge that the neighbour across may be meant?
bool atEdge(float u, float v) {
  constexpr float kClose = 1e-3f;
  return u < kClose || v < kClose || u + v > 1 - kClose;
}

RTCIntersectContext rayContext(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

}  // namespace

SolidScene::SolidScene(TriMesh surface, std::vector<Piece> pieces, double creaseAngle)
    : surface_(std::move(surface)),
      pieces_(std::move(pieces)),
      faceNormals_(unitNormals(surface_)),
      cornerNormals_(creasedNormals(surface_, faceNormals_, creaseAngle)),
      embree_(std::make_unique<Embree>(surface_)) {
  vertices_.reserve(surface_.vertices.size());
  for (const Vec3& v : surface_.vertices) vertices_.push_back(v.cast<float>());
}

SolidScene::~SolidScene() = default;
SolidScene::SolidScene(SolidScene&&) noexcept = default;

/// A ray that touches the solid's silhouette enters and leaves at one edge, and either may be found first:
/// what the way ahead says of being inside then has to be confirmed by the way back.
bool SolidScene::insideBehind(const Vec3f& shift, const RayBundle& rays, const Query& query) const {
  const Vec3f direction = rays.directionOf(query.ray);
  const Vec3f point = rays.originOf(query.ray) - shift + query.near * direction;
  RTCIntersectContext context = rayContext(false);
  RTCRayHit back{};
  back.ray = {point[0],   point[1], point[2], 0, -direction[0], -direction[1], -direction[2], 0,
              query.near, ~0u,      0,        0};
  back.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene, &context, &back);
  return back.hit.geomID != RTC_INVALID_GEOMETRY_ID &&
         Vec3f(back.hit.Ng_x, back.hit.Ng_y, back.hit.Ng_z).dot(direction) < 0;
}

/// Next crossings of the skin. A stretch that begins at a plane and whose next crossing leads out of the
/// solid begins inside of it: what is met there is the plane's cut face, at once.
void SolidScene::trace(std::size_t piece, const RayBundle& rays, std::span<const Query> queries,
                       std::span<SceneHit> hits) const {
  RTCIntersectContext context = rayContext(true);
  const Vec3f shift = pieces_[piece].shift.cast<float>();
  for (std::size_t first = 0; first < queries.size(); first += kPacket) {
    const auto group = queries.subspan(first, std::min<std::size_t>(kPacket, queries.size() - first));
    RTCRayHit16 packet;
    alignas(64) int valid[kPacket];
    fillPacket(packet.ray, valid, rays, group, shift);
    std::fill_n(packet.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
    rtcIntersect16(valid, embree_->scene, &context, &packet);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      const Query& query = group[i];
      SceneHit& hit = hits[query.ray];
      const float along = packet.hit.Ng_x[i] * packet.ray.dir_x[i] +
                          packet.hit.Ng_y[i] * packet.ray.dir_y[i] + packet.hit.Ng_z[i] * packet.ray.dir_z[i];
      bool inside = query.plane >= 0 && along > 0;
      if (query.plane >= 0 && atEdge(packet.hit.u[i], packet.hit.v[i])) {
        const bool confirmed = insideBehind(shift, rays, query);
        if (inside && !confirmed) continue;
        inside = confirmed;
      }
      if (inside) {
        hit.distance = query.near;
        hit.plane = query.plane;
      } else {
        hit.distance = packet.ray.tfar[i];
        hit.plane = -1;
        hit.u = std::clamp(packet.hit.u[i], 0.0f, 1.0f);
        hit.v = std::clamp(packet.hit.v[i], 0.0f, 1 - hit.u);
        hit.triangle = packet.hit.primID[i];
      }
      hit.piece = static_cast<std::int16_t>(piece);
    }
  }
}

void SolidScene::hitNotched(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const {
  const ConvexIntervals notch(pieces_[piece].planes, pieces_[piece].shift, rays);
  std::vector<Query> before, behind;
  before.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto ray = static_cast<std::uint32_t>(i);
    if (notch.empty(i)) {
      before.push_back({ray, 0, hits[i].distance, -1});
      continue;
    }
    if (notch.begin[i] > 0) before.push_back({ray, 0, std::min(notch.begin[i], hits[i].distance), -1});
    if (notch.end[i] < hits[i].distance) {
      behind.push_back({ray, notch.end[i], kInfinity, static_cast<std::int16_t>(notch.exit[i])});
    }
  }
  trace(piece, rays, before, hits);
  std::erase_if(behind, [&](const Query& q) { return hits[q.ray].distance <= q.near; });
  trace(piece, rays, behind, hits);
}

void SolidScene::hitKept(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const {
  const ConvexIntervals kept(pieces_[piece].planes, pieces_[piece].shift, rays);
  std::vector<Query> queries;
  queries.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (kept.empty(i) || kept.begin[i] >= hits[i].distance) continue;
    // What begins at a plane has to see the next crossing, wherever that is.
    queries.push_back({static_cast<std::uint32_t>(i), kept.begin[i],
                       kept.entry[i] >= 0 ? kInfinity : kept.end[i],
                       static_cast<std::int16_t>(kept.entry[i])});
  }
  std::vector<SceneHit> found(rays.size());
  trace(piece, rays, queries, found);
  for (const Query& query : queries) {
    const SceneHit& hit = found[query.ray];
    if (hit.distance <= kept.end[query.ray] && hit.distance < hits[query.ray].distance) hits[query.ray] = hit;
  }
}

void SolidScene::firstHits(const RayBundle& rays, std::span<SceneHit> hits) const {
  std::fill(hits.begin(), hits.end(), SceneHit());
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    pieces_[p].notched ? hitNotched(p, rays, hits) : hitKept(p, rays, hits);
  }
}

void SolidScene::blockNotched(std::size_t piece, const RayBundle& rays, bool coherent,
                              std::span<std::uint8_t> blocked) const {
  const ConvexIntervals notch(pieces_[piece].planes, pieces_[piece].shift, rays);
  std::vector<Query> queries;
  queries.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (blocked[i]) continue;
    const auto ray = static_cast<std::uint32_t>(i);
    if (notch.empty(i) || pieces_[piece].planes.empty()) {
      queries.push_back({ray, 0, kInfinity, -1});
      continue;
    }
    if (notch.begin[i] > 0) queries.push_back({ray, 0, notch.begin[i], -1});
    // A solid that is left at the notch's far side is met by leaving it.
    if (notch.end[i] < kInfinity) queries.push_back({ray, notch.end[i], kInfinity, -1});
  }
  RTCIntersectContext context = rayContext(coherent);
  const Vec3f shift = pieces_[piece].shift.cast<float>();
  for (std::size_t first = 0; first < queries.size(); first += kPacket) {
    const auto group = std::span<const Query>(queries).subspan(
        first, std::min<std::size_t>(kPacket, queries.size() - first));
    RTCRay16 packet;
    alignas(64) int valid[kPacket];
    fillPacket(packet, valid, rays, group, shift);
    rtcOccluded16(valid, embree_->scene, &context, &packet);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (packet.tfar[i] < 0) blocked[group[i].ray] = 1;
    }
  }
}

void SolidScene::blockKept(std::size_t piece, const RayBundle& rays, std::span<std::uint8_t> blocked) const {
  std::vector<SceneHit> hits(rays.size());
  hitKept(piece, rays, hits);
  for (std::size_t i = 0; i < hits.size(); ++i) {
    if (!hits[i].none()) blocked[i] = 1;
  }
}

void SolidScene::occluded(const RayBundle& rays, bool coherent, std::span<std::uint8_t> blocked) const {
  std::fill(blocked.begin(), blocked.end(), std::uint8_t{0});
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    // The whole solid is a solid with a notch of no size.
    const bool whole = pieces_[p].planes.empty() && !pieces_[p].notched;
    pieces_[p].notched || whole ? blockNotched(p, rays, coherent, blocked) : blockKept(p, rays, blocked);
  }
}

ShadingPoint SolidScene::shadingPoint(const SceneHit& hit, const Vec3f& origin,
                                      const Vec3f& direction) const {
  ShadingPoint point;
  const Piece& piece = pieces_[hit.piece];
  if (!hit.skin()) {
    point.normal = ((piece.notched ? -1 : 1) * piece.planes[hit.plane].normal).cast<float>();
    point.shadingNormal = point.normal;
    point.shadowOrigin = origin + hit.distance * direction;
    return point;
  }
  const Triangle& t = surface_.triangles[hit.triangle];
  const auto& normals = cornerNormals_[hit.triangle];
  const float weights[3] = {1 - hit.u - hit.v, hit.u, hit.v};
  const Vec3f position =
      weights[0] * vertices_[t[0]] + weights[1] * vertices_[t[1]] + weights[2] * vertices_[t[2]];
  point.normal = faceNormals_[hit.triangle].cast<float>();
  point.shadingNormal =
      (weights[0] * normals[0] + weights[1] * normals[1] + weights[2] * normals[2]).stableNormalized();
  // The smooth surface that the shading normals pretend bulges out of the facet; shadow rays from the facet
  // would show the facets at the edge of the shade [Hanika 2021, "Hacking the shadow terminator"].
  point.shadowOrigin = position + piece.shift.cast<float>();
  for (int k = 0; k < 3; ++k) {
    const float below = (position - vertices_[t[k]]).dot(normals[k]);
    if (below < 0) point.shadowOrigin -= weights[k] * below * normals[k];
  }
  return point;
}

Vec3 SolidScene::solidPoint(const SceneHit& hit, const Vec3& origin, const Vec3& direction) const {
  if (hit.skin()) {
    const double u = hit.u, v = hit.v;
    return (1 - u - v) * surface_.corner(hit.triangle, 0) + u * surface_.corner(hit.triangle, 1) +
           v * surface_.corner(hit.triangle, 2);
  }
  const Piece& piece = pieces_[hit.piece];
  const Plane& plane = piece.planes[hit.plane];
  // Where the ray was when it was found to be inside; down to the plane by the shortest way, since along a
  // ray that grazes it rounding would become a long one.
  const Vec3 near = origin - piece.shift + static_cast<double>(hit.distance) * direction;
  return near - plane.height(near) * plane.normal;
}

std::vector<Vec3> SolidScene::outline() const {
  std::vector<Vec3> points;
  for (const Piece& piece : pieces_) {
    for (const Vec3& v : surface_.vertices) {
      if (piece.holds(v)) points.push_back(v + piece.shift);
    }
    for (const Plane& plane : piece.planes) {
      for (std::size_t t = 0; t < surface_.triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
          const Vec3 &a = surface_.corner(t, k), &b = surface_.corner(t, (k + 1) % 3);
          const double below = plane.height(a), above = plane.height(b);
          if (!(below < 0 && above > 0)) continue;  // every edge is met once, from its lower end
          const Vec3 crossing = a + below / (below - above) * (b - a);
          const bool bounds = std::all_of(piece.planes.begin(), piece.planes.end(), [&](const Plane& other) {
            return &other == &plane || other.height(crossing) <= 0;
          });
          if (bounds) points.push_back(crossing + piece.shift);
        }
      }
    }
  }
  return points;
}

}  // namespace polestar::detail
