#pragma once
// The pages bench-maps.md and bench-distortion.md, from the measured rows alone.

#include <filesystem>
#include <string>
#include <vector>

#include "results.h"

namespace polestar::bench {

void writePages(const std::filesystem::path& folder, const std::vector<Json>& results);

/// A row as one line for people.
std::string summaryLine(const Json& row);

/// How often the method `ours` is better and worse than `other` in the comparisons where both have a value,
/// smaller values being better.
struct Score {
  int wins = 0, losses = 0, ties = 0;
};
struct Measure {
  const char* title;
  const char* path;  ///< JSON pointer into a method's entry
  bool largerIsBetter = false;
};
Score scoreOf(const std::vector<Json>& comparisons, const std::string& ours, const std::string& other,
              const Measure& measure);

}  // namespace polestar::bench
