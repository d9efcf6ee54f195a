#include "batch/child.h"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

// Some versions of glibc declare it as a function of C++ (glibc bug 29650).
extern "C" {
#include <sys/pidfd.h>
}

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iostream>
#include <utility>

#include "polestar/core/error.h"

namespace polestar::batch {
namespace {

[[noreturn]] void fail(const std::string& what) { throw Error(Errc::io, what + ": " + std::strerror(errno)); }

Descriptor memoryFile() {
  Descriptor file(memfd_create("polestar-output", MFD_CLOEXEC));
  if (!file) fail("cannot keep a task's output");
  return file;
}

std::string contentOf(const Descriptor& file) {
  std::string content;
  char block[4096];
  for (ssize_t size = 0;
       (size = pread(file.number(), block, sizeof block, static_cast<off_t>(content.size()))) > 0;)
    content.append(block, static_cast<std::size_t>(size));
  return content;
}

/// The child's side of a fork; does not return.
[[noreturn]] void runChild(pid_t parent, int error, int out, const std::function<int()>& body) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  // The parent may have ended before this was asked for.
  if (getppid() != parent) _exit(128 + SIGTERM);
  for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
    // What nohup or a shell's background job ignores stays ignored.
    struct sigaction current {};
    if (sigaction(number, nullptr, &current) == 0 && current.sa_handler != SIG_IGN)
      std::signal(number, SIG_DFL);
  }
  const int in = open("/dev/null", O_RDONLY);
  int code = 1;
  if (in >= 0 && dup2(in, STDIN_FILENO) >= 0 && dup2(out, STDOUT_FILENO) >= 0 &&
      dup2(error, STDERR_FILENO) >= 0) {
    try {
      code = body();
    } catch (const std::exception& failure) {
      std::cerr << "polestar batch: " << failure.what() << std::endl;
    }
  }
  std::cout.flush();
  std::fflush(stdout);
  // What the parent set up is the parent's to take down.
  _exit(code);
}

}  // namespace

Descriptor::~Descriptor() {
  if (number_ >= 0) close(number_);
}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(number_, other.number_);
  return *this;
}

Child::Child(const Descriptor& error, const std::function<int()>& body) : out_(memoryFile()) {
  std::cout.flush();
  std::fflush(stdout);
  const pid_t parent = getpid();
  process_ = fork();
  if (process_ < 0) fail("cannot start a process");
  if (process_ == 0) runChild(parent, error.number(), out_.number(), body);
  handle_ = Descriptor(pidfd_open(process_, 0));
  if (!handle_) fail("cannot watch a process");
}

ChildEnd Child::finish() {
  int status = 0;
  rusage usage{};
  while (wait4(process_, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  ChildEnd end;
  if (WIFSIGNALED(status)) {
    end.signal = WTERMSIG(status);
  } else {
    end.exitCode = WEXITSTATUS(status);
  }
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  end.cpuSeconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  end.peakMemory = usage.ru_maxrss * 1024;
  end.out = contentOf(out_);
  return end;
}

void Child::signal(int number) const { kill(process_, number); }

ProgramEnd runProgram(const std::vector<std::string>& words) {
  const Descriptor out = memoryFile(), err = memoryFile();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_adddup2(&actions, out.number(), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, err.number(), STDERR_FILENO);
  std::vector<std::string> copies = words;
  std::vector<char*> arguments;
  for (std::string& word : copies) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t process = -1;
  const int failed = posix_spawnp(&process, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed) return {127, "", words[0] + ": " + std::strerror(failed)};
  int status = 0;
  while (waitpid(process, &status, 0) < 0 && errno == EINTR) {
  }
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), contentOf(out), contentOf(err)};
}

Descriptor openLocked(const std::filesystem::path& log) {
  Descriptor file(open(log.c_str(), O_RDWR | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (!file) fail("cannot write " + log.string());
  if (flock(file.number(), LOCK_EX | LOCK_NB) == 0) return file;
  if (errno != EWOULDBLOCK) fail("cannot lock " + log.string());
  return {};
}

}  // namespace polestar::batch
