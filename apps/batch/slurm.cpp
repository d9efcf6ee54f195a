#include "batch/slurm.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "batch/child.h"
#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar::batch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDefaultMaxArraySize = 1001;  // Slurm's own
constexpr std::chrono::seconds kPollInterval{2};
constexpr int kPatience = 30;  // polls that may fail in a row: a controller that restarts

// All that differs between tasks comes as arguments, which no shell reads again.
constexpr const char* kScript =
    "#!/bin/sh\n"
    "# A task of a batch: polestar, the plan, and the number of this array's first task.\n"
    "exec \"$1\" batch \"$2\" --task \"$(($3 + SLURM_ARRAY_TASK_ID))\"\n";

std::string trimmed(std::string text) {
  while (!text.empty() && (text.back() == '\n' || text.back() == ' ')) text.pop_back();
  return text;
}

std::string run(const std::vector<std::string>& words) {
  const ProgramEnd end = runProgram(words);
  if (end.exitCode == 127)
    throw Error(Errc::io,
                words[0] + " is not there: this machine has no client of Slurm; try --submit print");
  if (end.exitCode != 0)
    throw Error(Errc::io, words[0] + " refused: " + trimmed(end.err.empty() ? end.out : end.err));
  return end.out;
}

/// Indices of an array are below this.
std::size_t maxArraySize() {
  std::istringstream lines(run({"scontrol", "show", "config"}));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::string name, equals;
    std::size_t value = 0;
    if (words >> name >> equals >> value && name == "MaxArraySize" && value > 0) return value;
  }
  return kDefaultMaxArraySize;
}

std::vector<std::string> optionWords(const SlurmOptions& options, Step step) {
  std::map<std::string, std::string> all = options.all;
  for (const auto& [name, value] : options.of[static_cast<std::size_t>(step)]) all[name] = value;
  // Without it a task would take all cores of its node.
  all.emplace("cpus-per-task", "1");
  std::vector<std::string> words;
  for (const auto& [name, value] : all) words.push_back("--" + name + (value.empty() ? "" : "=" + value));
  return words;
}

std::string joined(const std::vector<std::string>& texts, char separator) {
  std::string result;
  for (const std::string& text : texts) result += (result.empty() ? "" : std::string(1, separator)) + text;
  return result;
}

fs::path writeScript(const fs::path& folder) {
  const fs::path script = folder / "task.sh";
  writeAtomically(script, [](const fs::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << kScript << std::flush;
    if (!out) throw Error(Errc::io, "cannot write " + temporary.string() + "; is the disk full?");
  });
  return script;
}

/// Array tasks that are pending and running; a pending array is one line with all its indices.
struct QueueState {
  std::size_t pending = 0, running = 0;
};

std::optional<QueueState> queueState(const std::vector<std::string>& ids) {
  // -r: a line for each task of an array.
  const ProgramEnd end = runProgram({"squeue", "-h", "-r", "-o", "%T", "-j", joined(ids, ',')});
  // Slurm forgets jobs some minutes after their end, and does not know them then.
  if (end.exitCode != 0 && end.err.find("Invalid job id") != std::string::npos) return QueueState{};
  if (end.exitCode != 0) return std::nullopt;
  QueueState state;
  std::istringstream lines(end.out);
  for (std::string line; std::getline(lines, line);)
    ++(line.starts_with("PENDING") ? state.pending : state.running);
  return state;
}

}  // namespace

std::string arrayRanges(const std::vector<std::size_t>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t last = i;
    while (last + 1 < numbers.size() && numbers[last + 1] == numbers[last] + 1) ++last;
    text += (text.empty() ? "" : ",") + std::to_string(numbers[i]);
    if (last > i) text += "-" + std::to_string(numbers[last]);
    i = last + 1;
  }
  return text;
}

std::vector<SlurmJob> submitToSlurm(const Plan& plan, const std::vector<std::size_t>& tasks,
                                    const SlurmOptions& options, const fs::path& planFile,
                                    const fs::path& folder, const fs::path& polestar) {
  const std::size_t limit = maxArraySize();
  const fs::path script = writeScript(folder);
  std::vector<SlurmJob> jobs;
  std::vector<std::string> before;
  try {
    for (const Step step : kSteps) {
      std::map<std::size_t, std::vector<std::size_t>> chunks;
      for (const std::size_t task : tasks) {
        if (plan.tasks[task].step == step) chunks[task / limit].push_back(task);
      }
      std::vector<std::string> ids;
      for (auto& [chunk, members] : chunks) {
        std::vector<std::size_t> indices;
        for (const std::size_t task : members) indices.push_back(task - chunk * limit);
        std::vector<std::string> words{"sbatch",
                                       "--parsable",
                                       "--array=" + arrayRanges(indices),
                                       "--job-name=polestar-" + std::string(toString(step)),
                                       "--chdir=" + folder.string(),
                                       "--output=slurm-%A_%a.out"};
        const auto more = optionWords(options, step);
        words.insert(words.end(), more.begin(), more.end());
        if (!before.empty()) words.push_back("--dependency=afterany:" + joined(before, ':'));
        words.insert(words.end(),
                     {script.string(), polestar.string(), planFile.string(), std::to_string(chunk * limit)});
        // "ID" or "ID;CLUSTER".
        const std::string answer = trimmed(run(words));
        ids.push_back(answer.substr(0, answer.find(';')));
        jobs.push_back({ids.back(), step, members});
      }
      before.insert(before.end(), ids.begin(), ids.end());
    }
  } catch (...) {
    std::vector<std::string> words{"scancel"};
    for (const SlurmJob& job : jobs) words.push_back(job.id);
    if (!jobs.empty()) runProgram(words);
    throw;
  }
  return jobs;
}

std::vector<std::string> unfinishedJobs(const std::vector<std::string>& ids) {
  std::vector<std::string> unfinished;
  for (const std::string& id : ids) {
    const auto state = queueState({id});
    if (!state) throw Error(Errc::io, "squeue does not answer; is the controller of Slurm up?");
    if (state->pending + state->running > 0) unfinished.push_back(id);
  }
  return unfinished;
}

void waitForSlurm(const std::vector<SlurmJob>& jobs, Context& context,
                  const std::function<void(std::size_t, std::size_t, std::size_t)>& show) {
  std::vector<std::string> ids;
  std::size_t all = 0;
  for (const SlurmJob& job : jobs) {
    ids.push_back(job.id);
    all += job.tasks.size();
  }
  for (int silent = 0; !ids.empty();) {
    context.throwIfCancelled();
    if (const auto state = queueState(ids)) {
      silent = 0;
      show(state->pending, state->running, all);
      if (state->pending + state->running == 0) return;
    } else if (++silent > kPatience) {
      throw Error(Errc::io, "squeue does not answer; the jobs " + joined(ids, ',') +
                                " go on, and polestar batch --status tells what came of them");
    }
    std::this_thread::sleep_for(kPollInterval);
  }
}

}  // namespace polestar::batch
