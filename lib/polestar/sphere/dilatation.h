#pragma once
// How far the linear map between two triangles is from keeping angles.

#include <array>

#include "polestar/core/types.h"

namespace polestar {

/// Quasi-conformal dilatation sigma_1 / sigma_2 >= 1 of the linear map between two triangles; infinite when
/// either has no area.
double dilatation(const std::array<Vec3, 3>& from, const std::array<Vec3, 3>& to);

}  // namespace polestar
