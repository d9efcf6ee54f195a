#pragma once
// From a job file to tasks: command lines of polestar that can be run again at any time, what each reads and
// writes, and which have to be done before.

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "batch/job_file.h"

namespace polestar::batch {

using Json = nlohmann::ordered_json;

/// Paths in it start from Plan::folder, where it runs.
struct Task {
  Step step = Step::map;
  std::string name;                    ///< unique in its step, such as "kiwi/bennu" or "kiwi/bennu 1-12"
  std::vector<std::string> arguments;  ///< of polestar; without --overwrite, --json and -j
  /// Files, or numbered patterns, which stand for all files that are there.
  std::vector<std::filesystem::path> inputs;
  std::vector<std::filesystem::path> outputs;
  std::vector<std::size_t> after;  ///< tasks that make inputs; all come before this one
  std::filesystem::path log;       ///< standard error of its last run

  std::string label() const { return std::string(toString(step)) + " " + name; }
  /// What its last run came to, beside the log.
  std::filesystem::path result() const;
};

/// A picture's place on a sheet.
struct PlannedPicture {
  std::string texture, target;
  std::filesystem::path path;
  std::size_t task = 0;
};

struct Plan {
  std::filesystem::path folder;  ///< absolute
  std::filesystem::path output;  ///< from there
  int retries = 1;
  std::vector<Task> tasks;  ///< all of a step together, steps in their order
  std::vector<PlannedPicture> pictures;

  /// The tasks that are ends in themselves: no other needs what they make.
  std::vector<std::size_t> ends() const;
  /// `chosen` and all that has to be done before, ascending.
  std::vector<std::size_t> withNeeds(const std::vector<std::size_t>& chosen) const;
};

/// Results go to OUTPUT/maps, /solids/TEXTURE, /pictures/TEXTURE and /logs/STEP.
/// @throws Error{Errc::usage} for a numbered target without frames, a map where a mesh is to be mapped or the
/// other way round, and a texture of a file that shall be rendered without a transfer.
Plan makePlan(const JobFile& job);

/// A plan as a file, for tasks that run elsewhere and later: schema "polestar-plan/1".
Json toJson(const Plan& plan);
/// @throws Error{Errc::io} for a file that cannot be read or is no plan.
Plan readPlan(const std::filesystem::path& path);

}  // namespace polestar::batch
