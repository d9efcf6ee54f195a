#include "cli/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "cli/text.h"

namespace polestar::cli {
namespace {

constexpr std::chrono::milliseconds kBarInterval{100};
constexpr std::chrono::seconds kLineInterval{5};
constexpr int kDefaultWidth = 80;
constexpr int kLongestBar = 30;
// Extrapolating from less than this share would show wild numbers.
constexpr double kEnoughToExtrapolate = 0.01;

int terminalWidth() {
  winsize size{};
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return kDefaultWidth;
  return size.ws_col;
}

/// The first characters of UTF-8 text.
std::string_view cutToWidth(std::string_view text, int width) {
  int characters = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins = (static_cast<unsigned char>(text[i]) & 0xC0) != 0x80;
    if (begins && characters++ == std::max(0, width)) return text.substr(0, i);
  }
  return text;
}

std::string percent(double value) { return shortNumber(std::round(value * 10) / 10) + " %"; }

std::string rateAndTimeLeft(double fraction, double seconds) {
  if (fraction < kEnoughToExtrapolate || seconds <= 0) return "";
  return percent(100 * fraction / seconds) + "/s, " + duration(seconds * (1 - fraction) / fraction) + " left";
}

}  // namespace

std::string progressBar(std::string_view stage, double fraction, double seconds, int width) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  char share[8];
  std::snprintf(share, sizeof share, "%3.0f %%", 100 * fraction);
  const std::string head = std::string(stage) + "  " + share;
  const std::string tail = rateAndTimeLeft(fraction, seconds);
  // The last column stays free: writing there makes some terminals wrap.
  const int room = std::min(width - 1 - static_cast<int>(head.size() + tail.size()) - 6, kLongestBar);
  std::string line = head;
  if (room >= 5) {
    const auto done = static_cast<std::size_t>(fraction * room);
    line += "  [" + std::string(done, '#') + std::string(static_cast<std::size_t>(room) - done, '.') + "]";
  }
  if (!tail.empty()) line += "  " + tail;
  return line.substr(0, static_cast<std::size_t>(std::max(0, width - 1)));
}

std::string progressLine(std::string_view stage, double fraction, double seconds) {
  fraction = std::clamp(fraction, 0.0, 1.0);
  std::string line = std::string(stage) + ": " + shortNumber(std::floor(100 * fraction)) + " %";
  const std::string tail = rateAndTimeLeft(fraction, seconds);
  return tail.empty() ? line : line + ", " + tail;
}

ProgressMeter::ProgressMeter(std::ostream& stream, Style style, std::string prefix)
    : stream_(stream), style_(style), prefix_(std::move(prefix)) {}

ProgressMeter::Style ProgressMeter::styleForStandardError() {
  return isatty(STDERR_FILENO) ? Style::bar : Style::lines;
}

void ProgressMeter::update(std::string_view stage, double fraction) {
  if (style_ == Style::none) return;
  const std::lock_guard lock(mutex_);
  if (stage != stage_) {
    stage_ = stage;
    stageStart_ = lastShown_ = Clock::now();
  }
  if (!dueLocked()) return;
  const double seconds = std::chrono::duration<double>(Clock::now() - stageStart_).count();
  if (style_ == Style::bar) {
    stream_ << "\r\033[K" << progressBar(stage, fraction, seconds, terminalWidth()) << std::flush;
    barVisible_ = true;
  } else {
    stream_ << prefix_ << progressLine(stage, fraction, seconds) << std::endl;
  }
}

void ProgressMeter::status(std::string_view line) {
  if (style_ == Style::none) return;
  const std::lock_guard lock(mutex_);
  if (!dueLocked()) return;
  if (style_ == Style::bar) {
    stream_ << "\r\033[K" << cutToWidth(line, terminalWidth() - 1) << std::flush;
    barVisible_ = true;
  } else {
    stream_ << prefix_ << line << std::endl;
  }
}

bool ProgressMeter::dueLocked() {
  const auto now = Clock::now();
  const auto interval = style_ == Style::bar ? Clock::duration(kBarInterval) : Clock::duration(kLineInterval);
  if (now - lastShown_ < interval) return false;
  lastShown_ = now;
  return true;
}

void ProgressMeter::message(std::string_view text) {
  const std::lock_guard lock(mutex_);
  clearLocked();
  stream_ << prefix_ << text << std::endl;
}

void ProgressMeter::clear() {
  const std::lock_guard lock(mutex_);
  clearLocked();
}

void ProgressMeter::clearLocked() {
  if (!barVisible_) return;
  stream_ << "\r\033[K" << std::flush;
  barVisible_ = false;
}

}  // namespace polestar::cli
