#include "batch/task_state.h"

#include <algorithm>

#include "cli/command_line.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/io/frame_path.h"
#include "polestar/io/picture.h"
#include "polestar/map/map_file.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::batch {
namespace {

namespace fs = std::filesystem;

/// What a result says of its making.
struct Provenance {
  std::string arguments, version;
};

std::string valueOf(const std::vector<std::pair<std::string, std::string>>& entries, const std::string& key) {
  for (const auto& [name, value] : entries) {
    if (name == key) return value;
  }
  return "";
}

Provenance provenanceOf(const fs::path& path) {
  if (path.extension() == ".pmap") {
    const MapFileInfo info = readMapFileInfo(path);
    const Json header = Json::parse(info.headerJson);
    return {header.value("arguments", ""), info.version};
  }
  if (path.extension() == ".vdb") {
    const auto metadata = readGridHeaders(path).front().metadata;
    return {valueOf(metadata, "polestar:arguments"), valueOf(metadata, "polestar:version")};
  }
  const PictureText text = readPictureText(path);
  const std::string software = valueOf(text, "Software"), ours = "polestar ";
  return {valueOf(text, "polestar:arguments"),
          software.starts_with(ours) ? software.substr(ours.size()) : ""};
}

std::optional<fs::file_time_type> timeOf(const fs::path& path) {
  std::error_code missing;
  const auto time = fs::last_write_time(path, missing);
  if (missing) return std::nullopt;
  return time;
}

/// A pattern's newest file, or the file.
std::optional<fs::file_time_type> newestOf(const fs::path& path) {
  const FramePath pattern(path);
  if (!pattern.numbered()) return timeOf(path);
  std::optional<fs::file_time_type> newest;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(pattern.before()) || !name.ends_with(pattern.after())) continue;
    newest = std::max(newest, timeOf(entry.path()));
  }
  return newest;
}

std::optional<std::string> whyUnfit(const fs::path& output, const std::string& shown,
                                    const std::string& arguments) {
  try {
    const Provenance provenance = provenanceOf(output);
    if (provenance.arguments != arguments) return shown + " was made by another command line";
    if (provenance.version != kVersion) return shown + " was made by another version of polestar";
  } catch (const std::exception& error) {
    return shown + " cannot be used: " + error.what();
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> whyStale(const Plan& plan, const Task& task) {
  std::optional<fs::file_time_type> oldest;
  for (const fs::path& output : task.outputs) {
    const auto time = timeOf(plan.folder / output);
    if (!time) return output.string() + " is not there";
    oldest = oldest ? std::min(*oldest, *time) : *time;
  }
  for (const fs::path& input : task.inputs) {
    const auto time = newestOf(plan.folder / input);
    if (!time) return input.string() + " is not there";
    if (*time > *oldest) return input.string() + " is newer than " + task.outputs.front().string();
  }
  const std::string arguments = cli::commandLine(task.arguments);
  for (const fs::path& output : task.outputs) {
    if (auto why = whyUnfit(plan.folder / output, output.string(), arguments)) return why;
  }
  return std::nullopt;
}

}  // namespace polestar::batch
