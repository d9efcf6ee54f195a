#pragma once
// Is the map of a .pmap a homeomorphism of the solid onto the ball? Decided on the stored numbers, by exact
// signs.
//
// THEOREM. Let K be the complex that a closed, oriented triangle surface F spans with itself at levels
// 0, 1, ..., L and one more point o: prisms between neighbouring levels, each cut into three tetrahedra, and
// a cone of tetrahedra from level L to o. X places the nodes of K in space, B places them in the ball; both
// are continued linearly over each tetrahedron. Suppose that
//   (1) F is closed, connected, consistently oriented, each vertex a single fan, Euler number 2; under X each
//       triangle a, b, c of level 0 has det(a, b, c) > 0; and the cones of these triangles cover some
//       direction exactly once;
//   (2) every tetrahedron of K is positively oriented under X;
//   (3) every tetrahedron of K is positively oriented under B;
//   (4) (1) holds for level 0 under B, too.
// Then X is a homeomorphism of K onto the solid M bounded by the surface X(F), B is one of K onto the solid P
// bounded by B(F), both solids are star-shaped about the origin, and B o X^-1 is a piecewise linear
// homeomorphism of M onto P. The vertices of P lie on the unit sphere (a check of its own), and scaling along
// rays carries P onto the ball.
//
// PROOF. The prisms' quadrilaterals are cut from the outer end of the smaller vertex id to the inner end of
// the larger, on both sides alike, and the three diagonals of a prism never run in a circle; so K is a
// simplicial complex, F x [0, 1] with a cone on top: a ball whose boundary is F.
//   Boundary. Project F from the origin to the sphere. By (1) every triangle keeps its orientation, so a
// direction that is on no edge is covered as often as the degree says, which is the same everywhere: once.
// Were two points of F over one direction, small pieces of F around them would each cover a common open set
// (a triangle, or the triangles around an edge or a vertex, all of one orientation, cover one at least once),
// and directions there would be covered twice. So the projection is one to one, X(F) is the graph of a radius
// over the sphere: embedded, bounding a star-shaped solid M, with winding number 1 inside and 0 outside.
//   Inside. Take a point p on no image of a triangle of K. The number of tetrahedra over p, all positive, is
// the winding number of X(F) about p: 1 in M, 0 outside. So X(K) = M. Were two points of K over one p, at
// most one of them lies on F (X is one to one there). Around each of them the tetrahedra of K fill, under X,
// a set with inner points in every neighbourhood of p; around one inside K, whose link is a sphere of
// positively oriented triangles, so of degree at least one, they fill a whole neighbourhood of p. So points
// near p are covered twice, against the count. X is one to one, continuous, from a compact set: a
// homeomorphism onto M. The same holds for B and P.                                                        #
//
// Positive tetrahedra alone would not do: they can wrap around an edge, a vertex or the whole ball twice. The
// covering numbers are what excludes that, and by Riemann and Hurwitz a surface of genus 0 can have another
// one with every triangle positive.
//
// What is not judged: whether the solid is the one that the user means, and whether the map comes from
// Green's function. The first is for eyes, the second for judge_vdb.h.

#include "pmap_file.h"
#include "report.h"

namespace polestar::verify {

// A map into a polycube P is three maps in a row, M onto a ball, the ball onto itself, a ball onto P
// backward; it is a homeomorphism when all three are. The theorem is asked of both ball maps, the names of
// the checks of the second begin with `domain_`; its solid has to be the union of the cells that the file
// names; and the motion between the balls is a rotation times a Moebius transformation on every shell, which
// is one to one as long as its pull is below 1, or a table whose triangles keep their orientation on all
// shells.

/// Parallel, linear in the cells: about 0.1 us a tetrahedron.
Report judgePmap(const PmapContents& map);

/// Nodes of a tetrahedron of K, positively oriented when the surface's triangles run counter-clockwise seen
/// from outside. Cells 3 (layer * triangles + t) + 0, 1, 2 of the layers, then one a triangle around the
/// center.
std::array<std::size_t, 4> cellNodes(const BallMapContents& map, std::size_t cell);
std::size_t cellCount(const BallMapContents& map);

}  // namespace polestar::verify
