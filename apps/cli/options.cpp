#include "cli/options.h"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <string_view>
#include <thread>

#include "cli/text.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

constexpr int kMostThreads = 4096;

/// An option as a value is a forgotten value; empty when the name is good.
std::string whyNoFileName(const std::string& name) {
  if (name.empty()) return "the name is empty";
  if (name == "-" || name[0] != '-') return "";
  return name + " looks like an option; write ./" + name + " if it is a file";
}

}  // namespace

int defaultThreads() {
  const char* slurm = std::getenv("SLURM_CPUS_PER_TASK");
  const std::string_view text = slurm ? slurm : "";
  int threads = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), threads);
  if (error == std::errc() && end == text.data() + text.size() && threads > 0)
    return std::min(threads, kMostThreads);
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

void addCommonOptions(CLI::App& app, CommonOptions& options, const std::string& outputHelp) {
  constexpr const char* kGroup = "Common options";
  options.threads = defaultThreads();
  app.add_option("-o,--output", options.output, outputHelp)
      ->check(CLI::Validator(whyNoFileName, ""))
      ->type_name("FILE")
      ->group(kGroup);
  app.add_option("-j,--threads", options.threads,
                 "Threads to use; default $SLURM_CPUS_PER_TASK, else all cores")
      ->check(CLI::Range(1, kMostThreads).description(""))
      ->type_name("N")
      ->group(kGroup);
  CLI::Option* verbose =
      app.add_flag("-v,--verbose", options.verbosity, "Say more on standard error; -vv: everything")
          ->group(kGroup);
  app.add_flag("-q,--quiet", options.quiet, "Nothing but errors on standard error")
      ->excludes(verbose)
      ->group(kGroup);
  app.add_flag("--json", options.json, "One JSON object on standard output, nothing else there")
      ->group(kGroup);
  app.add_flag("--overwrite", options.overwrite, "Replace outputs that exist")->group(kGroup);
  app.add_flag("--dry-run", options.dryRun, "Say what would be done, and do not do it")->group(kGroup);
}

void addCenterOption(CLI::App& app, std::optional<Vec3>& center) {
  addPointOption(app, "--center", center,
                 "Use this center (mesh units) instead of searching; it is verified too");
}

void addDeviceOption(CLI::App& app, DeviceChoice& device) {
  const auto store = [&device](const std::string& text) {
    try {
      device = parseDeviceChoice(text);
    } catch (const Error& error) {
      throw CLI::ValidationError("--device", error.what());
    }
  };
  app.add_option_function<std::string>(
         "--device", store,
         "Where sums over all pairs run: cpu (default) or opencl, which takes the first GPU, else the first "
         "device; opencl:NAME one of polestar info --devices, by its number or a part of its name. Without "
         "a working device the CPU does it, and -v says why")
      ->type_name("DEVICE");
}

CLI::Option* addPointOption(CLI::App& app, const std::string& name, std::optional<Vec3>& value,
                            const std::string& help) {
  const auto store = [name, &value](const std::string& text) {
    try {
      value = parsePoint(text);
    } catch (const Error& error) {
      throw CLI::ValidationError(name, error.what());
    }
  };
  return app.add_option_function<std::string>(name, store, help)->type_name("x,y,z");
}

}  // namespace polestar::cli
