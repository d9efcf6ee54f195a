#pragma once
// Opponents that are programs of their own.

#include <optional>
#include <string>
#include <vector>

namespace polestar::bench {

/// Runs words[0], looked for on the PATH, with the other words as its arguments; what it prints is dropped.
/// @return its exit status, 128 and the number of the signal that ended it; nothing when there is no such
/// program.
/// @throws std::runtime_error when it cannot be started or waited for.
std::optional<int> runProgram(const std::vector<std::string>& words);

}  // namespace polestar::bench
