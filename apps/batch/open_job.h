#pragma once
// A plan for any farm: as a template of the Open Job Description, and as lines of a shell.

#include <filesystem>
#include <string>
#include <vector>

#include "batch/plan.h"

namespace polestar::batch {

/// A job template "jobtemplate-2023-09": a step of the template for each step of the plan that has tasks,
/// with a parameter Task that runs through their numbers, and dependencies between the steps. `name` is cut
/// to what the schema allows. The program and the plan are parameters, so that a farm can have them
/// elsewhere.
Json openJobTemplate(const Plan& plan, const std::vector<std::size_t>& tasks, const std::string& name,
                     const std::filesystem::path& planFile);

/// One command a line, quoted for a shell; lines that start with # stand between steps.
std::string commandLines(const Plan& plan, const std::vector<std::size_t>& tasks,
                         const std::filesystem::path& planFile);

}  // namespace polestar::batch
