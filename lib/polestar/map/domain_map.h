#pragma once
// A solid's coordinates in a domain that resembles it more than a ball does: f = f_P^-1 . psi . f_M, both the
// solid M and the domain P mapped onto the ball, psi bringing the two balls into line. [Xia 2010, sec. 4.2,
// algorithm 2, whose composition is written the other way round]
//
// Where the domain has edges f is a homeomorphism and no diffeomorphism: towards a convex edge of P its
// Green's function vanishes faster than at a face, towards a reentrant one more slowly.

#include <memory>
#include <string>

#include "polestar/map/ball_map.h"
#include "polestar/map/surface_points.h"

namespace polestar {

/// What a domain is, besides a solid with a map.
struct DomainShape {
  std::string kind;   ///< "cube" or "polycube"
  std::string cells;  ///< of the polycube, as its text has them (polycube/polycube_text.h), lines ended by ;
  double cellSide = 2;           ///< domain units
  Mat3 axes = Mat3::Identity();  ///< columns: the domain's axes in the solid's world, before psi
  double unit = 1;     ///< mesh units that a domain unit stands for where the domain lies over the solid
  double overlap = 1;  ///< volume of their intersection over that of their union, lying so
};

/// Cheap to copy. Frames: points of the solid in mesh units, of the domain in domain units (origin at its
/// center, axes of its lattice, its box two long).
class DomainMap final : public VolumeMap {
 public:
  /// `motion`: of the solid's ball onto the domain's; a BallMotion or a ShellMap, of which it is known that
  /// they keep spheres about the center and are one to one, and which files can hold.
  /// @throws Error{Errc::usage} for another kind.
  DomainMap(BallMap solid, std::shared_ptr<const VolumeMap> motion, BallMap domain, DomainShape shape);

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  /// Points that rounding to floats put outside of the domain are taken for points of its boundary.
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  /// By the chain rule; NaN outside and where a derivative of the domain's map is singular.
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

  /// forward(), continued outside the solid by f(q) |x - c| / |q - c|, q where the ray from the center
  /// through x leaves the solid; and G of the solid (1 / mesh units; 0 outside, +infinity at the center).
  void sample(std::span<const Vec3> solid, std::span<Vec3> domain, std::span<double> green) const;
  /// The second half of sample(), f_P^-1 . psi: from the solid's ball, outside of it along rays.
  void sampleFromBall(std::span<const Vec3> ball, std::span<Vec3> domain) const;
  /// inverse(), continued outside the domain in the same way.
  void sampleInverse(std::span<const Vec3> domain, std::span<Vec3> solid) const;

  const BallMap& solid() const { return solid_; }
  const VolumeMap& motion() const { return *motion_; }
  const BallMap& domain() const { return domain_; }
  const DomainShape& shape() const { return shape_; }

 private:
  BallMap solid_;
  std::shared_ptr<const VolumeMap> motion_;
  BallMap domain_;
  DomainShape shape_;
  SurfacePoints solidSurface_, domainSurface_;
};

}  // namespace polestar
