#include "polestar/texture/detail/point_texture.h"

namespace polestar::detail {
namespace {

/// Far beyond the ball, where every pattern has given way to its mean; squares and cubes stay finite.
constexpr double kLargestFootprint = 1e3;

Mat3 bounded(const Mat3& footprint) {
  const double size = footprint.cwiseAbs().maxCoeff();
  return size > kLargestFootprint ? Mat3(footprint * (kLargestFootprint / size)) : footprint;
}

/// To second order, so that the center, where the radius has no gradient, is not taken for a point at
/// radius 0: what varies across the direction adds to the mean.
Varying meanRadius(const Vec3& ball, const Footprint& footprint) {
  const double radius = ball.norm();
  const Vec3 direction = radius > 0 ? Vec3(ball / radius) : Vec3::Zero();
  const double across = footprint.variance() - footprint.varianceAlong(direction);
  const double mean = std::sqrt(radius * radius + across);
  // The direction's share of the mean; the rest of the variance has no gradient.
  const double share = mean > 0 ? radius / mean : 0;
  return {mean, share * direction, (1 - share) * footprint.variance() / 9};
}

}  // namespace

Place::Place(const TexturePoint& asked)
    : ball(asked.ball), footprint(bounded(asked.footprint)), point{asked.ball, bounded(asked.footprint)} {
  radius = meanRadius(point.ball, footprint);
}

std::array<TexturePoint, 8> octants(const TexturePoint& point) {
  std::array<TexturePoint, 8> parts;
  for (int i = 0; i < 8; ++i) {
    const Vec3 offset(i & 1 ? 0.25 : -0.25, i & 2 ? 0.25 : -0.25, i & 4 ? 0.25 : -0.25);
    parts[i] = {point.ball + point.footprint * offset, point.footprint / 2};
  }
  return parts;
}

void PointTexture::sample(std::span<const TexturePoint> points, std::span<TextureSample> samples) const {
  for (std::size_t i = 0; i < points.size(); ++i) samples[i] = at(Place(points[i]));
}

void FiberTexture::fiber(std::span<const Vec3> ball, std::span<Vec3> direction) const {
  for (std::size_t i = 0; i < ball.size(); ++i) direction[i] = fiberAt(ball[i]);
}

}  // namespace polestar::detail
