#pragma once
// How a long computation talks to its caller: progress, log lines, cancellation. The library itself never
// prints.

#include <atomic>
#include <functional>
#include <string>
#include <string_view>

namespace polestar {

enum class LogLevel { debug, info, warning };

/// Passed by reference through every stage that takes longer than a blink. Callbacks may come from any
/// thread, one at a time for `onLog`; `onProgress` is called by the thread that drives the stage. Both must
/// not throw.
class Context {
 public:
  /// Share of the current stage that is done, in [0, 1]; `stage` is a verb phrase such as "solving for G".
  std::function<void(std::string_view stage, double fraction)> onProgress;
  std::function<void(LogLevel, std::string_view message)> onLog;

  /// Asks the running computation to stop; safe from any thread and from a signal handler.
  void cancel() noexcept { cancelled_.store(true, std::memory_order_relaxed); }
  bool cancelled() const noexcept { return cancelled_.load(std::memory_order_relaxed); }
  /// @throws Error{Errc::cancelled} once cancel() was called.
  void throwIfCancelled() const;

  void progress(std::string_view stage, double fraction) const {
    if (onProgress) onProgress(stage, fraction);
  }
  void log(LogLevel level, std::string_view message) const {
    if (onLog) onLog(level, message);
  }

  /// A context that reports nothing; the default of every function that takes one.
  static Context& quiet();

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace polestar
