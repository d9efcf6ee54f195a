#pragma once
// A plan on a Slurm cluster: job arrays of tasks, a step after the other.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "polestar/core/context.h"

namespace polestar::batch {

/// What was handed to Slurm.
struct SlurmJob {
  std::string id;
  Step step = Step::map;
  std::vector<std::size_t> tasks;
};

/// "0-3,7,9-10" from ascending numbers: what --array takes.
std::string arrayRanges(const std::vector<std::size_t>& numbers);

/// Submits `tasks` (ascending) of the plan that lies in `planFile`, an array a step, several where the
/// cluster's MaxArraySize wants it. A step waits for the end of those before it, whatever came of them: a
/// task whose needs failed says so itself, and the others go on. `polestar`: the program as the nodes find
/// it. `folder`: for Slurm's own logs, of what happens before and after a task. Returns the jobs in the order
/// of their steps.
/// @throws Error{Errc::io} when Slurm's programs are not there or refuse; jobs that were submitted before are
/// cancelled then.
std::vector<SlurmJob> submitToSlurm(const Plan& plan, const std::vector<std::size_t>& tasks,
                                    const SlurmOptions& options, const std::filesystem::path& planFile,
                                    const std::filesystem::path& folder,
                                    const std::filesystem::path& polestar);

/// Which of the jobs are not over yet, by squeue. @throws Error{Errc::io}
std::vector<std::string> unfinishedJobs(const std::vector<std::string>& ids);

/// Waits for the end of all of them; `show` gets the numbers of array tasks that are pending and running, and
/// of all there are. @throws Error{Errc::io}; Error{Errc::cancelled}, the jobs go on.
void waitForSlurm(const std::vector<SlurmJob>& jobs, Context& context,
                  const std::function<void(std::size_t pending, std::size_t running, std::size_t all)>& show);

}  // namespace polestar::batch
