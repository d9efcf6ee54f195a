#pragma once
// Processes of a batch: a fork of this program for every task, and other programs such as sbatch.

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace polestar::batch {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor();
  Descriptor(Descriptor&& other) noexcept : number_(other.number_) { other.number_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept;
  int number() const { return number_; }
  explicit operator bool() const { return number_ >= 0; }

 private:
  int number_ = -1;
};

/// How a process ended and what it took.
struct ChildEnd {
  int exitCode = -1;  ///< -1 where a signal ended it
  int signal = 0;
  double cpuSeconds = 0;
  long peakMemory = 0;  ///< bytes
  std::string out;      ///< standard output
};

/// A fork of this process that runs `body` and ends with its exit code: what was loaded and set up is there
/// at once, and a crash is the child's alone. It has /dev/null as standard input, a file in memory as
/// standard output and `error` as standard error; it ends with its parent (SIGTERM).
///
/// The calling process must have one thread, because locks that others hold would stay locked in the child.
class Child {
 public:
  Child(const Descriptor& error, const std::function<int()>& body);  ///< @throws Error{Errc::io}
  Child(Child&&) = default;
  Child& operator=(Child&&) = default;

  /// Readable once the process has ended.
  int waitable() const { return handle_.number(); }
  /// Waits. Once.
  ChildEnd finish();
  void signal(int number) const;

 private:
  pid_t process_ = -1;
  Descriptor handle_, out_;
};

struct ProgramEnd {
  int exitCode = -1;  ///< 127 when there is no such program
  std::string out, err;
};

/// Runs another program, looked for in $PATH, and waits for its end; no shell in between.
ProgramEnd runProgram(const std::vector<std::string>& words);

/// The lock of a task: a log file, opened without touching what it holds, and locked. The lock lasts as long
/// as any process has the file open through this descriptor, a child's standard error included; nothing where
/// another process holds it.
/// @throws Error{Errc::io} when the file cannot be made.
Descriptor openLocked(const std::filesystem::path& log);

}  // namespace polestar::batch
