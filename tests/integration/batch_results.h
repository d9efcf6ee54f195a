#pragma once
// What a batch leaves, for comparison.

#include <filesystem>
#include <map>
#include <string>

#include "../cli/run_tool.h"

namespace polestar::testing {

/// Names, from `output` on, and contents of all results of a batch; not its logs, which tell of times.
inline std::map<std::string, std::string> batchResults(const std::filesystem::path& output) {
  std::map<std::string, std::string> files;
  for (const char* part : {"maps", "solids", "pictures"}) {
    for (const auto& entry : std::filesystem::recursive_directory_iterator(output / part)) {
      if (entry.is_regular_file())
        files[std::filesystem::relative(entry.path(), output).string()] = readFile(entry.path());
    }
  }
  return files;
}

}  // namespace polestar::testing
