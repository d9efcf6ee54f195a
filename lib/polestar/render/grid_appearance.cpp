#include "polestar/render/grid_appearance.h"

#include <algorithm>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "polestar/core/error.h"
#include "polestar/render/detail/linear_coordinates.h"

namespace polestar {
namespace {

constexpr float kPadded = 0.9f;  // share of a filter above the skin that has colors, if those are padded
const double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// "[0.1, 0.2, 0.3]"; NaN for anything else.
Vec3 parseCenter(std::string text) {
  for (char& c : text) {
    if (c == '[' || c == ']' || c == ',') c = ' ';
  }
  std::istringstream in(text);
  Vec3 center;
  return in >> center[0] >> center[1] >> center[2] ? center : Vec3(Vec3::Constant(kUnknown));
}

std::optional<SampledGrid> copyOf(const SampledGrid* grid) {
  return grid ? std::optional<SampledGrid>(*grid) : std::nullopt;
}

class GridAppearance final : public Appearance {
 public:
  GridAppearance(const SampledGrids& grids, const GridLook& look)
      : look_(look),
        colors_(*findColors(grids)),
        rest_(copyOf(grids.find("rest", true))),
        green_(copyOf(grids.find("green", false))),
        center_(parseCenter(grids.metadata("polestar:center"))) {
    // The pyramid of resolutions is made at the first wide look, in parallel; pixels must not wait for that
    // in the middle of parallel work of their own.
    const Box box = colors_.activeBox();
    const Vec3 middle = 0.5 * (box.min + box.max);
    const Mat3 wide = 8 * colors_.voxelSize() * Mat3::Identity();
    Vec3f color;
    float weight = 0;
    colors_.sample({&middle, 1}, {&wide, 1}, {&color, 1}, {&weight, 1});
  }

  void look(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps, double share,
            std::span<SurfaceLook> looks) const override {
    // A skin is often thinner than a voxel: there, what is averaged with the flesh below would show the
    // voxels as stripes. Colors are padded, so the voxels outside have the skin alone.
    readColors(patches, taps, share, colors_.voxelSize(), looks);
    std::vector<SurfaceTap> bare;
    std::vector<std::size_t> tapOf;
    for (std::size_t i = 0; i < taps.size(); ++i) {
      if (looks[i].known || !patches[taps[i].patch].skin) continue;
      bare.push_back(taps[i]);
      tapOf.push_back(i);
    }
    std::vector<SurfaceLook> again(bare.size());
    readColors(patches, bare, share, 0, again);
    for (std::size_t i = 0; i < bare.size(); ++i) looks[tapOf[i]] = again[i];
    if (!rest_ || !look_.lines.ofBall()) return;
    const auto balls = detail::linearBalls(patches, center_, lookup());
    detail::drawIsoLines(look_.lines, patches, taps, balls, share, looks);
  }

  void coordinates(std::span<const Vec3> points, std::span<const std::uint8_t> skin, std::span<Vec3> ball,
                   std::span<double> green) const override {
    std::fill(ball.begin(), ball.end(), Vec3::Constant(kUnknown));
    if (rest_) detail::ballCoordinates(points, skin, center_, lookup(), ball);
    std::fill(green.begin(), green.end(), kUnknown);
    if (!green_) return;
    std::vector<Vec3f> values(points.size());
    std::vector<float> weights(points.size());
    green_->sample(points, {}, values, weights);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (skin[i])
        green[i] = 0;
      else if (weights[i] > 0)
        green[i] = static_cast<double>(values[i][0]);
    }
  }

  Vec3 center() const override { return center_; }

 private:
  /// `outside`: how far above the skin that is read, mesh units; 0: half a pixel below.
  void readColors(std::span<const SurfacePatch> patches, std::span<const SurfaceTap> taps, double share,
                  double outside, std::span<SurfaceLook> looks) const {
    std::vector<Vec3> points;
    std::vector<Mat3> footprints;
    for (const SurfaceTap& tap : taps) {
      const SurfacePatch& patch = patches[tap.patch];
      const double above = !patch.skin ? 0 : outside > 0 ? outside : -0.5 * patch.pixelFirst;
      points.emplace_back(patch.point + tap.first * patch.first + tap.second * patch.second +
                          above * patch.normal);
      Mat3& footprint = footprints.emplace_back(Mat3::Zero());
      footprint.col(0) = share * patch.pixelFirst * patch.first;
      footprint.col(1) = share * patch.pixelSecond * patch.second;
    }
    std::vector<Vec3f> colors(taps.size());
    std::vector<float> weights(taps.size());
    colors_.sample(points, footprints, colors, weights);
    for (std::size_t i = 0; i < taps.size(); ++i) {
      const bool skin = patches[taps[i].patch].skin;
      looks[i] = {};
      looks[i].known = weights[i] > (skin && outside > 0 ? kPadded : 0) && colors[i].allFinite();
      if (!looks[i].known) continue;
      looks[i].color = colors[i].cwiseMax(0.0f);
      looks[i].gloss = skin ? look_.skinGloss : look_.cutGloss;
    }
  }

  detail::CoordinateLookup lookup() const {
    return [this](std::span<const Vec3> points, std::span<Vec3> ball) {
      std::vector<Vec3f> values(points.size());
      std::vector<float> weights(points.size());
      rest_->sample(points, {}, values, weights);
      for (std::size_t i = 0; i < points.size(); ++i)
        ball[i] = weights[i] > 0 ? Vec3(values[i].cast<double>()) : Vec3(Vec3::Constant(kUnknown));
    };
  }

  GridLook look_;
  SampledGrid colors_;
  std::optional<SampledGrid> rest_, green_;
  Vec3 center_;
};

}  // namespace

const SampledGrid* findColors(const SampledGrids& grids) {
  const SampledGrid* colors = grids.find("Cd", true);
  return colors ? colors : grids.find("color", true);
}

std::unique_ptr<Appearance> makeGridAppearance(const SampledGrids& grids, const GridLook& look) {
  if (!findColors(grids)) throw Error(Errc::usage, "the file has no grid of colors named Cd or color");
  return std::make_unique<GridAppearance>(grids, look);
}

}  // namespace polestar
