#include "results.h"

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <string>
#include <thread>

#include "polestar/core/atomic_file.h"
#include "polestar/core/version.h"

namespace polestar::bench {
namespace {

#ifdef __clang__
constexpr const char* kCompiler = __VERSION__;
#else
constexpr const char* kCompiler = "GCC " __VERSION__;
#endif

std::string field(const char* file, const std::string& name) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with(name)) continue;
    const std::size_t start = line.find_first_not_of(" \t", line.find(':') + 1);
    return start == std::string::npos ? "" : line.substr(start);
  }
  return "unknown";
}

}  // namespace

Json machineFacts() {
  return {{"cpu", field("/proc/cpuinfo", "model name")},
          {"threads", std::thread::hardware_concurrency()},
          {"version", kVersion},
          {"compiler", kCompiler},
          {"compiled", __DATE__}};
}

Results::Results(std::filesystem::path file) : file_(std::move(file)) {
  std::ifstream in(file_);
  for (std::string line; std::getline(in, line);) {
    try {
      results_.push_back(Json::parse(line));
      rowOf(results_.back());
    } catch (const Json::exception&) {
      throw std::runtime_error(file_.filename().string() + " does not hold rows of this benchmark");
    }
  }
}

const Json* Results::find(const Row& row) const {
  const auto found =
      std::find_if(results_.begin(), results_.end(), [&](const Json& r) { return rowOf(r) == row; });
  return found == results_.end() ? nullptr : &*found;
}

void Results::put(Json result) {
  const Row row = rowOf(result);
  const auto found =
      std::find_if(results_.begin(), results_.end(), [&](const Json& r) { return rowOf(r) == row; });
  if (found == results_.end()) {
    results_.push_back(std::move(result));
  } else {
    *found = std::move(result);
  }
  writeAtomically(file_, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary);
    for (const Json& r : results_) out << r.dump() << '\n';
  });
}

}  // namespace polestar::bench
