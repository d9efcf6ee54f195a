#include "polestar/render/detail/linear_ball.h"

#include <algorithm>
#include <cmath>

namespace polestar::detail {
namespace {

constexpr double kSecondTry = 4e-6;  // of the way to the center: what rays in single precision may miss
constexpr double kLongestStep = 2;   // of finite differences, in widths of the pixel

Vec3 inward(const Vec3& point, const Vec3& center) {
  return center.allFinite() ? Vec3(point + kSecondTry * (center - point)) : point;
}

/// Points to be looked up, each with another that is taken where the first has no coordinates.
class TwoTries {
 public:
  void add(const Vec3& point, const Vec3& fallback) {
    points_.push_back(point);
    fallbacks_.push_back(fallback);
  }
  void run(const BallLookup& lookup) {
    ball_.resize(points_.size());
    lookup(points_, ball_);
    std::vector<Vec3> again, result;
    for (std::size_t i = 0; i < ball_.size(); ++i) {
      fellBack_.push_back(!ball_[i].allFinite());
      if (fellBack_[i]) again.push_back(fallbacks_[i]);
    }
    result.resize(again.size());
    if (!again.empty()) lookup(again, result);
    std::size_t next = 0;
    for (std::size_t i = 0; i < ball_.size(); ++i) {
      if (fellBack_[i]) ball_[i] = result[next++];
    }
  }
  const Vec3& ball(std::size_t i) const { return ball_[i]; }
  /// Change per length from point `base` to point `i`, which is `step` away, or -step where it fell back.
  /// Where both neighbours have no coordinates, the unit ball's own derivatives give patterns of common size.
  Vec3 slope(std::size_t base, std::size_t i, double step, const Vec3& tangent) const {
    const Vec3 change = (ball_[i] - ball_[base]) / (fellBack_[i] ? -step : step);
    return change.allFinite() ? change : tangent;
  }

 private:
  std::vector<Vec3> points_, fallbacks_, ball_;
  std::vector<std::uint8_t> fellBack_;
};

}  // namespace

Vec3 LinearBall::at(const SurfaceTap& tap, bool skin) const {
  const Vec3 b = ball + tap.first * alongFirst + tap.second * alongSecond;
  const double radius = b.norm();
  return radius > 0 && (skin || radius > 1) ? Vec3(b / radius) : b;
}

std::vector<LinearBall> linearBalls(std::span<const SurfacePatch> patches, const Vec3& center,
                                    const BallLookup& lookup) {
  const auto longStep = [](const SurfacePatch& patch) {
    return std::min(patch.pixelSecond, kLongestStep * patch.pixelFirst);
  };
  TwoTries tries;
  for (const SurfacePatch& patch : patches) {
    const Vec3 point = patch.skin ? Vec3(patch.point - 0.5 * patch.pixelFirst * patch.normal) : patch.point;
    const Vec3 first = patch.pixelFirst * patch.first, second = longStep(patch) * patch.second;
    tries.add(point, inward(patch.point, center));
    tries.add(point + first, point - first);
    tries.add(point + second, point - second);
  }
  tries.run(lookup);
  std::vector<LinearBall> balls(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    balls[i].ball = tries.ball(3 * i);
    balls[i].alongFirst = tries.slope(3 * i, 3 * i + 1, patches[i].pixelFirst, patches[i].first);
    balls[i].alongSecond = tries.slope(3 * i, 3 * i + 2, longStep(patches[i]), patches[i].second);
    if (!patches[i].skin || !balls[i].known()) continue;
    // R = 1 all over the skin.
    const Vec3 radial = balls[i].ball.stableNormalized();
    balls[i].alongFirst -= radial.dot(balls[i].alongFirst) * radial;
    balls[i].alongSecond -= radial.dot(balls[i].alongSecond) * radial;
  }
  return balls;
}

void ballCoordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, const Vec3& center,
                     const BallLookup& lookup, std::span<Vec3> ball) {
  TwoTries tries;
  for (const Vec3& point : points) tries.add(point, inward(point, center));
  tries.run(lookup);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ball[i] = tries.ball(i);
    if (skin[i]) ball[i].stableNormalize();
  }
}

void drawIsoLines(const IsoLines& lines, std::span<const SurfacePatch> patches,
                  std::span<const SurfaceTap> taps, std::span<const LinearBall> balls, double share,
                  std::span<SurfaceLook> looks) {
  if (!lines.any()) return;
  for (std::size_t i = 0; i < taps.size(); ++i) {
    const SurfacePatch& patch = patches[taps[i].patch];
    const LinearBall& ball = balls[taps[i].patch];
    if (!looks[i].known || !ball.known()) continue;
    const BallFootprint at{ball.at(taps[i], patch.skin), patch.pixelFirst * ball.alongFirst,
                           patch.pixelSecond * ball.alongSecond, patch.skin};
    const auto covered = static_cast<float>(isoLineCoverage(lines, at, share));
    looks[i].color += covered * (lines.color - looks[i].color);
  }
}

}  // namespace polestar::detail
