#include "results.h"

#include <algorithm>
#include <fstream>
#include <set>
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

std::string machineText(const std::vector<Json>& results) {
  std::set<std::string> machines;
  for (const Json& r : results) {
    if (!r.contains("machine")) continue;
    const Json& m = r.at("machine");
    machines.insert("- " + m.at("cpu").get<std::string>() + ", " +
                    std::to_string(m.at("threads").get<int>()) + " threads" + "; polestar " +
                    m.at("version").get<std::string>() + ", compiled " + m.at("compiled").get<std::string>() +
                    " by " + m.at("compiler").get<std::string>() + "\n");
  }
  std::string result = "Measured on:\n\n";
  for (const std::string& machine : machines) result += machine;
  return result + "\n";
}

Results::Results(std::filesystem::path file, std::vector<std::string> keys)
    : file_(std::move(file)), keys_(std::move(keys)) {
  std::ifstream in(file_);
  for (std::string line; std::getline(in, line);) {
    try {
      results_.push_back(Json::parse(line));
      for (const std::string& key : keys_) results_.back().at(key);
    } catch (const Json::exception&) {
      throw std::runtime_error(file_.filename().string() + " does not hold rows of this benchmark");
    }
  }
}

bool Results::same(const Json& a, const Json& b) const {
  return std::all_of(keys_.begin(), keys_.end(),
                     [&](const std::string& key) { return a.at(key) == b.at(key); });
}

const Json* Results::find(const Json& like) const {
  const auto found =
      std::find_if(results_.begin(), results_.end(), [&](const Json& r) { return same(r, like); });
  return found == results_.end() ? nullptr : &*found;
}

void Results::put(Json result) {
  const auto found =
      std::find_if(results_.begin(), results_.end(), [&](const Json& r) { return same(r, result); });
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
