#include "polestar/render/detail/solid_scene.h"

#include <Eigen/Geometry>
#include <cmath>
#include <optional>

#include "polestar/render/detail/embree_mesh.h"

namespace polestar::detail {
namespace {

constexpr float kInfinity = std::numeric_limits<float>::infinity();

/// Is a crossing so close to its triangle's edge that the neighbour across may be meant?
bool atEdge(float u, float v) {
  constexpr float kClose = 1e-3f;
  return u < kClose || v < kClose || u + v > 1 - kClose;
}

/// All of them as one mesh.
TriMesh united(const std::vector<TriMesh>& meshes) {
  TriMesh all;
  for (const TriMesh& mesh : meshes) {
    const auto first = static_cast<std::int32_t>(all.vertices.size());
    all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
    for (const Triangle& t : mesh.triangles)
      all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  return all;
}

std::vector<std::int16_t> numberOfEach(const std::vector<TriMesh>& meshes) {
  std::vector<std::int16_t> numbers;
  for (std::size_t i = 0; i < meshes.size(); ++i)
    numbers.resize(numbers.size() + meshes[i].triangles.size(), static_cast<std::int16_t>(i));
  return numbers;
}

}  // namespace

struct SolidScene::Embree {
  EmbreeMesh skin;
  std::optional<EmbreeMesh> objects;

  Embree(const TriMesh& surface, const TriMesh& others) : skin(surface) {
    if (!others.triangles.empty()) objects.emplace(others);
  }
};

SolidScene::SolidScene(SceneParts parts, double creaseAngle)
    : pieces_(std::move(parts.pieces)),
      hollow_(parts.hollow),
      objectOf_(numberOfEach(parts.objects)),
      skin_(std::move(parts.surface), creaseAngle),
      objects_(united(parts.objects), creaseAngle),
      embree_(std::make_unique<Embree>(skin_.mesh(), objects_.mesh())) {}

SolidScene::~SolidScene() = default;
SolidScene::SolidScene(SolidScene&&) noexcept = default;

/// A ray that touches the solid's silhouette enters and leaves at one edge, and either may be found first:
/// what the way ahead says of being inside then has to be confirmed by the way back.
bool SolidScene::insideBehind(const Vec3f& shift, const RayBundle& rays, const RayStretch& stretch) const {
  const Vec3f direction = rays.directionOf(stretch.ray);
  const Vec3f point = rays.originOf(stretch.ray) - shift + stretch.near * direction;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit back{};
  back.ray = {point[0],     point[1], point[2], 0, -direction[0], -direction[1], -direction[2], 0,
              stretch.near, ~0u,      0,        0};
  back.hit.geomID = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->skin.scene(), &context, &back);
  return back.hit.geomID != RTC_INVALID_GEOMETRY_ID &&
         Vec3f(back.hit.Ng_x, back.hit.Ng_y, back.hit.Ng_z).dot(direction) < 0;
}

/// Next crossings of the skin. A stretch that begins at a plane and whose next crossing leads out of the
/// solid begins inside of it: what is met there is the plane's cut face, at once.
void SolidScene::trace(std::size_t piece, const RayBundle& rays, std::span<const RayStretch> stretches,
                       std::span<SceneHit> hits) const {
  const Vec3f shift = pieces_[piece].shift.cast<float>();
  for (std::size_t first = 0; first < stretches.size(); first += EmbreeMesh::kPacket) {
    const auto group = stretches.subspan(first, std::min(EmbreeMesh::kPacket, stretches.size() - first));
    const RTCRayHit16 packet = embree_->skin.firstHits(rays, group, shift);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      const RayStretch& query = group[i];
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
  std::vector<RayStretch> before, behind;
  before.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto ray = static_cast<std::uint32_t>(i);
    if (notch.empty(i)) {
      before.push_back({ray, 0, hits[i].distance, -1});
      continue;
    }
    if (notch.begin[i] > 0) before.push_back({ray, 0, std::min(notch.begin[i], hits[i].distance), -1});
    if (notch.end[i] < hits[i].distance) {
      behind.push_back({ray, notch.end[i], kInfinity,
                        hollow_ ? std::int16_t{-1} : static_cast<std::int16_t>(notch.exit[i])});
    }
  }
  trace(piece, rays, before, hits);
  std::erase_if(behind, [&](const RayStretch& q) { return hits[q.ray].distance <= q.near; });
  trace(piece, rays, behind, hits);
}

void SolidScene::hitKept(std::size_t piece, const RayBundle& rays, std::span<SceneHit> hits) const {
  const ConvexIntervals kept(pieces_[piece].planes, pieces_[piece].shift, rays);
  std::vector<RayStretch> queries;
  queries.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (kept.empty(i) || kept.begin[i] >= hits[i].distance) continue;
    // What begins at the plane of a cut face has to see the next crossing, wherever that is.
    const bool cutFace = kept.entry[i] >= 0 && !hollow_;
    queries.push_back({static_cast<std::uint32_t>(i), kept.begin[i], cutFace ? kInfinity : kept.end[i],
                       cutFace ? static_cast<std::int16_t>(kept.entry[i]) : std::int16_t{-1}});
  }
  std::vector<SceneHit> found(rays.size());
  trace(piece, rays, queries, found);
  for (const RayStretch& query : queries) {
    const SceneHit& hit = found[query.ray];
    if (hit.distance <= kept.end[query.ray] && hit.distance < hits[query.ray].distance) hits[query.ray] = hit;
  }
}

void SolidScene::firstHits(const RayBundle& rays, std::span<SceneHit> hits) const {
  std::fill(hits.begin(), hits.end(), SceneHit());
  for (std::size_t p = 0; p < pieces_.size(); ++p) {
    pieces_[p].notched ? hitNotched(p, rays, hits) : hitKept(p, rays, hits);
  }
  if (embree_->objects) hitObjects(rays, hits);
}

void SolidScene::hitObjects(const RayBundle& rays, std::span<SceneHit> hits) const {
  std::vector<RayStretch> stretches;
  stretches.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i)
    stretches.push_back({static_cast<std::uint32_t>(i), 0, hits[i].distance, -1});
  for (std::size_t first = 0; first < stretches.size(); first += EmbreeMesh::kPacket) {
    const auto group = std::span<const RayStretch>(stretches).subspan(
        first, std::min(EmbreeMesh::kPacket, stretches.size() - first));
    const RTCRayHit16 packet = embree_->objects->firstHits(rays, group, Vec3f::Zero());
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
      SceneHit& hit = hits[group[i].ray];
      hit.distance = packet.ray.tfar[i];
      hit.u = std::clamp(packet.hit.u[i], 0.0f, 1.0f);
      hit.v = std::clamp(packet.hit.v[i], 0.0f, 1 - hit.u);
      hit.triangle = packet.hit.primID[i];
      hit.piece = 0;
      hit.plane = -1;
      hit.object = objectOf_[hit.triangle];
    }
  }
}

void SolidScene::blockNotched(std::size_t piece, const RayBundle& rays, bool coherent,
                              std::span<std::uint8_t> blocked) const {
  const ConvexIntervals notch(pieces_[piece].planes, pieces_[piece].shift, rays);
  std::vector<RayStretch> queries;
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
  embree_->skin.block(rays, queries, pieces_[piece].shift.cast<float>(), coherent, blocked);
}

void SolidScene::blockObjects(const RayBundle& rays, bool coherent, std::span<std::uint8_t> blocked) const {
  std::vector<RayStretch> stretches;
  stretches.reserve(rays.size());
  for (std::size_t i = 0; i < rays.size(); ++i) {
    if (!blocked[i]) stretches.push_back({static_cast<std::uint32_t>(i), 0, kInfinity, -1});
  }
  embree_->objects->block(rays, stretches, Vec3f::Zero(), coherent, blocked);
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
  if (embree_->objects) blockObjects(rays, coherent, blocked);
}

ShadingPoint SolidScene::shadingPoint(const SceneHit& hit, const Vec3f& origin,
                                      const Vec3f& direction) const {
  if (hit.plane >= 0) {
    const Piece& piece = pieces_[hit.piece];
    const Vec3f normal = ((piece.notched ? -1 : 1) * piece.planes[hit.plane].normal).cast<float>();
    return {normal, normal, origin + hit.distance * direction};
  }
  const SmoothMesh& mesh = hit.object < 0 ? skin_ : objects_;
  const bool behind =
      (hollow_ || hit.object >= 0) && mesh.faceNormal(hit.triangle).cast<float>().dot(direction) > 0;
  ShadingPoint point = mesh.shadingPoint(hit.triangle, hit.u, hit.v, behind ? -1 : 1);
  point.shadowOrigin += shiftOf(hit).cast<float>();
  return point;
}

Vec3 SolidScene::solidPoint(const SceneHit& hit, const Vec3& origin, const Vec3& direction) const {
  if (hit.plane < 0) {
    return (hit.object < 0 ? skin_ : objects_).point(hit.triangle, hit.u, hit.v);
  }
  const Piece& piece = pieces_[hit.piece];
  const Plane& plane = piece.planes[hit.plane];
  // Where the ray was when it was found to be inside; down to the plane by the shortest way, since along a
  // ray that grazes it rounding would become a long one.
  const Vec3 near = origin - piece.shift + static_cast<double>(hit.distance) * direction;
  return near - plane.height(near) * plane.normal;
}

std::vector<Vec3> SolidScene::outline() const {
  std::vector<Vec3> points = objects_.mesh().vertices;
  for (const Piece& piece : pieces_) {
    for (const Vec3& v : skin_.mesh().vertices) {
      if (piece.holds(v)) points.push_back(v + piece.shift);
    }
    for (const Plane& plane : piece.planes) {
      for (std::size_t t = 0; t < skin_.mesh().triangles.size(); ++t) {
        for (int k = 0; k < 3; ++k) {
          const Vec3 &a = skin_.mesh().corner(t, k), &b = skin_.mesh().corner(t, (k + 1) % 3);
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
