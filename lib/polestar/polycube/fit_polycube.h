#pragma once
// A polycube that resembles a star-shaped solid. [Xia 2010, sec. 4.2 takes it as given; how it is chosen
// here: docs/method.md]

#include <optional>

#include "polestar/core/context.h"
#include "polestar/polycube/polycube.h"
#include "polestar/star/star_shape.h"

namespace polestar {

struct PolycubeOptions {
  /// Cells along the polycube's longest side, at most; 1 to 64. 1 is the cube.
  int cells = 8;
  /// The lattice's axes as columns, a proper rotation; nothing: they are chosen.
  std::optional<Mat3> rotation = std::nullopt;
  /// About as many rotations are tried besides the mesh's own axes and the principal ones; 0: none.
  int rotations = 64;
  /// fitPolycube() only, in (0, 1): of polycubes that overlap the solid by this much at least, one with few
  /// corners.
  std::optional<double> overlap = std::nullopt;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// A polycube in its place. A point x of the solid's neighbourhood, in mesh units, lies at axes^T (x -
/// center) / unit of the domain frame.
struct PolycubeFit {
  Polycube polycube;
  Vec3 center;         ///< mesh units: that of the shape
  Mat3 axes;           ///< columns: the lattice's axes in the mesh's frame; a proper rotation
  double unit = 1;     ///< mesh units in one unit of the domain frame
  double overlap = 0;  ///< volume of the intersection with the solid over that of the union

  Vec3 toDomain(const Vec3& world) const { return axes.transpose() * (world - center) / unit; }
  Vec3 toWorld(const Vec3& domain) const { return center + unit * (axes * domain); }
};

/// Chooses cells, their size and the lattice's axes.
///
/// For given axes and size the cells are the star-shaped set of largest overlap, by minimum cuts; size and
/// cells are improved by turns. Axes are searched for on a lattice of up to 8 cells, and from the best
/// climbed to a local maximum on that of all; those of the mesh are preferred unless others gain 0.01 of
/// overlap, as models are mostly made along them. A turned copy of a solid gets the turned lattice where the
/// gain is that clear.
///
/// With `options.overlap` lattices of 1 to `cells` cells are tried, and of each the planes are given up that
/// matter least (greedily); the polycube with the fewest corners is the result. If none overlaps that much,
/// it is the one that overlaps most, with a warning to the log: compare `overlap`.
///
/// Overlaps are measured along 25,000 rays or more, to about 1e-3. About a second of processor time for 16
/// cells.
/// @throws Error{Errc::usage} for impossible options
PolycubeFit fitPolycube(const StarShape& shape, const PolycubeOptions& options = {},
                        Context& context = Context::quiet());

/// A given polycube where it overlaps the solid best: its size exactly, its axes as above, in all 24
/// positions on each lattice. `options.cells` and `options.overlap` have no part in it.
PolycubeFit placePolycube(const StarShape& shape, const Polycube& polycube,
                          const PolycubeOptions& options = {}, Context& context = Context::quiet());

}  // namespace polestar
