#include "batch/report.h"

#include <algorithm>
#include <array>

#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/io/contact_sheet.h"

namespace polestar::batch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kBarWidth = 20;
constexpr double kSecondsAMinute = 60;
constexpr std::array kStates{TaskState::done,    TaskState::upToDate,  TaskState::failed,
                             TaskState::skipped, TaskState::cancelled, TaskState::waiting};

std::size_t count(const Plan& plan, const std::vector<std::size_t>& selection,
                  const std::vector<TaskResult>& results, Step step, TaskState state) {
  return static_cast<std::size_t>(std::count_if(selection.begin(), selection.end(), [&](std::size_t i) {
    return plan.tasks[i].step == step && results[i].state == state;
  }));
}

/// As the members of JSON are spelled.
std::string jsonName(TaskState state) {
  std::string name = toString(state);
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}

void addUnique(std::vector<std::string>& names, const std::string& name) {
  if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
}

}  // namespace

std::string overviewLine(const RunCounts& counts) {
  const std::size_t filled = counts.total ? kBarWidth * counts.settled() / counts.total : kBarWidth;
  std::string line = "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] " +
                     cli::grouped(counts.settled()) + " of " + cli::counted(counts.total, "task", "tasks");
  if (counts.failed + counts.skipped > 0) line += ", " + cli::grouped(counts.failed) + " failed";
  if (counts.done > 0 && counts.seconds > 0) {
    const double rate = kSecondsAMinute * static_cast<double>(counts.done) / counts.seconds;
    line += ", " + cli::shortNumber(std::round(10 * rate) / 10) + "/min";
  }
  if (counts.secondsLeft) line += ", " + cli::duration(*counts.secondsLeft) + " left";
  for (std::size_t i = 0; i < counts.running.size(); ++i) line += (i == 0 ? ": " : ", ") + counts.running[i];
  return line;
}

Json reportJson(const Plan& plan, const std::vector<std::size_t>& selection,
                const std::vector<TaskResult>& results) {
  Json counts = Json::object(), tasks = Json::array();
  for (const TaskState state : kStates) {
    std::size_t sum = 0;
    for (const Step step : kSteps) sum += count(plan, selection, results, step, state);
    counts[jsonName(state)] = sum;
  }
  for (const std::size_t i : selection) {
    const Task& task = plan.tasks[i];
    const TaskResult& result = results[i];
    Json outputs = Json::array();
    for (const fs::path& output : task.outputs) outputs.push_back(output.string());
    tasks.push_back({{"index", i},
                     {"step", toString(task.step)},
                     {"name", task.name},
                     {"state", jsonName(result.state)},
                     {"exit_code", result.exitCode},
                     {"error", result.error.empty() ? Json() : Json(result.error)},
                     {"attempts", result.attempts},
                     {"seconds", result.seconds},
                     {"cpu_seconds", result.cpuSeconds},
                     {"peak_memory_bytes", result.peakMemory},
                     {"log", task.log.string()},
                     {"outputs", outputs}});
  }
  return {{"folder", plan.folder.string()}, {"counts", counts}, {"tasks", tasks}};
}

std::string reportText(const Plan& plan, const std::vector<std::size_t>& selection,
                       const std::vector<TaskResult>& results) {
  std::vector<std::vector<std::string>> rows;
  for (const Step step : kSteps) {
    std::string states;
    for (const TaskState state : kStates) {
      const std::size_t tasks = count(plan, selection, results, step, state);
      if (tasks > 0) states += (states.empty() ? "" : ", ") + cli::grouped(tasks) + " " + toString(state);
    }
    if (!states.empty()) rows.push_back({toString(step), states});
  }
  std::string text = cli::table(rows, {}, "  ");
  for (const std::size_t i : selection) {
    if (results[i].state != TaskState::failed) continue;
    text += plan.tasks[i].label() + " failed: " + results[i].error +
            "\n  log: " + (plan.folder / plan.tasks[i].log).string() + "\n";
  }
  return text;
}

std::size_t countFailed(const std::vector<std::size_t>& selection, const std::vector<TaskResult>& results) {
  return static_cast<std::size_t>(std::count_if(selection.begin(), selection.end(), [&](std::size_t i) {
    return results[i].state == TaskState::failed || results[i].state == TaskState::skipped;
  }));
}

bool writeSheet(const fs::path& path, const Plan& plan, const std::vector<TaskResult>& results) {
  if (plan.pictures.empty())
    throw Error(Errc::usage, "there are no pictures to make a sheet of; add \"render\" to steps");
  ContactSheet sheet;
  for (const PlannedPicture& picture : plan.pictures) {
    addUnique(sheet.rows, picture.texture);
    addUnique(sheet.columns, picture.target);
  }
  sheet.cells.resize(sheet.rows.size() * sheet.columns.size());
  for (const PlannedPicture& picture : plan.pictures) {
    const auto row = std::find(sheet.rows.begin(), sheet.rows.end(), picture.texture) - sheet.rows.begin();
    const auto column =
        std::find(sheet.columns.begin(), sheet.columns.end(), picture.target) - sheet.columns.begin();
    SheetCell& cell =
        sheet.cells[static_cast<std::size_t>(row) * sheet.columns.size() + static_cast<std::size_t>(column)];
    const TaskResult& result = results[picture.task];
    const bool bad = result.state == TaskState::failed || result.state == TaskState::skipped;
    if (!bad && fs::exists(plan.folder / picture.path)) {
      cell.picture = plan.folder / picture.path;
    } else {
      cell.note = bad ? toString(result.state) : "not made yet";
    }
  }
  return writeContactSheet(path, sheet);
}

}  // namespace polestar::batch
