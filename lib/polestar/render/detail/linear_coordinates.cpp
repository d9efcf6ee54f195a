#include "polestar/render/detail/linear_coordinates.h"

#include <algorithm>
#include <cmath>

namespace polestar::detail {
namespace {

constexpr double kSecondTry = 4e-6;  // of the way to the center: what rays in single precision may miss
constexpr double kLongestStep = 2;   // of finite differences, in widths of the pixel

Vec3 inward(const Vec3& point, const Vec3& center) {
  return center.allFinite() ? Vec3(point + kSecondTry * (center - point)) : point;
}

/// Along the second tangent, which grazing pixels are long in.
double longStep(const SurfacePatch& patch) {
  return std::min(patch.pixelSecond, kLongestStep * patch.pixelFirst);
}

/// Points to be looked up, each with another that is taken where the first has no coordinates.
class TwoTries {
 public:
  void add(const Vec3& point, const Vec3& fallback) {
    points_.push_back(point);
    fallbacks_.push_back(fallback);
  }
  void run(const CoordinateLookup& lookup) {
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

Vec3 LinearCoordinates::inBall(const SurfaceTap& tap, bool skin) const {
  const Vec3 b = at(tap);
  const double radius = b.norm();
  return radius > 0 && (skin || radius > 1) ? Vec3(b / radius) : b;
}

std::vector<LinearCoordinates> linearBalls(std::span<const SurfacePatch> patches, const Vec3& center,
                                           const CoordinateLookup& lookup) {
  TwoTries tries;
  for (const SurfacePatch& patch : patches) {
    const Vec3 point = patch.skin ? Vec3(patch.point - 0.5 * patch.pixelFirst * patch.normal) : patch.point;
    const Vec3 first = patch.pixelFirst * patch.first, second = longStep(patch) * patch.second;
    tries.add(point, inward(patch.point, center));
    tries.add(point + first, point - first);
    tries.add(point + second, point - second);
  }
  tries.run(lookup);
  std::vector<LinearCoordinates> balls(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    balls[i].value = tries.ball(3 * i);
    balls[i].alongFirst = tries.slope(3 * i, 3 * i + 1, patches[i].pixelFirst, patches[i].first);
    balls[i].alongSecond = tries.slope(3 * i, 3 * i + 2, longStep(patches[i]), patches[i].second);
    if (!patches[i].skin || !balls[i].known()) continue;
    // R = 1 all over the skin.
    const Vec3 radial = balls[i].value.stableNormalized();
    balls[i].alongFirst -= radial.dot(balls[i].alongFirst) * radial;
    balls[i].alongSecond -= radial.dot(balls[i].alongSecond) * radial;
  }
  return balls;
}

std::vector<LinearCoordinates> linearDomain(std::span<const SurfacePatch> patches,
                                            const DomainLookup& lookup) {
  std::vector<Vec3> points, places(3 * patches.size());
  std::vector<std::uint8_t> skin;
  for (const SurfacePatch& patch : patches) {
    points.push_back(patch.point);
    points.push_back(patch.point + patch.pixelFirst * patch.first);
    points.push_back(patch.point + longStep(patch) * patch.second);
    skin.insert(skin.end(), 3, patch.skin);
  }
  lookup(points, skin, places);
  std::vector<LinearCoordinates> domain(patches.size());
  for (std::size_t i = 0; i < patches.size(); ++i) {
    domain[i].value = places[3 * i];
    domain[i].alongFirst = (places[3 * i + 1] - places[3 * i]) / patches[i].pixelFirst;
    domain[i].alongSecond = (places[3 * i + 2] - places[3 * i]) / longStep(patches[i]);
  }
  return domain;
}

void ballCoordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, const Vec3& center,
                     const CoordinateLookup& lookup, std::span<Vec3> ball) {
  TwoTries tries;
  for (const Vec3& point : points) tries.add(point, inward(point, center));
  tries.run(lookup);
  for (std::size_t i = 0; i < points.size(); ++i) {
    ball[i] = tries.ball(i);
    if (skin[i]) ball[i].stableNormalize();
  }
}

namespace {

/// Draws the share that `coverage` says of the place of each tap that has a look and coordinates.
template <class Coverage>
void drawLines(const Vec3f& color, std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps,
               std::span<const LinearCoordinates> coordinates, std::span<SurfaceLook> looks,
               Coverage&& coverage) {
  for (std::size_t i = 0; i < taps.size(); ++i) {
    const SurfacePatch& patch = patches[taps[i].patch];
    const LinearCoordinates& at = coordinates[taps[i].patch];
    if (!looks[i].known || !at.known()) continue;
    CoordinateFootprint footprint;
    footprint.overFirst = patch.pixelFirst * at.alongFirst;
    footprint.overSecond = patch.pixelSecond * at.alongSecond;
    footprint.skin = patch.skin;
    const auto covered = static_cast<float>(coverage(at, taps[i], footprint));
    looks[i].color += covered * (color - looks[i].color);
  }
}

}  // namespace

void drawIsoLines(const IsoLines& lines, std::span<const SurfacePatch> patches,
                  std::span<const SurfaceTap> taps, std::span<const LinearCoordinates> balls, double share,
                  std::span<SurfaceLook> looks) {
  drawLines(lines.color, patches, taps, balls, looks,
            [&](const LinearCoordinates& at, const SurfaceTap& tap, CoordinateFootprint& footprint) {
              footprint.place = at.inBall(tap, footprint.skin);
              return isoLineCoverage(lines, footprint, share);
            });
}

void drawLatticeLines(const IsoLines& lines, const Lattice& lattice, std::span<const SurfacePatch> patches,
                      std::span<const SurfaceTap> taps, std::span<const LinearCoordinates> domain,
                      double share, std::span<SurfaceLook> looks) {
  drawLines(lines.color, patches, taps, domain, looks,
            [&](const LinearCoordinates& at, const SurfaceTap& tap, CoordinateFootprint& footprint) {
              footprint.place = at.at(tap);
              return latticeLineCoverage(lines, lattice, footprint, share);
            });
}

}  // namespace polestar::detail
