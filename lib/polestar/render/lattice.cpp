#include "polestar/render/lattice.h"

#include <algorithm>
#include <cmath>

#include "polestar/io/picture.h"

namespace polestar {
namespace {

constexpr int kFewestCubes = 6;
constexpr float kGloss = 0.3f;
constexpr double kMiddle = 0.7, kTint = 0.29;  // sRGB: at the center, and what an axis adds from there to 1
constexpr float kShade = 0.55f;                // of every other cube, scene-linear
constexpr double kSharpest = 1e-3;             // sides of a cube

/// Integral of the square wave that is 1 on [0, 1), -1 on [1, 2) and so on.
double triangleWave(double x) { return 1 - std::abs(x - 2 * std::floor(x / 2) - 1); }

/// The square wave averaged over a box of a width, > 0.
double squareWave(double x, double width) {
  return (triangleWave(x + width / 2) - triangleWave(x - width / 2)) / width;
}

class LatticeTexture final : public SolidTexture {
 public:
  explicit LatticeTexture(double side) : side_(side) {}

  void sample(std::span<const TexturePoint> points, std::span<TextureSample> samples) const override {
    for (std::size_t i = 0; i < points.size(); ++i) {
      double wave = 1;
      Vec3f tint;
      for (int axis = 0; axis < 3; ++axis) {
        const double width = std::max(points[i].spread(Vec3::Unit(axis)) / side_, kSharpest);
        wave *= squareWave(points[i].ball[axis] / side_ + 0.5, width);
        tint[axis] = linearFromSrgbValue(
            static_cast<float>(std::clamp(kMiddle + kTint * points[i].ball[axis], 0.0, 1.0)));
      }
      const auto share = static_cast<float>(0.5 + 0.5 * wave);
      samples[i] = {(share + (1 - share) * kShade) * tint, kGloss, Vec3::Zero()};
    }
  }

 private:
  double side_;
};

}  // namespace

Cell Lattice::cellAt(const Vec3& place) const {
  Cell cell;
  for (int k = 0; k < 3; ++k) cell[k] = static_cast<int>(std::lround(place[k] / polycube.cellSide()));
  return cell;
}

Lattice latticeOf(const Polycube& polycube) {
  Lattice lattice{.polycube = polycube};
  while (lattice.divisions * polycube.longestSide() < kFewestCubes) lattice.divisions += 2;
  return lattice;
}

std::shared_ptr<const SolidTexture> makeLatticeTexture(const Lattice& lattice) {
  return std::make_shared<LatticeTexture>(lattice.side());
}

}  // namespace polestar
