#pragma once
// Maps of the unit ball onto itself that keep every sphere about the center: x = r u goes to r A_s(u), A_s a
// map of the sphere, s a function of r. What brings the coordinates of one solid into line with those of
// another where rotations and Moebius transformations are not enough: landmarks met exactly, or a surface map
// that another program found.
//
// A = A_1 is given as a table: the same triangles on two spheres, linear (then normalized) in between, which
// is the central projection of the linear map of each triangle's cone. It holds for all r >= R_c, so that
// outside of the core field lines go to field lines and iso-surfaces to iso-surfaces, as docs/method.md wants
// of every map between balls; BallMotion's Moebius part, which has no such table to answer for, fades out
// over the whole ball. Within the core A_s turns into a rotation Q, as A_R of BallMap does: s falls from 1 to
// 0 between R_c and R_c / 4, evenly in ln r, and the vertices go to (1 - s) Q u_i + s y_i.

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "polestar/map/volume_map.h"

namespace polestar {

/// A map of the sphere: triangles, and for each of their vertices where it is and where it goes.
struct ShellTable {
  std::vector<Vec3> from, to;  ///< any length but zero; as many of the one as of the other
  std::vector<Triangle> triangles;
};

/// A triangle of a table that is not positively oriented, or may not be, at some stage of the core.
struct FoldedTriangle {
  std::int32_t triangle;
  double share;  ///< s, in [0, 1]: 1 for the table itself
};

/// The rotation that the core of a table's map does: closest to the table by the areas in `from`.
Mat3 coreRotation(const ShellTable& table);

/// Triangles whose images are not shown to be positively oriented for all s in [0, 1] when the core does
/// `rotation`; ascending. With the vertices at a_i(s) = (1 - s) Q u_i + s y_i the determinant of a triangle
/// is a cubic polynomial of s, a product of three linear ones in the corner and two edges. Its Bernstein
/// coefficients enclose it; where they are not all positive by more than rounding can change, the interval is
/// halved. The ends, s = 0 and s = 1, are decided by exact predicates.
/// O(n), parallel, 0.04 us a triangle on two cores.
std::vector<FoldedTriangle> foldedTriangles(const ShellTable& table, const Mat3& rotation);

/// The map. One to one by proof: the constructor accepts only what it can show.
///
/// `from` is a closed surface of genus 0, all of its triangles positive, that covers the sphere once: it
/// tiles the sphere. All triangles are positive at all s, so no a_i(s)-combination is 0, and A_s is
/// continuous in s and u: its degree is that of A_0 = Q, which is 1. A map of degree 1 that turns over no
/// triangle meets almost every point once, so it is one to one on the tiles' insides and then, being
/// continuous and onto, a homeomorphism of the sphere. Spheres of all radii together make one of the ball:
/// continuous, one to one, and the ball is compact.
///
/// Cheap to copy. Frames: the unit ball on both ends; outside is NaN.
class ShellMap final : public VolumeMap {
 public:
  /// `coreRadius`: R_c, in (0, 1).
  /// @throws Error{Errc::usage} for a table that is none (sizes, indices, directions that are zero or no
  /// number, a radius outside (0, 1)); Error{Errc::notConverged} when it cannot be shown to be one to one,
  /// with the number of folded triangles, the first of them and where they are.
  explicit ShellMap(ShellTable table, double coreRadius = 0.25);

  const ShellTable& table() const;  ///< unit vectors
  const Mat3& rotation() const;     ///< Q: all that the map does for r <= coreRadius() / 4
  double coreRadius() const;
  /// Largest sigma_1 / sigma_2 >= 1 of the flat triangles' maps: how much the surface is sheared at worst.
  double largestDilatation() const;

  void forward(std::span<const Vec3> from, std::span<Vec3> to) const override;
  /// Between R_c / 4 and R_c by a walk over the triangles where they are at that radius.
  void inverse(std::span<const Vec3> to, std::span<Vec3> from) const override;
  void jacobian(std::span<const Vec3> from, std::span<Mat3> derivative) const override;

  /// Of a direction on the surface; any length but zero, result of length 1.
  Vec3 ofDirection(const Vec3& direction) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace polestar
