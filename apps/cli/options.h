#pragma once
// Options that every subcommand shares, and the forms that their values take.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <optional>
#include <string>

#include "polestar/core/compute_device.h"
#include "polestar/core/types.h"

namespace polestar::cli {

struct CommonOptions {
  std::filesystem::path output;  ///< empty: standard output, or nothing, as the command says
  int threads = 0;               ///< resolved: at least 1
  int verbosity = 0;             ///< 0: warnings, 1: what is done, 2: everything
  bool quiet = false;            ///< nothing but errors on standard error
  bool json = false;
  bool overwrite = false;
  bool dryRun = false;
};

/// Adds -o, -j, -v, -q, --json, --overwrite and --dry-run. `options` outlives the parsing.
void addCommonOptions(CLI::App& app, CommonOptions& options, const std::string& outputHelp);

/// Adds --center x,y,z.
void addCenterOption(CLI::App& app, std::optional<Vec3>& center);

/// Adds --device cpu|opencl[:NAME].
void addDeviceOption(CLI::App& app, DeviceChoice& device);

/// Adds an option whose value is a point or vector "x,y,z".
CLI::Option* addPointOption(CLI::App& app, const std::string& name, std::optional<Vec3>& value,
                            const std::string& help);

/// $SLURM_CPUS_PER_TASK where it is a positive number, else the cores that this process may use.
int defaultThreads();

}  // namespace polestar::cli
