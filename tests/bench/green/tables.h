#pragma once
// Measured rows as tables in Markdown and as lines on a terminal.

#include <functional>
#include <string>
#include <vector>

#include "row.h"

namespace polestar::bench {

/// All methods on one exact shape.
std::string exactTable(const std::vector<Json>& results, const std::string& shape);

/// Our solver on the rows that `belongs` picks.
std::string modelTable(const std::vector<Json>& results, const std::function<bool(const Row&)>& belongs);

/// A result as one line for people.
std::string summaryLine(const Json& result);

}  // namespace polestar::bench
