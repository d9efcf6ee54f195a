#pragma once
// The page and its plots, from the measured rows alone.

#include <filesystem>
#include <vector>

#include "row.h"

namespace polestar::bench {

/// Writes bench-green.md and bench-green-*.svg into `folder`.
void writeReport(const std::filesystem::path& folder, const std::vector<Json>& results);

}  // namespace polestar::bench
