#pragma once
// Whether a task has anything left to do. What it would write is asked, not a list of what was done: a result
// counts when it can be read, was made by the same command line and version, and is no older than what it
// was made from.

#include <optional>
#include <string>

#include "batch/plan.h"

namespace polestar::batch {

/// Why the task has to run; nothing when all its outputs are as it would make them. Reads the structure of
/// grids, all of maps (their hash) and pictures (their pixels): half a millisecond for a .vdb, about 20 for
/// a .pmap of 50 MB.
std::optional<std::string> whyStale(const Plan& plan, const Task& task);

}  // namespace polestar::batch
