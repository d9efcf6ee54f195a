#include "ball_view.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace polestar::bench {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr float kBackground = 0.72f;

struct Hit {
  bool any = false, cut = false;
  Vec3 position = Vec3::Zero(), normal = Vec3::Zero();
};

/// Where the ray from infinity towards -z' meets what the cuts leave.
Hit firstHit(const Vec3& onScreen, const BallView& view) {
  const Vec3 direction = -view.towardsCamera;
  const double squared = onScreen.squaredNorm();
  if (squared >= 1) return {};
  double enter = -std::sqrt(1 - squared);
  const double leave = -enter;
  Hit hit{true, false, onScreen + enter * direction, onScreen + enter * direction};
  // The interval in which the ray runs through what is cut away: a convex wedge.
  double from = view.cuts.empty() ? kInfinity : -kInfinity, to = kInfinity;
  Vec3 wall = Vec3::Zero();
  for (const Vec3& normal : view.cuts) {
    const double speed = normal.dot(direction), height = normal.dot(onScreen - view.corner);
    if (std::abs(speed) < 1e-12) {
      if (height <= 0) from = kInfinity;
    } else if (speed > 0) {
      from = std::max(from, -height / speed);
    } else if (-height / speed < to) {
      to = -height / speed;
      wall = normal;
    }
  }
  if (from >= to || from > enter || to <= enter) return hit;
  if (to >= leave) return {};
  hit.cut = true;
  hit.position = onScreen + to * direction;
  hit.normal = wall;
  return hit;
}

/// How the point that is seen moves with the picture's axes, over one sample.
TexturePoint texturePoint(const Hit& hit, const Vec3& right, const Vec3& up, const Vec3& towardsCamera,
                          double sampleSize) {
  const double facing = std::max(hit.normal.dot(towardsCamera), 0.02);
  TexturePoint point;
  point.ball = hit.position;
  point.footprint.col(0) = sampleSize * (right - hit.normal.dot(right) / facing * towardsCamera);
  point.footprint.col(1) = sampleSize * (up - hit.normal.dot(up) / facing * towardsCamera);
  return point;
}

Vec3f shade(const Hit& hit, const TextureSample& sample, const Vec3& right, const Vec3& up,
            const Vec3& towardsCamera) {
  const Vec3 key = (-0.5 * right + 0.75 * up + 0.9 * towardsCamera).normalized();
  Vec3 normal = hit.normal;
  if (!hit.cut) {
    const Vec3 slope = sample.heightGradient - sample.heightGradient.dot(normal) * normal;
    normal = (normal - slope).normalized();
  }
  const double lambert = std::max(0.0, normal.dot(key));
  const double sky = 0.5 + 0.5 * normal.dot(up);
  const double light = hit.cut ? 0.75 + 0.25 * lambert : 0.85 * lambert + 0.25 * sky + 0.05;
  const double highlight =
      0.04 * 9 * std::pow(std::max(0.0, normal.dot((key + towardsCamera).normalized())), 60);
  return static_cast<float>(light) * sample.color +
         Vec3f::Constant(static_cast<float>(highlight * sample.gloss * (hit.cut ? 0.15 : 1)));
}

Vec3f pixelColor(const SolidTexture& texture, const BallView& view, int side, const Square& square, int x,
                 int y) {
  const Vec3 right = view.up.cross(view.towardsCamera).normalized();
  const Vec3 up = view.towardsCamera.cross(right);
  const double pixel = view.width / square.size;
  Vec3f sum = Vec3f::Zero();
  for (int s = 0; s < side * side; ++s) {
    const double px = x + (s % side + 0.5) / side - square.size / 2.0;
    const double py = square.size / 2.0 - y - (s / side + 0.5) / side;
    const Hit hit = firstHit(pixel * (px * right + py * up), view);
    if (!hit.any) {
      sum += Vec3f::Constant(kBackground);
      continue;
    }
    const TexturePoint point = texturePoint(hit, right, up, view.towardsCamera, pixel / side);
    TextureSample sample;
    texture.sample({&point, 1}, {&sample, 1});
    sum += shade(hit, sample, right, up, view.towardsCamera);
  }
  return sum / static_cast<float>(side * side);
}

}  // namespace

void drawBall(const SolidTexture& texture, const BallView& view, int side, const Square& square,
              Picture& picture) {
  tbb::parallel_for(0, square.size, [&](int y) {
    for (int x = 0; x < square.size; ++x) {
      const Vec3f color = pixelColor(texture, view, side, square, x, y);
      float* pixel = picture.pixel(square.x + x, square.y + y);
      std::copy_n(color.data(), 3, pixel);
      pixel[3] = 1;
    }
  });
}

}  // namespace polestar::bench
