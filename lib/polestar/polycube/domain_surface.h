#pragma once
// A polycube's surface as a map of it wants it.

#include "polestar/polycube/polycube.h"

namespace polestar {

/// Polycube::surface() with 2 divisions, then triangles beside reentrant edges halved `rounds` times: field
/// lines fan out from there, and the table of a map has nothing but lines. Those at corners where reentrant
/// edges of several directions meet are halved four times more, where rho |G| is largest. Domain frame.
TriMesh domainSurface(const Polycube& polycube, int rounds = 6);

}  // namespace polestar
