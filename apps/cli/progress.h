#pragma once
// What a long computation shows on standard error: a bar with rate and time left on a terminal, a plain line
// every few seconds elsewhere (farm logs), and the log lines between them.

#include <chrono>
#include <mutex>
#include <ostream>
#include <string>
#include <string_view>

namespace polestar::cli {

/// The bar for a stage that has run for `seconds`, at most `width` columns.
std::string progressBar(std::string_view stage, double fraction, double seconds, int width);

/// The same facts without drawing: "solving for G: 42 %, 3.1 %/s, 12 s left".
std::string progressLine(std::string_view stage, double fraction, double seconds);

class ProgressMeter {
 public:
  enum class Style { none, lines, bar };

  /// Every line that is not the bar starts with `prefix`. `stream` outlives the meter.
  ProgressMeter(std::ostream& stream, Style style, std::string prefix);
  ~ProgressMeter() { clear(); }
  ProgressMeter(const ProgressMeter&) = delete;
  ProgressMeter& operator=(const ProgressMeter&) = delete;

  /// bar on a terminal, lines elsewhere.
  static Style styleForStandardError();

  void update(std::string_view stage, double fraction);
  /// A line in place of the bar, for what is more than one share of one stage; as often as the bar.
  void status(std::string_view line);
  /// A line of its own, whatever the bar shows.
  void message(std::string_view text);
  /// Takes the bar off the terminal.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  void clearLocked();
  bool dueLocked();

  std::ostream& stream_;
  const Style style_;
  const std::string prefix_;
  std::mutex mutex_;  // log lines come from any thread
  std::string stage_;
  Clock::time_point stageStart_, lastShown_;
  bool barVisible_ = false;
};

}  // namespace polestar::cli
