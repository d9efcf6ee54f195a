#pragma once
// A good map to be spoiled in one place, and what its certificate says.

#include <string>

#include "polestar/certify/certificate.h"
#include "polestar/map/ball_map.h"

namespace polestar::testing {

/// Three smooth lobes, default options.
const BallMap& star();

/// A copy of all that a chart is made of.
GreenChart::Data partsOf(const GreenChart& chart);
BallMap mapOf(GreenChart::Data data, SphereMap sphere);

/// `directions` as the sphere map of a chart, its flips counted.
SphereMap sphereMap(const GreenChart& chart, std::vector<Vec3> directions);

const Check& checkOf(const Certificate& certificate, const std::string& name);

/// Names of the checks that decided against the map, in order.
std::vector<std::string> failuresOf(const Certificate& certificate);
/// The first of them, or empty.
std::string failureOf(const Certificate& certificate);

}  // namespace polestar::testing
