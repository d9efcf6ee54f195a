#include "polestar/render/detail/studio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace polestar::detail {
namespace {

constexpr double kKeyRadius = 0.22;     // tangent of the key light's angular radius
constexpr double kKeyStrength = 0.80;   // of the light on a white surface that faces the key
constexpr double kDomeStrength = 0.50;  // of the light on a white surface under the open dome
constexpr double kBounce = 0.42;        // what a shaded neighbour sends back, relative to the open dome
constexpr double kFloorBounce = 0.62;   // the same for the floor
constexpr double kRimStrength = 0.16;
constexpr double kRayOffset = 1e-4;  // of shadow rays, in units of the solid's half diagonal

void makeBasis(const Vec3& axis, Vec3& first, Vec3& second) {
  first = axis.cross(std::abs(axis[2]) < 0.9 ? Vec3::UnitZ() : Vec3::UnitX()).normalized();
  second = axis.cross(first);
}

Eigen::Vector2d diskPoint(const Eigen::Vector2d& u) {
  const double r = std::sqrt(u[0]), angle = 2 * std::numbers::pi * u[1];
  return {r * std::cos(angle), r * std::sin(angle)};
}

Vec3 cosineDirection(const Vec3& normal, const Eigen::Vector2d& u) {
  Vec3 first, second;
  makeBasis(normal, first, second);
  const Eigen::Vector2d d = diskPoint(u);
  return d[0] * first + d[1] * second + std::sqrt(std::max(0.0, 1 - u[0])) * normal;
}

/// Schlick's approximation for a coat of index 1.5.
double fresnel(double cosine) { return 0.04 + 0.96 * std::pow(1 - std::clamp(cosine, 0.0, 1.0), 5); }

}  // namespace

Studio::Studio(const Camera& camera, const Vec3& up, double floor, double keySide, const Vec3f& background)
    : up_(up), floor_(floor), background_(background) {
  const Vec3 back = -camera.forward();
  const Vec3 side = (keySide > 0 ? 1 : -1) * camera.right();
  key_ = (0.7 * side + 0.9 * up + 0.8 * back).normalized();
  rim_ = (-0.9 * side + 0.35 * up - 0.45 * back).normalized();
  makeBasis(key_, keyRight_, keyUp_);
}

Vec3 Studio::keyDirection(const Eigen::Vector2d& sample) const {
  const Eigen::Vector2d d = kKeyRadius * diskPoint(sample);
  return (key_ + d[0] * keyRight_ + d[1] * keyUp_).normalized();
}

double Studio::domeRadiance(const Vec3& direction) const {
  const double height = direction.dot(up_);
  if (height < 0) return kFloorBounce;
  return 0.78 + 0.34 * height;
}

Vec3f Studio::backdrop(double vignette) const {
  return static_cast<float>(1 - 0.2 * vignette * vignette) * background_;
}

Vec3f Studio::shadeSolid(const CutScene& scene, const SolidHit& hit, const Vec3& normal,
                         const Material& material, const Vec3& toViewer, const LightSample& sample) const {
  const Vec3 origin = hit.shadowOrigin + kRayOffset * hit.normal;
  const Vec3 toKey = keyDirection(sample.key);
  const double keyCosine = normal.dot(toKey);
  const bool keySeen = keyCosine > 0 && hit.normal.dot(toKey) > 0 && !scene.occluded({origin, toKey});

  const Vec3 domeDirection = cosineDirection(normal, sample.dome);
  const bool domeSeen = hit.normal.dot(domeDirection) > 0 && !scene.occluded({origin, domeDirection});
  const double dome = kDomeStrength * (domeSeen ? domeRadiance(domeDirection) : kBounce);
  const double rim = kRimStrength * std::max(0.0, normal.dot(rim_));
  const double key = keySeen ? kKeyStrength * keyCosine : 0;
  // The key is a little warm, the dome a little cool, and what comes back from the warm cut surfaces warm.
  const Vec3f warm(1.03f, 1.0f, 0.95f), cool(0.98f, 1.0f, 1.03f), bounced(1.14f, 1.0f, 0.84f);
  const Vec3f keyLight = static_cast<float>(key) * warm;
  const Vec3f domeLight =
      static_cast<float>(dome) * (domeSeen ? cool : bounced) + static_cast<float>(rim) * cool;
  Vec3f light = material.albedo.cwiseProduct(keyLight + domeLight);

  if (material.gloss > 0) {
    const Vec3 half = (toKey + toViewer).normalized();
    const double lobe =
        keySeen ? 6 * std::pow(std::max(0.0, normal.dot(half)), 60) * fresnel(toViewer.dot(half)) : 0;
    const double facing = normal.dot(toViewer);
    const Vec3 mirrored = 2 * facing * normal - toViewer;
    const double sheen = kDomeStrength * fresnel(facing) * domeRadiance(mirrored) * (domeSeen ? 1 : 0.3);
    light += Vec3f::Constant(material.gloss * static_cast<float>(lobe * std::max(0.0, keyCosine) + sheen));
  }
  return light;
}

Vec3f Studio::shadeBackdrop(const CutScene& scene, const Ray& ray, double vignette,
                            const LightSample& sample) const {
  const double fall = ray.direction.dot(up_);
  if (fall >= 0) return backdrop(vignette);
  const double distance = (floor_ - ray.origin.dot(up_)) / fall;
  if (distance <= 0) return backdrop(vignette);
  const Vec3 origin = ray.origin + distance * ray.direction;
  const Vec3 toKey = keyDirection(sample.key), domeDirection = cosineDirection(up_, sample.dome);
  const double key = kKeyStrength * key_.dot(up_);
  const double lostKey = scene.occluded({origin, toKey}) ? key : 0;
  const double lostDome = scene.occluded({origin, domeDirection}) ? kDomeStrength * (1 - 0.5 * kBounce) : 0;
  const double share = 1 - (lostKey + lostDome) / (key + kDomeStrength);
  // Shade is lit by the cool dome.
  const float s = static_cast<float>(share);
  return backdrop(vignette).cwiseProduct(Vec3f(std::pow(s, 1.04f), s, std::pow(s, 0.94f)));
}

}  // namespace polestar::detail
