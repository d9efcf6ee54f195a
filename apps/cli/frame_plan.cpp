#include "cli/frame_plan.h"

#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"

namespace polestar::cli {

namespace fs = std::filesystem;

std::vector<FrameJob> planFrames(const fs::path& input, const fs::path& output,
                                 const std::optional<std::string>& range) {
  const FramePath from(input), to(output);
  if (!range) {
    for (const FramePath* path : {&from, &to}) {
      if (path->numbered()) {
        throw Error(Errc::usage, path->pattern().string() +
                                     " has a place for a frame's number; say which with --frames 1-48");
      }
    }
    return {{std::nullopt, input, output}};
  }
  const FrameRange frames = FrameRange::parse(*range);
  if (frames.size() > 1 && !to.numbered()) {
    throw Error(Errc::usage, "the output " + output.string() + " has no place for the number of " +
                                 counted(frames.size(), "frame", "frames") +
                                 "; write name.####.png, name.%04d.png or name.$F4.png");
  }
  std::vector<FrameJob> jobs;
  std::size_t missing = 0;
  fs::path firstMissing;
  for (const int frame : frames.frames()) {
    jobs.push_back({frame, from.at(frame), to.at(frame)});
    if (fs::exists(jobs.back().input)) continue;
    if (missing++ == 0) firstMissing = jobs.back().input;
  }
  if (missing == 0) return jobs;
  throw Error(Errc::io, "cannot read " + firstMissing.string() + ": there is no such file" +
                            (jobs.size() > 1 ? " (" + grouped(missing) + " of " + grouped(jobs.size()) +
                                                   " inputs are missing)"
                                             : ""));
}

}  // namespace polestar::cli
