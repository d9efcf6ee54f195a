#pragma once
// What came of a batch: for people, for scripts, and as a picture.

#include <filesystem>
#include <string>
#include <vector>

#include "batch/local_run.h"
#include "batch/plan.h"

namespace polestar::batch {

/// "[####......] 13 of 42 tasks, 1 failed, 3.1/min, 4:10 left: render kiwi/head, map bennu"
std::string overviewLine(const RunCounts& counts);

/// Of the tasks of `selection`: counts of each state, and an object for each with its state, exit code,
/// error, log and times.
Json reportJson(const Plan& plan, const std::vector<std::size_t>& selection,
                const std::vector<TaskResult>& results);

/// A row a step, then the failed ones, each with its error and its log.
std::string reportText(const Plan& plan, const std::vector<std::size_t>& selection,
                       const std::vector<TaskResult>& results);

/// How many of `selection` failed or were skipped.
std::size_t countFailed(const std::vector<std::size_t>& selection, const std::vector<TaskResult>& results);

/// The plan's pictures as a sheet, textures down and targets across; a picture that is not there is replaced
/// by what became of it. @returns whether there was a font for names.
/// @throws Error{Errc::usage} for a plan without pictures; what writeContactSheet throws.
bool writeSheet(const std::filesystem::path& path, const Plan& plan, const std::vector<TaskResult>& results);

}  // namespace polestar::batch
