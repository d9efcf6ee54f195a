#include "run_apart.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <stdexcept>
#include <string>

namespace polestar::bench {
namespace {

void writeAll(int end, const std::string& text) {
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = write(end, text.data() + done, text.size() - done);
    if (count < 0 && errno != EINTR) return;
    if (count > 0) done += static_cast<std::size_t>(count);
  }
}

std::string readAll(int end) {
  std::string text;
  char buffer[4096];
  for (;;) {
    const ssize_t count = read(end, buffer, sizeof buffer);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return text;
    text.append(buffer, static_cast<std::size_t>(count));
  }
}

Json failed(const std::string& reason) { return {{"status", "failed: " + reason}}; }

/// Never returns into the parent's code: its buffers and destructors are the parent's.
[[noreturn]] void actAsChild(const std::function<Json()>& work, int end) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);  // whoever stops the benchmark stops the measurement
  Json result;
  try {
    result = work();
  } catch (const std::exception& error) {
    result = failed(error.what());
  }
  writeAll(end, result.dump());
  _exit(0);
}

}  // namespace

Json runApart(const std::function<Json()>& work) {
  int ends[2];
  std::fflush(nullptr);
  if (pipe(ends) != 0) throw std::runtime_error(std::string("no pipe: ") + std::strerror(errno));
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error(std::string("no child process: ") + std::strerror(errno));
  if (child == 0) {
    close(ends[0]);
    actAsChild(work, ends[1]);
  }
  close(ends[1]);
  const std::string text = readAll(ends[0]);
  close(ends[0]);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status)) return failed(strsignal(WTERMSIG(status)));
  return Json::parse(text);
}

}  // namespace polestar::bench
