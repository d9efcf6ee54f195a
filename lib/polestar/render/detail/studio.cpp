#include "polestar/render/detail/studio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace polestar::detail {
namespace {

constexpr float kKeyRadius = 0.22f;     // tangent of the key light's angular radius
constexpr float kKeyStrength = 0.80f;   // of the light on a white surface that faces the key
constexpr float kDomeStrength = 0.50f;  // of the light on a white surface under the open dome
constexpr float kBounce = 0.42f;        // what a shaded neighbour sends back, relative to the open dome
constexpr float kFloorBounce = 0.62f;   // the same for the floor
constexpr float kRimStrength = 0.16f;
// Light that is scattered once and comes straight back from a deep fog is half of what the fog got; scattered
// more often, nearly all of it comes back.
constexpr float kFogGain = 2;

// The key is a little warm, the dome a little cool, and what comes back from the warm cut surfaces warm.
const Vec3f kWarm(1.03f, 1.0f, 0.95f), kCool(0.98f, 1.0f, 1.03f), kBounced(1.14f, 1.0f, 0.84f);

void makeBasis(const Vec3f& axis, Vec3f& first, Vec3f& second) {
  first = axis.cross(std::abs(axis[2]) < 0.9f ? Vec3f::UnitZ() : Vec3f::UnitX()).normalized();
  second = axis.cross(first);
}

/// Schlick's approximation for a coat of index 1.5.
float fresnel(float cosine) {
  const float m = 1 - std::clamp(cosine, 0.0f, 1.0f), squared = m * m;
  return 0.04f + 0.96f * squared * squared * m;
}

/// x^60
float lobe(float x) {
  const float x4 = x * x * x * x, x12 = x4 * x4 * x4, x15 = x12 * x * x * x, x30 = x15 * x15;
  return x30 * x30;
}

}  // namespace

Studio::Studio(const Camera& camera, const StudioSettings& settings)
    : settings_(settings), up_(settings.up.cast<float>()) {
  const Vec3 back = -camera.forward();
  const Vec3 side = (settings.keySide > 0 ? 1 : -1) * camera.right();
  key_ = (0.7 * side + 0.9 * settings.up + 0.8 * back).normalized().cast<float>();
  rim_ = (-0.9 * side + 0.35 * settings.up - 0.45 * back).normalized().cast<float>();
  makeBasis(key_, keyRight_, keyUp_);
}

Vec3f Studio::keyDirection(const DiskPoint& sample) const {
  const DiskPoint d = kKeyRadius * static_cast<float>(settings_.keySize) * sample;
  return (key_ + d[0] * keyRight_ + d[1] * keyUp_).normalized();
}

Vec3f Studio::domeDirection(const Vec3f& normal, const DiskPoint& sample) {
  Vec3f first, second;
  makeBasis(normal, first, second);
  return sample[0] * first + sample[1] * second +
         std::sqrt(std::max(0.0f, 1 - sample.squaredNorm())) * normal;
}

float Studio::domeRadiance(const Vec3f& direction) const {
  const float height = direction.dot(up_);
  return height < 0 ? kFloorBounce : 0.78f + 0.34f * height;
}

SolidLight Studio::onSolid(const Vec3f& normal, const Vec3f& toViewer, const LightSeen& seen) const {
  SolidLight light;
  const float keyCosine = std::max(0.0f, normal.dot(seen.toKey));
  const float dome = kDomeStrength * (seen.dome ? domeRadiance(seen.toDome) : kBounce);
  const float rim = kRimStrength * std::max(0.0f, normal.dot(rim_));
  light.diffuse = dome * (seen.dome ? kCool : kBounced) + rim * kCool;
  if (seen.key) {
    light.diffuse += kKeyStrength * keyCosine * kWarm;
    const Vec3f half = (seen.toKey + toViewer).normalized();
    light.sheen = 6 * lobe(std::max(0.0f, normal.dot(half))) * fresnel(toViewer.dot(half)) * keyCosine;
  }
  const float facing = normal.dot(toViewer);
  const Vec3f mirrored = 2 * facing * normal - toViewer;
  light.sheen += kDomeStrength * fresnel(facing) * domeRadiance(mirrored) * (seen.dome ? 1.0f : 0.3f);
  return light;
}

Vec3f Studio::sphereDirection(const DiskPoint& sample) {
  // The squared radius is uniform, and so is the height on a sphere [Marsaglia 1972].
  const float squared = std::min(1.0f, sample.squaredNorm());
  const float scale = 2 * std::sqrt(1 - squared);
  return {scale * sample[0], scale * sample[1], 1 - 2 * squared};
}

Vec3f Studio::inFog(float keyShare, const Vec3f& toDome, float domeShare) const {
  // Irradiance of the whole sphere, shared out over all directions; a wall gets half the dome.
  return kFogGain * (0.5f * kKeyStrength * keyShare * kWarm +
                     0.5f * kDomeStrength * domeRadiance(toDome) * domeShare * kCool);
}

std::optional<Vec3f> Studio::floorPoint(const Vec3f& origin, const Vec3f& direction) const {
  const float fall = direction.dot(up_);
  if (!settings_.hasFloor || fall >= 0) return std::nullopt;
  const float distance = (static_cast<float>(settings_.floor) - origin.dot(up_)) / fall;
  if (!(distance > 0)) return std::nullopt;
  return origin + distance * direction;
}

Eigen::Vector4f Studio::backdrop(float vignette, float keyLost, float domeLost) const {
  const float key = kKeyStrength * key_.dot(up_);
  const float lost = keyLost * key + domeLost * kDomeStrength * (1 - 0.5f * kBounce);
  const float share = 1 - lost / (key + kDomeStrength);
  Eigen::Vector4f result(0, 0, 0, 1);
  if (settings_.transparent) {
    result[3] = 1 - share;
    return result;
  }
  // Shade is lit by the cool dome.
  const Vec3f shade =
      lost > 0 ? Vec3f(std::pow(share, 1.04f), share, std::pow(share, 0.94f)) : Vec3f(1, 1, 1);
  result.head<3>() = (1 - 0.2f * vignette * vignette) * settings_.background.cwiseProduct(shade);
  return result;
}

}  // namespace polestar::detail
