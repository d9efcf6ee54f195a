#pragma once
// Samples that can refute a map: the computed Green's function against what the true one is bound to.

#include <vector>

#include "polestar/certify/certificate.h"

namespace polestar::detail {

/// `boundary_error`, `charge` (of a layer) and `field_signs`, all measured on the field as it is evaluated,
/// whatever its record says.
std::vector<Check> falsifyField(const GreenFunction& green);

}  // namespace polestar::detail
