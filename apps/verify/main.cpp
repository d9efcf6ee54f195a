// polestar-verify: judges files of `polestar map` without a line of polestar's code. A .pmap by the theorem
// of judge_pmap.h, in exact arithmetic; a .vdb by judge_vdb.h, on its voxels.

#include <tbb/global_control.h>

#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <new>
#include <nlohmann/json.hpp>
#include <string_view>
#include <thread>

#include "judge_pmap.h"
#include "judge_vdb.h"
#include "pmap_file.h"
#include "vdb_file.h"

namespace polestar::verify {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kHelp =
    "Judges a file of polestar map, by code of its own: is it a map of the solid onto the ball?\n"
    "Usage: polestar-verify FILE [OPTIONS]\n\n"
    "  FILE               A .pmap (decided by exact arithmetic) or a .vdb (judged on its voxels)\n"
    "  -j,--threads N     Threads to use; default $SLURM_CPUS_PER_TASK, else all cores\n"
    "  -q,--quiet         Only the exit code, and the reason of a refusal on standard error\n"
    "  --json             One JSON object on standard output, nothing else there\n"
    "  -h,--help          This text\n"
    "  --version\n\n"
    "Exit codes: 0 it holds, 2 usage, 3 it cannot be read, 6 it is refused; the reason is on standard "
    "error.\n\n"
    "Example:\n  polestar-verify asteroid.pmap\n";

enum ExitCode { kHolds = 0, kInternal = 1, kUsage = 2, kUnreadable = 3, kRefused = 6 };

struct Options {
  std::string file;
  int threads = 0;
  bool json = false, quiet = false, help = false, version = false;
};

class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A positive number, else 0.
int positive(std::string_view text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() && number > 0 && number <= 4096 ? number
                                                                                                  : 0;
}

int defaultThreads() {
  const char* slurm = std::getenv("SLURM_CPUS_PER_TASK");
  const int asked = slurm ? positive(slurm) : 0;
  return asked > 0 ? asked : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

Options parse(const std::vector<std::string>& words) {
  Options options;
  options.threads = defaultThreads();
  bool onlyFiles = false;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const std::string& word = words[i];
    if (!onlyFiles && word == "--") {
      onlyFiles = true;
    } else if (onlyFiles || word.empty() || word[0] != '-') {
      if (!options.file.empty()) throw UsageError("one FILE at a time; " + word + " is a second one");
      options.file = word;
    } else if (word == "-j" || word == "--threads") {
      options.threads = i + 1 < words.size() ? positive(words[++i]) : 0;
      if (options.threads == 0) throw UsageError("--threads wants a number from 1 to 4096");
    } else if (word == "--json") {
      options.json = true;
    } else if (word == "-q" || word == "--quiet") {
      options.quiet = true;
    } else if (word == "-h" || word == "--help") {
      options.help = true;
    } else if (word == "--version") {
      options.version = true;
    } else {
      throw UsageError("there is no option " + word);
    }
  }
  if (options.file.empty() && !options.help && !options.version) throw UsageError("FILE is required");
  return options;
}

/// By content; what has neither signature is what its name says.
bool isPmap(const std::string& path) {
  char start[8] = {};
  std::ifstream(path, std::ios::binary).read(start, sizeof start);
  if (std::string_view(start, 8) == "POLESTAR") return true;
  return std::string_view(start, 4) != " BDV" && path.ends_with(".pmap");
}

/// One line. File names need not be UTF-8, JSON must be.
void print(const Json& json) {
  std::cout << json.dump(-1, ' ', false, Json::error_handler_t::replace) << std::endl;
}

int fail(Json& json, const Options& options, ExitCode code, const char* name, const std::string& message) {
  if (options.json) {
    json["error"] = {{"code", name}, {"message", message}};
    print(json);
  }
  std::cerr << "polestar-verify: " << message << std::endl;
  return code;
}

int judge(const Options& options, Json& json) {
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(options.threads));
  using Clock = std::chrono::steady_clock;
  const auto seconds = [](Clock::duration d) { return std::chrono::duration<double>(d).count(); };
  const auto start = Clock::now();
  Clock::time_point loaded;
  Report report;
  if (isPmap(options.file)) {
    const PmapContents map = readPmap(options.file);
    loaded = Clock::now();
    report = judgePmap(map);
  } else {
    const VoxelSolid solid = readVdb(options.file);
    loaded = Clock::now();
    report = judgeVdb(solid);
  }
  json.update(toJson(report));
  json["timings"] = {{"load", seconds(loaded - start)}, {"judge", seconds(Clock::now() - loaded)}};
  const Check* failure = report.firstFailure();
  if (!options.json && !options.quiet) {
    std::cout << options.file << (failure ? ": refused\n" : ": holds\n") << toText(report) << std::flush;
  }
  if (failure) {
    return fail(json, options, kRefused, "not_converged",
                options.file + " is refused: " + failure->name + ": " + failure->detail);
  }
  if (options.json) print(json);
  return std::cout ? kHolds : kUnreadable;
}

int run(const std::vector<std::string>& words) {
  Options options;
  options.json = std::find(words.begin(), words.end(), "--json") != words.end();
  Json json{{"schema", "polestar/1"},  {"version", POLESTAR_VERIFY_VERSION}, {"command", "verify"},
            {"inputs", Json::array()}, {"threads", defaultThreads()},        {"units", "mesh"}};
  try {
    options = parse(words);
    if (options.help) return std::cout << kHelp << std::flush ? kHolds : kUnreadable;
    if (options.version) {
      return std::cout << "polestar-verify " POLESTAR_VERIFY_VERSION << std::endl ? kHolds : kUnreadable;
    }
    json["inputs"].push_back(options.file);
    json["threads"] = options.threads;
    return judge(options, json);
  } catch (const UsageError& error) {
    return fail(json, options, kUsage, "usage", std::string(error.what()) + "; see polestar-verify --help");
  } catch (const Unreadable& error) {
    return fail(json, options, kUnreadable, "io", "cannot read " + options.file + ": " + error.what());
  } catch (const std::bad_alloc&) {
    return fail(json, options, kInternal, "internal", "not enough memory for " + options.file);
  } catch (const std::exception& error) {
    return fail(json, options, kInternal, "internal",
                std::string("internal error: ") + error.what() + "; please report it together with the file");
  }
}

}  // namespace
}  // namespace polestar::verify

int main(int argc, char** argv) { return polestar::verify::run({argv + 1, argv + argc}); }
