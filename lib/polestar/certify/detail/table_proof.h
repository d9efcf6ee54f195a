#pragma once
// The conditions of the theorem on piecewise linear maps, one by one, for the table of a map.

#include <vector>

#include "polestar/certify/certificate.h"

namespace polestar::detail {

/// Together these checks are what polestar-verify asks of a .pmap. The theorem and its proof stand in
/// apps/verify/judge_pmap.h; that the surface is closed, oriented and of genus 0 is what a StarShape carries.
/// Signs are exact; that level 0 is the surface, and that levels are spheres, holds to rounding.
std::vector<Check> proveTable(const BallMap& map);

}  // namespace polestar::detail
