#include "polestar/texture/detail/fan.h"

namespace polestar::detail {

Fan::Fan(const VaryingPoint& ball, double halfLength) {
  if (halfLength > 0) foot = halfLength * (ball.z / sqrt(ball.z * ball.z + halfLength * halfLength));
  const VaryingPoint arm(ball.x, ball.y, ball.z - foot);
  distance = norm(arm);
  direction = arm / distance;
}

Vec3 fanDirection(const Vec3& ball, double halfLength) {
  const double foot = halfLength > 0 ? halfLength * ball[2] / std::hypot(ball[2], halfLength) : 0;
  const Vec3 arm = ball - Vec3(0, 0, foot);
  const double distance = arm.norm();
  return distance > kTiny ? Vec3(arm / distance) : Vec3(Vec3::Zero());
}

Varying fanStreaks(const Fan& fan, const Footprint& footprint, const Streaks& streaks, std::uint32_t seed) {
  // Noise on a sphere of radius 2^level, where level is the whole number below log2(distance / thickness),
  // and on the next larger one: blended, the streaks have the same thickness at every distance.
  const Varying level = log(fan.distance / streaks.thickness) * (1 / std::log(2.0));
  const double lower = std::max(0.0, std::floor(level.value));
  const double blend = std::clamp(level.value - lower, 0.0, 1.0);
  const Varying along = fan.distance / (streaks.thickness * streaks.stretch);
  const Varying lengthwise = fan.foot / streaks.thickness;
  const double apart = smoothStep(0.5, 2.5, fan.distance.value / streaks.thickness);
  Varying sum;
  if (apart == 0) return sum;
  for (const int step : {0, 1}) {
    // Squares of the weights sum to 1: the variance is even.
    const double share = step == 0 ? 1 - blend : blend;
    if (share == 0) continue;
    const Varying radius = along + std::exp2(lower + step);
    VaryingPoint domain = radius * fan.direction;
    domain.z = domain.z + lengthwise;
    const auto salt = static_cast<std::uint32_t>(lower) + static_cast<std::uint32_t>(step);
    sum = sum + std::sqrt(share) * noise(domain, footprint.in(domain), seed + 0x9e3779b9u * salt);
  }
  return apart * sum;
}

}  // namespace polestar::detail
