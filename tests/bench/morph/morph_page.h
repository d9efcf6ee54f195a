#pragma once
// The page bench-morph.md, from the measured rows alone.

#include <filesystem>
#include <string>
#include <vector>

#include "results.h"

namespace polestar::bench {

void writeMorphPage(const std::filesystem::path& folder, const std::vector<Json>& results);

/// A row as one line for people.
std::string summaryLine(const Json& row);

/// A frame's volume over that of the geometric blend of the ends, V_0^(1-t) V_1^t.
double relativeVolume(const Json& row, const Json& frame);

}  // namespace polestar::bench
