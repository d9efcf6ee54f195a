#include "batch/local_run.h"

#include <poll.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <deque>
#include <fstream>
#include <iostream>
#include <numeric>

#include "batch/child.h"
#include "batch/task_state.h"
#include "cli/command_line.h"
#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar::batch {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

/// Exit code of a child that found nothing to do; no command has it.
constexpr int kUpToDate = 64;
constexpr std::chrono::milliseconds kShowInterval{200}, kLockedInterval{500};
constexpr std::chrono::seconds kGrace{10};  // from SIGTERM to SIGKILL

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// What a process that was killed has left of a file: writeAtomically's temporaries. The task's lock is held.
void removeLeftovers(const fs::path& output) {
  const std::string prefix = "." + output.filename().string() + ".";
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(output.parent_path(), ignored)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix) && name.ends_with(".part") &&
        name.find_first_not_of("0123456789-", prefix.size()) == name.size() - std::strlen(".part"))
      fs::remove(entry.path(), ignored);
  }
}

/// The child's work: from looking whether there is any to the command itself.
int runTask(const Plan& plan, const Task& task, int threads, const RunCommand& command) {
  fs::current_path(plan.folder);
  const std::optional<std::string> why = whyStale(plan, task);
  if (!why) return kUpToDate;
  if (ftruncate(STDERR_FILENO, 0) != 0) return 1;
  std::vector<std::string> words = task.arguments;
  std::cerr << cli::commandLine(words) << "\nbecause " << *why << std::endl;
  for (const fs::path& output : task.outputs) {
    fs::create_directories(output.parent_path());
    removeLeftovers(output);
  }
  words.insert(words.end(), {"--overwrite", "--json", "-j", std::to_string(threads)});
  return command(words);
}

std::string signalName(int number) {
  const char* name = sigdescr_np(number);
  return "signal " + std::to_string(number) + (name ? std::string(" (") + name + ")" : "");
}

std::string oneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

std::string whySkipped(const Plan& plan, std::size_t need, const TaskResult& result) {
  return "needs " + plan.tasks[need].label() + ", which " +
         (result.state == TaskState::failed ? "failed" : "was skipped");
}

std::string hostName() {
  utsname name{};
  return uname(&name) == 0 ? name.nodename : "";
}

class Run {
 public:
  Run(const Plan& plan, const std::vector<std::size_t>& selection, const RunCommand& command,
      const RunOptions& options, Context& context, const std::function<void(const RunCounts&)>& show)
      : plan_(plan),
        selection_(selection),
        command_(command),
        options_(options),
        context_(context),
        show_(show),
        results_(plan.tasks.size()) {
    waiting_.assign(selection.begin(), selection.end());
    // Later steps first: results appear early, and what is wrong shows early.
    std::stable_sort(waiting_.begin(), waiting_.end(),
                     [&](std::size_t a, std::size_t b) { return plan.tasks[a].step > plan.tasks[b].step; });
  }

  std::vector<TaskResult> run() {
    while (!waiting_.empty() || !running_.empty()) {
      if (context_.cancelled()) cancel();
      skipHopeless();
      startAll();
      show();
      if (!waiting_.empty() || !running_.empty()) wait();
    }
    return std::move(results_);
  }

 private:
  struct Running {
    std::size_t task = 0;
    int threads = 1;
    Clock::time_point start;
    Child child;
    Descriptor lock;
  };

  bool settled(std::size_t task) const {
    return results_[task].state == TaskState::upToDate || results_[task].state == TaskState::done;
  }

  bool ready(std::size_t task) const {
    const auto& after = plan_.tasks[task].after;
    return options_.needsAreElsewhere ||
           std::all_of(after.begin(), after.end(), [&](std::size_t other) { return settled(other); });
  }

  /// What needs a failed task.
  void skipHopeless() {
    if (options_.needsAreElsewhere) return;
    // A task comes after what it needs in the plan, not in this list: until nothing changes any more.
    for (bool changed = true; changed;) {
      changed = false;
      std::erase_if(waiting_, [&](std::size_t task) {
        for (const std::size_t other : plan_.tasks[task].after) {
          if (results_[other].state != TaskState::failed && results_[other].state != TaskState::skipped)
            continue;
          results_[task].state = TaskState::skipped;
          results_[task].error = whySkipped(plan_, other, results_[other]);
          return changed = true;
        }
        return false;
      });
    }
  }

  void startAll() {
    const std::size_t most =
        static_cast<std::size_t>(options_.atOnce > 0 ? options_.atOnce : options_.threads);
    std::size_t count = static_cast<std::size_t>(
        std::count_if(waiting_.begin(), waiting_.end(), [&](std::size_t task) { return startable(task); }));
    for (auto at = waiting_.begin(); at != waiting_.end() && running_.size() < most;) {
      const int busy = std::accumulate(running_.begin(), running_.end(), 0,
                                       [](int sum, const Running& other) { return sum + other.threads; });
      const int free = options_.threads - busy;
      if (free <= 0) return;
      if (!startable(*at)) {
        ++at;
        continue;
      }
      const auto share = std::min(count, most - running_.size());
      const int threads = std::max(1, free / static_cast<int>(std::max<std::size_t>(1, share)));
      --count;
      at = start(*at, threads) ? waiting_.erase(at) : std::next(at);
    }
  }

  bool startable(std::size_t task) const {
    const auto locked = lockedUntil_.find(task);
    return ready(task) && (locked == lockedUntil_.end() || locked->second <= Clock::now());
  }

  /// Nothing happens when another batch has the task.
  bool start(std::size_t index, int threads) {
    const Task& task = plan_.tasks[index];
    const fs::path log = plan_.folder / task.log;
    std::error_code error;
    fs::create_directories(log.parent_path(), error);
    if (error)
      throw Error(Errc::io, "cannot make the folder " + log.parent_path().string() + ": " + error.message());
    Descriptor lock = openLocked(log);
    if (!lock) {
      lockedUntil_[index] = Clock::now() + kLockedInterval;
      return false;
    }
    Child child(lock, [this, &task, threads] { return runTask(plan_, task, threads, command_); });
    results_[index].state = TaskState::running;
    ++results_[index].attempts;
    running_.push_back({index, threads, Clock::now(), std::move(child), std::move(lock)});
    return true;
  }

  /// Until a task ends, or it is time to look around.
  void wait() {
    std::vector<pollfd> handles;
    for (const Running& task : running_) handles.push_back({task.child.waitable(), POLLIN, 0});
    poll(handles.data(), handles.size(), static_cast<int>(kShowInterval.count()));
    for (std::size_t i = handles.size(); i-- > 0;) {
      if (!(handles[i].revents & (POLLIN | POLLHUP))) continue;
      Running task = std::move(running_[i]);
      running_.erase(running_.begin() + static_cast<std::ptrdiff_t>(i));
      finish(task);
    }
  }

  void finish(Running& running) {
    const Task& task = plan_.tasks[running.task];
    TaskResult& result = results_[running.task];
    const ChildEnd end = running.child.finish();
    result.exitCode = end.signal ? 128 + end.signal : end.exitCode;
    result.seconds = secondsSince(running.start);
    result.cpuSeconds = end.cpuSeconds;
    result.peakMemory = end.peakMemory;
    if (end.exitCode == kUpToDate) {
      result = {.state = TaskState::upToDate,
                .exitCode = 0,
                .attempts = 0,
                .seconds = 0,
                .cpuSeconds = 0,
                .peakMemory = 0,
                .error = {}};
      return;
    }
    if (context_.cancelled()) {
      result.state = TaskState::cancelled;
      return;
    }
    const Json answer = Json::parse(end.out, nullptr, /*allow_exceptions=*/false);
    if (end.exitCode == 0) {
      result.state = TaskState::done;
      result.error.clear();
    } else {
      result.state = TaskState::failed;
      result.error = oneLine(whyFailed(end, answer));
    }
    record(task, result, answer);
    if (result.state != TaskState::failed) return;
    // 130: somebody ended this task alone.
    const bool mayPass = end.signal != 0 || end.exitCode == 1 || end.exitCode == 3 || end.exitCode == 130;
    if (mayPass && result.attempts <= options_.retries) {
      context_.log(LogLevel::warning, task.label() + " failed and is tried again: " + result.error);
      result.state = TaskState::waiting;
      waiting_.push_front(running.task);
    } else {
      context_.log(LogLevel::warning, task.label() + " failed: " + result.error);
    }
  }

  static std::string whyFailed(const ChildEnd& end, const Json& answer) {
    if (end.signal) {
      return "ended by " + signalName(end.signal) +
             (end.signal == SIGKILL ? "; was there too little memory? try fewer tasks at once" : "");
    }
    const Json::json_pointer message("/error/message");
    if (answer.is_object() && answer.contains(message)) return answer[message].get<std::string>();
    return "exit code " + std::to_string(end.exitCode) + "; see the log";
  }

  /// Beside the log; a batch goes on where this cannot be written.
  void record(const Task& task, const TaskResult& result, const Json& answer) const {
    const Json json{{"schema", "polestar-task/1"},
                    {"task", task.label()},
                    {"command", cli::commandLine(task.arguments)},
                    {"folder", plan_.folder.string()},
                    {"host", hostName()},
                    {"exit_code", result.exitCode},
                    {"error", result.error.empty() ? Json() : Json(result.error)},
                    {"attempts", result.attempts},
                    {"seconds", result.seconds},
                    {"cpu_seconds", result.cpuSeconds},
                    {"peak_memory_bytes", result.peakMemory},
                    {"answer", answer.is_discarded() ? Json() : answer}};
    try {
      const fs::path path = plan_.folder / task.result();
      removeLeftovers(path);
      writeAtomically(path, [&](const fs::path& temporary) {
        std::ofstream out(temporary, std::ios::binary);
        out << json.dump(1, ' ', false, Json::error_handler_t::replace) << std::endl;
        if (!out) throw Error(Errc::io, "cannot write " + path.string() + "; is the disk full?");
      });
    } catch (const std::exception& error) {
      context_.log(LogLevel::warning, std::string("the record of ") + task.label() + ": " + error.what());
    }
  }

  [[noreturn]] void cancel() {
    for (const Running& task : running_) task.child.signal(SIGTERM);
    const auto start = Clock::now();
    while (!running_.empty()) {
      if (Clock::now() - start > kGrace) {
        for (const Running& task : running_) task.child.signal(SIGKILL);
      }
      wait();
    }
    throw Error(Errc::cancelled, "cancelled");
  }

  void show() const {
    if (!show_) return;
    RunCounts counts;
    counts.total = selection_.size();
    counts.seconds = secondsSince(start_);
    double left = 0;
    for (const Step step : kSteps) left += secondsLeftOf(step, counts);
    const double threads = std::max<double>(1, options_.atOnce > 0 ? options_.atOnce : options_.threads);
    for (const Running& task : running_) counts.running.push_back(plan_.tasks[task.task].label());
    if (counts.done > 0) counts.secondsLeft = left / threads;
    show_(counts);
  }

  /// By the mean of its tasks so far; adds up counts on the way.
  double secondsLeftOf(Step step, RunCounts& counts) const {
    double seconds = 0, open = 0;
    std::size_t done = 0;
    for (const std::size_t i : selection_) {
      if (plan_.tasks[i].step != step) continue;
      const TaskResult& result = results_[i];
      counts.upToDate += result.state == TaskState::upToDate;
      counts.done += result.state == TaskState::done;
      counts.failed += result.state == TaskState::failed;
      counts.skipped += result.state == TaskState::skipped;
      if (result.state == TaskState::done) {
        seconds += result.seconds;
        ++done;
      }
      open += result.state == TaskState::waiting ? 1.0 : result.state == TaskState::running ? 0.5 : 0.0;
    }
    return done > 0 ? open * seconds / static_cast<double>(done) : 0;
  }

  const Plan& plan_;
  const std::vector<std::size_t>& selection_;
  const RunCommand& command_;
  const RunOptions& options_;
  Context& context_;
  const std::function<void(const RunCounts&)>& show_;
  std::vector<TaskResult> results_;
  std::deque<std::size_t> waiting_;
  std::vector<Running> running_;
  std::map<std::size_t, Clock::time_point> lockedUntil_;
  const Clock::time_point start_ = Clock::now();
};

/// What the record beside a task's log says of its failure; nothing where it says none.
std::optional<TaskResult> failureOnRecord(const Plan& plan, const Task& task) {
  std::ifstream in(plan.folder / task.result());
  const Json json = Json::parse(in, nullptr, /*allow_exceptions=*/false);
  if (!json.is_object() || json.value("exit_code", 0) == 0) return std::nullopt;
  TaskResult result;
  result.state = TaskState::failed;
  result.exitCode = json.value("exit_code", 1);
  result.attempts = json.value("attempts", 1);
  result.seconds = json.value("seconds", 0.0);
  if (json.contains("error") && json["error"].is_string()) result.error = json["error"].get<std::string>();
  return result;
}

}  // namespace

const char* toString(TaskState state) {
  switch (state) {
    case TaskState::waiting:
      return "waiting";
    case TaskState::running:
      return "running";
    case TaskState::upToDate:
      return "up to date";
    case TaskState::done:
      return "done";
    case TaskState::failed:
      return "failed";
    case TaskState::skipped:
      return "skipped";
    case TaskState::cancelled:
      return "cancelled";
  }
  return "";
}

std::vector<TaskResult> runLocally(const Plan& plan, const std::vector<std::size_t>& selection,
                                   const RunCommand& command, const RunOptions& options, Context& context,
                                   const std::function<void(const RunCounts&)>& show) {
  return Run(plan, selection, command, options, context, show).run();
}

std::vector<TaskResult> collectResults(const Plan& plan, const std::vector<std::size_t>& selection) {
  std::vector<TaskResult> results(plan.tasks.size());
  for (const std::size_t i : selection) {
    const auto& after = plan.tasks[i].after;
    const auto bad = std::find_if(after.begin(), after.end(), [&](std::size_t other) {
      return results[other].state == TaskState::failed || results[other].state == TaskState::skipped;
    });
    const std::optional<std::string> why = whyStale(plan, plan.tasks[i]);
    if (!why) {
      results[i].state = TaskState::upToDate;
    } else if (bad != after.end()) {
      // Where it ran nevertheless, its record says no more than that something was not there.
      results[i].state = TaskState::skipped;
      results[i].error = whySkipped(plan, *bad, results[*bad]);
    } else if (const auto failure = failureOnRecord(plan, plan.tasks[i])) {
      results[i] = *failure;
    } else {
      results[i].error = *why;
    }
  }
  return results;
}

}  // namespace polestar::batch
