#include "polestar/render/mapped_appearance.h"

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "polestar/texture/procedural.h"

namespace polestar {
namespace {

const Vec3 kUnknown = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
constexpr double kSecondTry = 1e-6;   // of the way to the center
constexpr double kLongestStep = 2;    // of finite differences, in widths of the pixel
constexpr double kBumpLimit = 0.8;    // slopes beyond look like noise

/// Ball coordinates at a patch, and how they change along its tangents.
struct LinearBall {
  Vec3 ball = kUnknown;
  Vec3 alongFirst = Vec3::Zero(), alongSecond = Vec3::Zero();  ///< per mesh unit

  Vec3 at(const SurfaceTap& tap, bool skin) const {
    const Vec3 b = ball + tap.first * alongFirst + tap.second * alongSecond;
    const double radius = b.norm();
    return radius > 0 && (skin || radius > 1) ? Vec3(b / radius) : b;
  }
};

/// Points to be mapped, each with another that is taken where the first has no image.
class Lookup {
 public:
  std::size_t add(const Vec3& point, const Vec3& fallback) {
    points_.push_back(point);
    fallbacks_.push_back(fallback);
    return points_.size() - 1;
  }
  void run(const VolumeMap& map) {
    ball_.resize(points_.size());
    map.forward(points_, ball_);
    std::vector<Vec3> again, result;
    for (std::size_t i = 0; i < ball_.size(); ++i) {
      fellBack_.push_back(!ball_[i].allFinite());
      if (fellBack_[i]) again.push_back(fallbacks_[i]);
    }
    result.resize(again.size());
    if (!again.empty()) map.forward(again, result);
    std::size_t next = 0;
    for (std::size_t i = 0; i < ball_.size(); ++i) {
      if (fellBack_[i]) ball_[i] = result[next++];
    }
  }
  const Vec3& ball(std::size_t i) const { return ball_[i]; }
  bool fellBack(std::size_t i) const { return fellBack_[i]; }

 private:
  std::vector<Vec3> points_, fallbacks_, ball_;
  std::vector<std::uint8_t> fellBack_;
};

class MappedAppearance final : public Appearance {
 public:
  MappedAppearance(const VolumeMap& map, const BallMap* green, MappedLook look)
      : map_(map), green_(green), look_(std::move(look)), center_(kUnknown) {
    const Vec3 pole = Vec3::Zero();
    map_.inverse({&pole, 1}, {&center_, 1});
  }

  void look(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps, double share,
            std::span<SurfaceLook> looks) const override {
    const std::vector<LinearBall> balls = mapPatches(patches);
    sampleTexture(patches, taps, balls, share, looks);
    if (look_.lines.any()) drawLines(patches, taps, balls, share, looks);
  }

  void coordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, std::span<Vec3> ball,
                   std::span<double> green) const override {
    Lookup lookup;
    for (const Vec3& point : points) lookup.add(point, inward(point));
    lookup.run(map_);
    std::fill(green.begin(), green.end(), std::numeric_limits<double>::quiet_NaN());
    if (green_) {
      std::vector<Vec3> unused(points.size());
      green_->sample(points, unused, green);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
      ball[i] = lookup.ball(i);
      if (!skin[i]) continue;
      ball[i].stableNormalize();
      if (green_) green[i] = 0;
    }
  }

  Vec3 center() const override { return center_; }

 private:
  Vec3 inward(const Vec3& point) const {
    return center_.allFinite() ? Vec3(point + kSecondTry * (center_ - point)) : point;
  }

  std::vector<LinearBall> mapPatches(std::span<const SurfacePatch> patches) const {
    Lookup lookup;
    for (const SurfacePatch& patch : patches) {
      const Vec3 point = patch.skin ? Vec3(patch.point - 0.5 * patch.pixelFirst * patch.normal) : patch.point;
      const double step = std::min(patch.pixelSecond, kLongestStep * patch.pixelFirst);
      lookup.add(point, inward(patch.point));
      lookup.add(point + patch.pixelFirst * patch.first, point - patch.pixelFirst * patch.first);
      lookup.add(point + step * patch.second, point - step * patch.second);
    }
    lookup.run(map_);
    std::vector<LinearBall> balls(patches.size());
    for (std::size_t i = 0; i < patches.size(); ++i) {
      const SurfacePatch& patch = patches[i];
      const Vec3& ball = lookup.ball(3 * i);
      const auto slope = [&](std::size_t neighbour, double step, const Vec3& tangent) -> Vec3 {
        const Vec3 change = (lookup.ball(neighbour) - ball) / (lookup.fellBack(neighbour) ? -step : step);
        // Where both neighbours lie outside, the unit ball's own derivatives give lines of common width.
        return change.allFinite() ? change : tangent;
      };
      balls[i].ball = ball;
      balls[i].alongFirst = slope(3 * i + 1, patch.pixelFirst, patch.first);
      balls[i].alongSecond =
          slope(3 * i + 2, std::min(patch.pixelSecond, kLongestStep * patch.pixelFirst), patch.second);
    }
    return balls;
  }

  void sampleTexture(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps,
                     std::span<const LinearBall> balls, double share, std::span<SurfaceLook> looks) const {
    std::vector<TexturePoint> points;
    std::vector<std::size_t> of;
    for (std::size_t i = 0; i < taps.size(); ++i) {
      const SurfacePatch& patch = patches[taps[i].patch];
      const LinearBall& ball = balls[taps[i].patch];
      looks[i] = {};
      if (!ball.ball.allFinite()) continue;
      TexturePoint at;
      at.ball = ball.at(taps[i], patch.skin);
      at.footprint.col(0) = share * patch.pixelFirst * ball.alongFirst;
      at.footprint.col(1) = share * patch.pixelSecond * ball.alongSecond;
      points.push_back(at);
      of.push_back(i);
    }
    std::vector<TextureSample> samples(points.size());
    look_.texture->sample(points, samples);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const SurfacePatch& patch = patches[taps[of[i]].patch];
      const LinearBall& ball = balls[taps[of[i]].patch];
      SurfaceLook& look = looks[of[i]];
      look.color = samples[i].color;
      look.gloss = (patch.skin ? 1.0f : look_.cutGloss) * samples[i].gloss;
      look.known = true;
      if (!patch.skin) continue;
      // Heights are in ball radii; the map's scale along the skin makes lengths of them.
      const double scale = std::sqrt(ball.alongFirst.cross(ball.alongSecond).norm());
      if (!(scale > 0)) continue;
      const auto bump = [&](const Vec3& along) {
        return static_cast<float>(
            std::clamp(samples[i].heightGradient.dot(along) / scale, -kBumpLimit, kBumpLimit));
      };
      look.slopeFirst = bump(ball.alongFirst);
      look.slopeSecond = bump(ball.alongSecond);
    }
  }

  void drawLines(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps,
                 std::span<const LinearBall> balls, double share, std::span<SurfaceLook> looks) const {
    for (std::size_t i = 0; i < taps.size(); ++i) {
      if (!looks[i].known) continue;
      const SurfacePatch& patch = patches[taps[i].patch];
      const LinearBall& ball = balls[taps[i].patch];
      const BallFootprint at{ball.at(taps[i], patch.skin), patch.pixelFirst * ball.alongFirst,
                             patch.pixelSecond * ball.alongSecond, patch.skin};
      const auto covered = static_cast<float>(isoLineCoverage(look_.lines, at, share));
      looks[i].color += covered * (look_.lines.color - looks[i].color);
    }
  }

  const VolumeMap& map_;
  const BallMap* green_;
  MappedLook look_;
  Vec3 center_;
};

}  // namespace

MappedLook coordinateLook(double linePixels) {
  MappedLook look;
  // Lines of the texture would be as wide as the map makes them; iso-lines are of one width. Cuts are to show
  // the bands, not the skin.
  look.texture = makeTexture("soccer", {{"line", 0}, {"skin", 0.002}});
  look.lines.radius = look.lines.cutSeams = true;
  look.lines.pixels = linePixels;
  return look;
}

std::unique_ptr<Appearance> makeMappedAppearance(const VolumeMap& map, const BallMap* green,
                                                 MappedLook look) {
  return std::make_unique<MappedAppearance>(map, green, std::move(look));
}

}  // namespace polestar
