#include "polestar/core/atomic_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "polestar/core/error.h"

namespace polestar {
namespace {

[[noreturn]] void throwSystemError(const std::string& what, const std::filesystem::path& path) {
  throw Error(Errc::io, what + " " + path.string() + ": " + std::strerror(errno));
}

void sync(const std::filesystem::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags);
  if (descriptor < 0) throwSystemError("cannot open", path);
  const int failed = ::fsync(descriptor);
  const int reason = errno;
  ::close(descriptor);
  errno = reason;
  // Some filesystems refuse to sync a folder (EINVAL); the rename is then as durable as they make it.
  if (failed && errno != EINVAL) throwSystemError("cannot sync", path);
}

}  // namespace

void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write) {
  namespace fs = std::filesystem;
  static std::atomic<unsigned> counter{0};
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    throw Error(Errc::io,
                "cannot write " + path.string() + ": the folder " + folder.string() + " does not exist");
  }
  // Same folder, so that the rename stays within one filesystem; hidden, and unlike any sequence pattern.
  const fs::path temporary = folder / ("." + path.filename().string() + "." + std::to_string(::getpid()) +
                                       "-" + std::to_string(counter++) + ".part");
  try {
    write(temporary);
    sync(temporary, O_RDONLY);
    if (std::rename(temporary.c_str(), path.c_str()) != 0) throwSystemError("cannot write", path);
    sync(folder, O_RDONLY | O_DIRECTORY);
  } catch (...) {
    fs::remove(temporary, ignored);
    throw;
  }
}

}  // namespace polestar
