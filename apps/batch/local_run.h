#pragma once
// Tasks of a plan, run on this machine.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "batch/plan.h"
#include "polestar/core/context.h"

namespace polestar::batch {

enum class TaskState {
  waiting,   ///< for its needs or its turn
  running,   ///< here, or in another batch
  upToDate,  ///< nothing was left to do
  done,      ///< run now, with success
  failed,
  skipped,  ///< something it needs failed
  cancelled
};
const char* toString(TaskState state);

struct TaskResult {
  TaskState state = TaskState::waiting;
  int exitCode = 0;  ///< of the last attempt; 128 + the signal that ended it
  int attempts = 0;
  double seconds = 0, cpuSeconds = 0;  ///< of the last attempt
  long peakMemory = 0;                 ///< bytes, of the last attempt
  std::string error;                   ///< why it failed, on one line
};

/// Counts of a run, for whoever shows them.
struct RunCounts {
  std::size_t total = 0, upToDate = 0, done = 0, failed = 0, skipped = 0;
  std::vector<std::string> running;  ///< labels, those that began first in front
  double seconds = 0;                ///< since the start
  std::optional<double> secondsLeft;

  std::size_t settled() const { return upToDate + done + failed + skipped; }
};

struct RunOptions {
  int threads = 1;  ///< of all tasks together
  int atOnce = 0;   ///< most tasks at a time; 0: as many as threads
  int retries = 1;  ///< after a crash or an error of files; other errors come again
  /// Runs tasks whose needs are made elsewhere: all that can be said of those is whether the files are there.
  bool needsAreElsewhere = false;
};

/// Runs `words`, a command line of polestar without its name, in this process and returns the exit code.
using RunCommand = std::function<int(const std::vector<std::string>& words)>;

/// Runs the tasks of `selection` (ascending, with all they need) and returns a result for each task of the
/// plan.
///
/// Every task is a process of its own and has its log file locked while it runs: another batch on the same
/// outputs leaves it alone and looks again later, so that any number of them share the work. What is up to
/// date (whyStale) is not run. A task that fails fails alone; those that need it are skipped. Threads are
/// dealt out: as many tasks at once as there are threads, and more threads for each where there are fewer
/// tasks. What a task came to is written beside its log.
///
/// On cancel the tasks get SIGTERM, and after some seconds SIGKILL.
/// @throws Error{Errc::io} when the logs cannot be written; Error{Errc::cancelled}.
std::vector<TaskResult> runLocally(const Plan& plan, const std::vector<std::size_t>& selection,
                                   const RunCommand& command, const RunOptions& options, Context& context,
                                   const std::function<void(const RunCounts&)>& show);

/// What runs of elsewhere came to, by what lies there: up to date, failed with what its record says, or
/// waiting.
std::vector<TaskResult> collectResults(const Plan& plan, const std::vector<std::size_t>& selection);

}  // namespace polestar::batch
