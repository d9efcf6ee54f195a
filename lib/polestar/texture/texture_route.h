#pragma once
// The way from a solid to where its texture lives: by its own map into the ball, by a motion of the ball,
// and, for a texture that was made in a body of its own, back out through that body's map. color_target(x) =
// color_source(f_s^-1(Psi(f_t(x)))). [Xia 2010, sec. 5]

#include <memory>
#include <optional>

#include "polestar/map/ball_map.h"

namespace polestar {

class TextureRoute {
 public:
  /// `motion`: of the unit ball onto itself, such as a BallMotion or a ShellMap; null: none. Without a source
  /// the way ends in the ball.
  explicit TextureRoute(BallMap target, std::shared_ptr<const VolumeMap> motion = nullptr,
                        std::optional<BallMap> source = std::nullopt);

  /// Target (mesh units) -> ball after the motion, or source (its mesh units). What lies outside the target
  /// is taken for the point of its surface on the ray to the center. NaN where a map has no answer, which is
  /// rounding on surfaces.
  void map(std::span<const Vec3> target, std::span<Vec3> place) const;
  /// The rest of the way, from the target's ball coordinates.
  void onward(std::span<const Vec3> ball, std::span<Vec3> place) const;
  /// Its derivative; outside, that of the point of the surface. NaN where a map has no answer.
  void jacobian(std::span<const Vec3> target, std::span<Mat3> derivative) const;
  /// The way back.
  void inverse(std::span<const Vec3> place, std::span<Vec3> target) const;

  const BallMap& target() const { return target_; }
  const std::optional<BallMap>& source() const { return source_; }

 private:
  void backOut(std::span<Vec3> ball) const;

  BallMap target_;
  std::shared_ptr<const VolumeMap> motion_;
  std::optional<BallMap> source_;
};

}  // namespace polestar
