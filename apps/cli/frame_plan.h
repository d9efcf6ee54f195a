#pragma once
// Commands that work through frames: which files each reads and writes.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace polestar::cli {

struct FrameJob {
  std::optional<int> frame;  ///< nothing: the only one, without a number
  std::filesystem::path input, output;
};

/// One job a frame of `range` ("1-48x2"); without a range one job.
/// @throws Error{Errc::usage} for a place of a number without a range, or a range of several frames without
/// such a place in the output's name; Error{Errc::io} for inputs that are not there: the first, and how many.
std::vector<FrameJob> planFrames(const std::filesystem::path& input, const std::filesystem::path& output,
                                 const std::optional<std::string>& range);

}  // namespace polestar::cli
