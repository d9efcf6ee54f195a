#include "polestar/texture/texture_route.h"

#include <Eigen/LU>
#include <algorithm>
#include <utility>
#include <vector>

#include "polestar/map/ball_motion.h"

namespace polestar {
namespace {

/// Points of the surface are asked for this far inside, where every map has an answer but for rounding; where
/// it has none, farther in.
constexpr double kJustInside = 1 - 1e-9, kFartherInside = 1 - 1e-4;

/// Into the ball where the point lies outside, or was moved there by rounding.
Vec3 ontoBall(const Vec3& ball) {
  const double radius = ball.norm();
  return radius > kJustInside ? Vec3(ball * (kJustInside / radius)) : ball;
}

}  // namespace

TextureRoute::TextureRoute(BallMap target, std::shared_ptr<const VolumeMap> motion,
                           std::optional<BallMap> source)
    : target_(std::move(target)),
      motion_(motion ? std::move(motion) : std::make_shared<const BallMotion>()),
      source_(std::move(source)) {}

void TextureRoute::map(std::span<const Vec3> target, std::span<Vec3> place) const {
  std::vector<double> green(target.size());
  target_.sample(target, place, green);
  onward(place, place);
}

void TextureRoute::onward(std::span<const Vec3> ball, std::span<Vec3> place) const {
  std::transform(ball.begin(), ball.end(), place.begin(), ontoBall);
  motion_->forward(place, place);
  if (source_) backOut(place);
}

void TextureRoute::backOut(std::span<Vec3> ball) const {
  std::vector<Vec3> solid(ball.size());
  source_->inverse(ball, solid);
  std::vector<std::size_t> open;
  std::vector<Vec3> again;
  for (std::size_t i = 0; i < ball.size(); ++i) {
    if (solid[i].allFinite() || !ball[i].allFinite()) continue;
    open.push_back(i);
    again.push_back(kFartherInside * ball[i]);
  }
  if (!open.empty()) {
    std::vector<Vec3> answers(open.size());
    source_->inverse(again, answers);
    for (std::size_t k = 0; k < open.size(); ++k) solid[open[k]] = answers[k];
  }
  std::copy(solid.begin(), solid.end(), ball.begin());
}

void TextureRoute::jacobian(std::span<const Vec3> target, std::span<Mat3> derivative) const {
  std::vector<Vec3> ball(target.size()), solid(target.begin(), target.end());
  std::vector<Mat3> next(target.size());
  std::vector<double> green(target.size());
  target_.sample(target, ball, green);
  for (std::size_t i = 0; i < target.size(); ++i) {
    if (ball[i].norm() <= kFartherInside) continue;
    ball[i] *= kFartherInside / ball[i].norm();
    target_.inverse({&ball[i], 1}, {&solid[i], 1});
  }
  target_.jacobian(solid, derivative);
  motion_->jacobian(ball, next);
  for (std::size_t i = 0; i < target.size(); ++i) derivative[i] = next[i] * derivative[i];
  if (!source_) return;
  motion_->forward(ball, ball);
  backOut(ball);
  source_->jacobian(ball, next);
  for (std::size_t i = 0; i < target.size(); ++i) derivative[i] = next[i].inverse() * derivative[i];
}

void TextureRoute::inverse(std::span<const Vec3> place, std::span<Vec3> target) const {
  std::vector<Vec3> ball(place.begin(), place.end());
  if (source_) source_->forward(place, ball);
  motion_->inverse(ball, ball);
  target_.inverse(ball, target);
}

}  // namespace polestar
