#pragma once
// Motions of the unit ball onto itself, by which one solid's coordinates are brought into line with another's
// before a texture goes over: a rotation, or one whose outer shells are moved by a Moebius transformation
// besides, as landmarks on the surface ask for.

#include "polestar/map/volume_map.h"

namespace polestar {

/// y = r R M_{s(r) a}(d) for the point r d of the ball: every sphere about the center stays where it is. R is
/// a rotation; M_a the Moebius transformation of the sphere that draws all directions towards a, |a| < 1:
/// M_a(d) = (2 (1 + a.d) a + (1 - |a|^2) d) / (1 + 2 a.d + |a|^2). s rises from 0 within the core to 1 on the
/// surface with two continuous derivatives, so the motion is a rotation in the core and one to one
/// everywhere.
class BallMotion final : public VolumeMap {
 public:
  /// The identity.
  BallMotion() = default;
  /// `rotation`: orthogonal with determinant 1. `pull`: |pull| < 1. Shells up to `coreRadius` are only
  /// turned.
  /// @throws Error{Errc::usage}
  explicit BallMotion(const Mat3& rotation, const Vec3& pull = Vec3::Zero(), double coreRadius = 0.25);

  const Mat3& rotation() const { return rotation_; }
  const Vec3& pull() const { return pull_; }
  double coreRadius() const { return core_; }

  void forward(std::span<const Vec3> from, std::span<Vec3> to) const override;
  void inverse(std::span<const Vec3> to, std::span<Vec3> from) const override;
  void jacobian(std::span<const Vec3> from, std::span<Mat3> derivative) const override;

  /// Of a direction on the surface; any length but zero, result of length 1.
  Vec3 ofDirection(const Vec3& direction) const;

 private:
  double share(double radius) const;       // s
  double shareSlope(double radius) const;  // s'

  Mat3 rotation_ = Mat3::Identity();
  Vec3 pull_ = Vec3::Zero();
  double core_ = 0.25;
};

}  // namespace polestar
