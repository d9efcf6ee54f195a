#pragma once
// Rotations to search through.

#include <vector>

#include "polestar/core/types.h"

namespace polestar {

/// `count` rotations, evenly spread over all of them. [Alexa 2022, "Super-Fibonacci Spirals", algorithm 1]
std::vector<Mat3> spreadRotations(int count);

}  // namespace polestar
