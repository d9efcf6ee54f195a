#pragma once
// Time and memory of one stretch of work in this process.

#include <chrono>
#include <cstddef>

namespace polestar::bench {

struct Cost {
  double wall = 0, cpu = 0;  ///< seconds; CPU time of all threads and of child processes that have ended
};

class Stopwatch {
 public:
  Stopwatch() { lap(); }
  /// What went by since the last lap.
  Cost lap();

 private:
  std::chrono::steady_clock::time_point wall_{};
  double cpu_ = 0;
};

/// Largest resident memory since it was made; that of child processes counts when it was larger, for they ran
/// while this one waited.
class PeakMemory {
 public:
  PeakMemory();
  std::size_t bytes() const;
};

}  // namespace polestar::bench
