#pragma once
// Commands that work through frames: which files each reads and writes.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "polestar/core/context.h"

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

/// While it lives, the progress of one frame is shown as its share of all.
class FrameProgress {
 public:
  FrameProgress(Context& context, std::size_t frame, std::size_t frames)
      : context_(context), whole_(context.onProgress) {
    if (!whole_) return;
    context.onProgress = [this, frame, frames](std::string_view stage, double fraction) {
      whole_(stage, (static_cast<double>(frame) + fraction) / static_cast<double>(frames));
    };
  }
  ~FrameProgress() { context_.onProgress = whole_; }
  FrameProgress(const FrameProgress&) = delete;
  FrameProgress& operator=(const FrameProgress&) = delete;

 private:
  Context& context_;
  std::function<void(std::string_view, double)> whole_;
};

}  // namespace polestar::cli
