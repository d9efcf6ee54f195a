#pragma once
// Sets of cells by chance, star-shaped by how they grow.

#include "polestar/polycube/polycube.h"

namespace polestar::testing {

/// Up to `count` cells within `box`: from cell 0 0 0 on, cells beside those that are there are added where
/// they keep the set star-shaped.
Polycube randomPolycube(const CellBox& box, std::size_t count, unsigned seed);

}  // namespace polestar::testing
