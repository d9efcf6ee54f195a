#include "cli/outputs.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "polestar/core/error.h"

namespace polestar::cli {
namespace fs = std::filesystem;
namespace {

fs::file_time_type modificationTime(const fs::path& path) {
  std::error_code missing;
  const auto time = fs::last_write_time(path, missing);
  return missing ? fs::file_time_type::min() : time;
}

}  // namespace

bool isStandardStream(const fs::path& path) { return path == "-"; }

void checkOutput(const fs::path& path, bool overwrite, const std::vector<fs::path>& inputs) {
  if (isStandardStream(path)) return;
  const std::string name = path.string();
  std::error_code error;
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(folder, error)) {
    throw Error(Errc::io,
                "cannot write " + name + ": there is no folder " + folder.string() + "; make it first");
  }
  if (fs::is_directory(path, error))
    throw Error(Errc::io, "cannot write " + name + ": it is a folder; add a file name");
  if (access(folder.c_str(), W_OK | X_OK) != 0) {
    throw Error(Errc::io,
                "cannot write " + name + ": " + std::strerror(errno) + "; choose another folder with -o");
  }
  for (const fs::path& input : inputs) {
    if (fs::equivalent(path, input, error)) {
      throw Error(Errc::io, "the output " + name + " is the input itself; choose another name with -o");
    }
  }
  if (!overwrite && fs::exists(fs::symlink_status(path, error))) {
    throw Error(Errc::io,
                name + " exists already; choose another name with -o, or add --overwrite to replace it");
  }
}

OutputGuard::OutputGuard(const std::vector<fs::path>& files) {
  for (const fs::path& file : files) {
    if (!isStandardStream(file)) entries_.push_back({file, modificationTime(file)});
  }
}

OutputGuard::~OutputGuard() {
  if (kept_) return;
  for (const Entry& entry : entries_) {
    std::error_code ignored;
    if (modificationTime(entry.path) != entry.before) fs::remove(entry.path, ignored);
  }
}

}  // namespace polestar::cli
