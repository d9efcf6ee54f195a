#include "batch/open_job.h"

#include "batch/slurm.h"
#include "cli/command_line.h"
#include "cli/text.h"

namespace polestar::batch {
namespace {

constexpr std::size_t kLongestJobName = 64;  // characters, by the schema

/// The first characters of UTF-8 text, without those that the schema does not allow.
std::string jobName(const std::string& text) {
  std::string name;
  std::size_t characters = 0;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    const bool begins = (byte & 0xC0) != 0x80;
    if (byte < 0x20 || byte == 0x7F) continue;
    if (begins && characters++ == kLongestJobName) break;
    name += c;
  }
  return name.empty() ? "polestar" : name;
}

std::vector<std::size_t> ofStep(const Plan& plan, const std::vector<std::size_t>& tasks, Step step) {
  std::vector<std::size_t> result;
  for (const std::size_t task : tasks) {
    if (plan.tasks[task].step == step) result.push_back(task);
  }
  return result;
}

}  // namespace

Json openJobTemplate(const Plan& plan, const std::vector<std::size_t>& tasks, const std::string& name,
                     const std::filesystem::path& planFile) {
  Json steps = Json::array(), before = Json::array();
  for (const Step step : kSteps) {
    const std::vector<std::size_t> members = ofStep(plan, tasks, step);
    if (members.empty()) continue;
    const Json parameter{{"name", "Task"}, {"type", "INT"}, {"range", arrayRanges(members)}};
    const Json action{{"command", "{{Param.Polestar}}"},
                      {"args", {"batch", "{{Param.Plan}}", "--task", "{{Task.Param.Task}}"}}};
    Json entry;
    entry["name"] = toString(step);
    if (!before.empty()) entry["dependencies"] = before;
    entry["parameterSpace"]["taskParameterDefinitions"] = Json::array({parameter});
    entry["script"]["actions"]["onRun"] = action;
    steps.push_back(entry);
    Json dependency;
    dependency["dependsOn"] = toString(step);
    before.push_back(dependency);
  }
  const Json polestar{{"name", "Polestar"},
                      {"type", "STRING"},
                      {"description", "The program polestar, as the workers find it"},
                      {"default", "polestar"}};
  const Json file{{"name", "Plan"},
                  {"type", "STRING"},
                  {"description", "The plan that polestar batch wrote, in a folder that all workers share"},
                  {"default", planFile.string()}};
  return {{"specificationVersion", "jobtemplate-2023-09"},
          {"name", jobName(name)},
          {"parameterDefinitions", Json::array({polestar, file})},
          {"steps", steps}};
}

std::string commandLines(const Plan& plan, const std::vector<std::size_t>& tasks,
                         const std::filesystem::path& planFile) {
  std::string text;
  for (const Step step : kSteps) {
    const std::vector<std::size_t> members = ofStep(plan, tasks, step);
    if (members.empty()) continue;
    text += "# " + cli::counted(members.size(), "task", "tasks") + " of " + toString(step) +
            (text.empty() ? "\n" : ", after all of the above\n");
    for (const std::size_t task : members) {
      const std::vector<std::string> words{"batch", planFile.string(), "--task", std::to_string(task)};
      text += cli::commandLine(words) + "\n";
    }
  }
  return text;
}

}  // namespace polestar::batch
