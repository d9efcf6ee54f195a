#pragma once
// The project's goals of speed and accuracy, held against the measured rows.

#include <optional>
#include <string>
#include <vector>

#include "row.h"

namespace polestar::bench {

struct Target {
  std::string goal, measured;
  std::optional<bool> met;  ///< nothing: not measured
};

std::vector<Target> judgeTargets(const std::vector<Json>& results);

/// Exponent p of time ~ n^p, fitted to the rows of our solver on `shape` with its default tolerance, and the
/// range of n; nothing with fewer than two rows.
struct Exponent {
  double value;
  std::size_t from, to;
};
std::optional<Exponent> timeExponent(const std::vector<Json>& results, const std::string& shape);

/// Seconds from the mesh or the solid to the solution, set-up included.
double wallSeconds(const Json& result);
double cpuSeconds(const Json& result);
bool succeeded(const Json& result);

}  // namespace polestar::bench
