#pragma once
// Volume maps with a formula, to draw and check pictures by.

#include <functional>
#include <limits>

#include "polestar/map/volume_map.h"

namespace polestar::testing {

inline const Vec3 kNotANumber = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

/// Map given by two functions of one point; the derivative by central differences.
class FormulaMap : public VolumeMap {
 public:
  using Function = std::function<Vec3(const Vec3&)>;
  FormulaMap(Function forward, Function inverse)
      : forward_(std::move(forward)), inverse_(std::move(inverse)) {}

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override {
    apply(forward_, solid, domain);
  }
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override {
    apply(inverse_, domain, solid);
  }
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override {
    constexpr double h = 1e-6;
    for (std::size_t i = 0; i < solid.size(); ++i) {
      for (int k = 0; k < 3; ++k) {
        derivative[i].col(k) =
            (forward_(solid[i] + h * Vec3::Unit(k)) - forward_(solid[i] - h * Vec3::Unit(k))) / (2 * h);
      }
    }
  }

 private:
  static void apply(const Function& f, std::span<const Vec3> in, std::span<Vec3> out) {
    for (std::size_t i = 0; i < in.size(); ++i) out[i] = f(in[i]);
  }
  Function forward_, inverse_;
};

/// x = center + r(w) b for a ball point b of direction w: every ray from the center is scaled on its own.
inline FormulaMap radialMap(const std::function<double(const Vec3&)>& radius,
                            const Vec3& center = Vec3::Zero()) {
  return FormulaMap(
      [=](const Vec3& x) -> Vec3 {
        const Vec3 d = x - center;
        if (d.norm() == 0) return Vec3::Zero();
        const Vec3 b = d / radius(d.normalized());
        return b.norm() <= 1 ? b : kNotANumber;
      },
      [=](const Vec3& b) -> Vec3 {
        if (b.norm() > 1) return kNotANumber;
        return b.norm() == 0 ? center : Vec3(center + radius(b.normalized()) * b);
      });
}

/// The ball of the given radius and center, scaled to the unit ball.
inline FormulaMap ballMap(double radius = 1, const Vec3& center = Vec3::Zero()) {
  return radialMap([=](const Vec3&) { return radius; }, center);
}

}  // namespace polestar::testing
