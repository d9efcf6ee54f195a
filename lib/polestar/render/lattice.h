#pragma once
// The lattice of a cube's or polycube's cells in pictures: what a solid with such coordinates looks like, and
// the domain itself, so that the eye finds the one in the other. [Xia 2010, figs. 3 and 4]

#include <memory>

#include "polestar/polycube/polycube.h"
#include "polestar/texture/solid_texture.h"

namespace polestar {

/// Cubes that fill the domain's cells, in the domain frame. The center is in the middle of one.
struct Lattice {
  Polycube polycube;
  int divisions = 1;  ///< of a cell along each axis, odd
  /// Drawn on the domain itself: its coordinates do not bend at its edges, as those of other solids do.
  bool straight = false;

  double side() const { return polycube.cellSide() / divisions; }  ///< domain units

  /// Of the polycube, or beyond.
  Cell cellAt(const Vec3& place) const;
  /// A place on the domain's surface moved into the cell below, towards the center: faces lie in planes of
  /// the lattice, where rounding would say which cell they belong to.
  static Vec3 insideSurface(const Vec3& place) { return (1 - 2e-3) * place; }
};

/// As few divisions as give 6 cubes or more along the polycube's longest side.
Lattice latticeOf(const Polycube& polycube);

/// Every other cube a shade deeper, tinted by place: red grows along x, green along y, blue along z. Points
/// and footprints are in the domain frame. Edges are averaged over the footprint, for each axis on its own.
std::shared_ptr<const SolidTexture> makeLatticeTexture(const Lattice& lattice);

}  // namespace polestar
