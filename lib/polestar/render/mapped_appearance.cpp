#include "polestar/render/mapped_appearance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "polestar/core/error.h"
#include "polestar/io/picture.h"
#include "polestar/render/detail/linear_coordinates.h"
#include "polestar/texture/procedural.h"

namespace polestar {
namespace {

using detail::LinearCoordinates;

constexpr double kSteepestRelief = 0.8;  // slopes beyond look like noise

class Clay final : public SolidTexture {
 public:
  void sample(std::span<const TexturePoint>, std::span<TextureSample> samples) const override {
    for (TextureSample& sample : samples) sample = {linearFromSrgb(0xd9b8a6), 0.25f, Vec3::Zero()};
  }
};

class MappedAppearance final : public Appearance {
 public:
  MappedAppearance(const VolumeMap& map, const BallMap* green, MappedLook look,
                   std::optional<DomainCoordinates> domain)
      : map_(map), green_(green), look_(std::move(look)), domain_(std::move(domain)) {
    if ((look_.textureInDomain || look_.lines.lattice) && !domain_)
      throw Error(Errc::usage, "a look by the domain's coordinates needs a domain");
    const Vec3 pole = Vec3::Zero();
    map_.inverse({&pole, 1}, {&center_, 1});
  }

  void look(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps, double share,
            std::span<SurfaceLook> looks) const override {
    std::vector<LinearCoordinates> balls, places;
    if (!look_.textureInDomain || look_.lines.ofBall())
      balls = detail::linearBalls(patches, center_, [this](auto from, auto to) { map_.forward(from, to); });
    if (look_.textureInDomain || look_.lines.lattice) places = detail::linearDomain(patches, domain_->at);
    drawTexture(patches, taps, look_.textureInDomain ? places : balls, share, looks);
    if (look_.lines.ofBall()) detail::drawIsoLines(look_.lines, patches, taps, balls, share, looks);
    if (look_.lines.lattice)
      detail::drawLatticeLines(look_.lines, domain_->lattice, patches, taps, places, share, looks);
  }

  void coordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, std::span<Vec3> ball,
                   std::span<double> green) const override {
    detail::ballCoordinates(
        points, skin, center_, [this](auto from, auto to) { map_.forward(from, to); }, ball);
    std::fill(green.begin(), green.end(), std::numeric_limits<double>::quiet_NaN());
    if (!green_) return;
    std::vector<Vec3> unused(points.size());
    green_->sample(points, unused, green);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (skin[i]) green[i] = 0;
    }
  }

  Vec3 center() const override { return center_; }

 private:
  void drawTexture(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps,
                   std::span<const LinearCoordinates> coordinates, double share,
                   std::span<SurfaceLook> looks) const {
    std::vector<TexturePoint> points;
    std::vector<std::size_t> tapOf;
    for (std::size_t i = 0; i < taps.size(); ++i) {
      looks[i] = {};
      const SurfacePatch& patch = patches[taps[i].patch];
      const LinearCoordinates& at = coordinates[taps[i].patch];
      if (!at.known()) continue;
      TexturePoint point;
      point.ball = texturePlace(at, taps[i], patch.skin);
      point.footprint.col(0) = share * patch.pixelFirst * at.alongFirst;
      point.footprint.col(1) = share * patch.pixelSecond * at.alongSecond;
      points.push_back(point);
      tapOf.push_back(i);
    }
    std::vector<TextureSample> samples(points.size());
    look_.texture->sample(points, samples);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const SurfaceTap& tap = taps[tapOf[i]];
      looks[tapOf[i]] = lookOf(samples[i], patches[tap.patch].skin, coordinates[tap.patch]);
    }
  }

  Vec3 texturePlace(const LinearCoordinates& at, const SurfaceTap& tap, bool skin) const {
    if (!look_.textureInDomain) return at.inBall(tap, skin);
    return skin ? Lattice::insideSurface(at.at(tap)) : at.at(tap);
  }

  SurfaceLook lookOf(const TextureSample& sample, bool skin, const LinearCoordinates& at) const {
    SurfaceLook look;
    look.color = sample.color;
    look.gloss = (skin ? 1.0f : look_.cutGloss) * sample.gloss;
    look.known = true;
    // Heights are in ball radii; the map's scale along the skin makes lengths of them.
    const double scale = std::sqrt(at.alongFirst.cross(at.alongSecond).norm());
    if (!skin || !(scale > 0)) return look;
    const auto slope = [&](const Vec3& along) {
      return static_cast<float>(
          std::clamp(sample.heightGradient.dot(along) / scale, -kSteepestRelief, kSteepestRelief));
    };
    look.slopeFirst = slope(at.alongFirst);
    look.slopeSecond = slope(at.alongSecond);
    return look;
  }

  const VolumeMap& map_;
  const BallMap* green_;
  MappedLook look_;
  std::optional<DomainCoordinates> domain_;
  Vec3 center_ = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
};

}  // namespace

MappedLook coordinateLook(double linePixels) {
  MappedLook look;
  // Lines of the texture would be as wide as the map makes them; iso-lines are of one width. Cuts are to show
  // the bands, not the skin.
  look.texture = makeTexture("soccer", {{"line", 0}, {"skin", 0.0002}});
  look.lines.radius = look.lines.cutSeams = true;
  look.lines.pixels = linePixels;
  return look;
}

MappedLook plainLook() {
  MappedLook look;
  look.texture = std::make_shared<Clay>();
  return look;
}

MappedLook latticeLook(const Lattice& lattice, double linePixels) {
  MappedLook look;
  look.texture = makeLatticeTexture(lattice);
  look.textureInDomain = true;
  look.lines.lattice = true;
  look.lines.pixels = linePixels;
  return look;
}

std::unique_ptr<Appearance> makeMappedAppearance(const VolumeMap& map, const BallMap* green, MappedLook look,
                                                 std::optional<DomainCoordinates> domain) {
  return std::make_unique<MappedAppearance>(map, green, std::move(look), std::move(domain));
}

}  // namespace polestar
