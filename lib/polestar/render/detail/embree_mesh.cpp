#include "polestar/render/detail/embree_mesh.h"

#include <algorithm>
#include <string>

#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

constexpr int kPacketSize = EmbreeMesh::kPacket;

/// Fills a packet with stretches of rays, moved by -shift; returns which lanes are in use.
void fillPacket(RTCRay16& packet, int* valid, const RayBundle& rays, std::span<const RayStretch> stretches,
                const Vec3f& shift) {
  for (int i = 0; i < kPacketSize; ++i) {
    const bool used = i < static_cast<int>(stretches.size());
    const RayStretch& stretch = stretches[used ? i : 0];
    valid[i] = used ? -1 : 0;
    packet.org_x[i] = rays.origin[0][stretch.ray] - shift[0];
    packet.org_y[i] = rays.origin[1][stretch.ray] - shift[1];
    packet.org_z[i] = rays.origin[2][stretch.ray] - shift[2];
    packet.dir_x[i] = rays.direction[0][stretch.ray];
    packet.dir_y[i] = rays.direction[1][stretch.ray];
    packet.dir_z[i] = rays.direction[2][stretch.ray];
    packet.tnear[i] = stretch.near;
    packet.tfar[i] = stretch.far;
    packet.time[i] = 0;
    packet.mask[i] = ~0u;
    packet.id[i] = 0;
    packet.flags[i] = 0;
  }
}

RTCIntersectContext rayContext(bool coherent) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  return context;
}

}  // namespace

EmbreeMesh::EmbreeMesh(const TriMesh& mesh) : device_(rtcNewDevice(nullptr)) {
  if (!device_) {
    throw Error(Errc::io, "Embree cannot start (error " + std::to_string(rtcGetDeviceError(nullptr)) + ")");
  }
  scene_ = rtcNewScene(device_);
  // Robust: neighbouring triangles leave no gap along their edge.
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST);
  RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
  auto* indices = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
      geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(unsigned), mesh.triangles.size()));
  if (vertices && indices) {
    for (const Vec3& v : mesh.vertices) vertices = std::copy_n(v.cast<float>().eval().data(), 3, vertices);
    for (const Triangle& t : mesh.triangles) indices = std::copy_n(t.data(), 3, indices);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcCommitScene(scene_);
  }
  rtcReleaseGeometry(geometry);
  if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE) {
    release();
    throw Error(Errc::io, "Embree cannot build its scene of " + std::to_string(mesh.triangles.size()) +
                              " triangles (error " + std::to_string(error) + ")");
  }
}

EmbreeMesh::~EmbreeMesh() { release(); }

void EmbreeMesh::release() {
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

RTCRayHit16 EmbreeMesh::firstHits(const RayBundle& rays, std::span<const RayStretch> stretches,
                                  const Vec3f& shift) const {
  RTCIntersectContext context = rayContext(true);
  RTCRayHit16 packet;
  alignas(64) int valid[kPacket];
  fillPacket(packet.ray, valid, rays, stretches, shift);
  std::fill_n(packet.hit.geomID, kPacket, RTC_INVALID_GEOMETRY_ID);
  rtcIntersect16(valid, scene_, &context, &packet);
  return packet;
}

void EmbreeMesh::block(const RayBundle& rays, std::span<const RayStretch> stretches, const Vec3f& shift,
                       bool coherent, std::span<std::uint8_t> blocked) const {
  RTCIntersectContext context = rayContext(coherent);
  for (std::size_t first = 0; first < stretches.size(); first += kPacket) {
    const auto group = stretches.subspan(first, std::min(kPacket, stretches.size() - first));
    RTCRay16 packet;
    alignas(64) int valid[kPacket];
    fillPacket(packet, valid, rays, group, shift);
    rtcOccluded16(valid, scene_, &context, &packet);
    for (std::size_t i = 0; i < group.size(); ++i) {
      if (packet.tfar[i] < 0) blocked[group[i].ray] = 1;
    }
  }
}

}  // namespace polestar::detail
