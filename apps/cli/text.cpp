#include "cli/text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

template <class... Values>
std::string printed(const char* format, Values... values) {
  std::array<char, 64> buffer;
  const int length = std::snprintf(buffer.data(), buffer.size(), format, values...);
  return {buffer.data(), static_cast<std::size_t>(length)};
}

constexpr std::string_view kSeparators = " \t\r,";

}  // namespace

std::string grouped(std::uint64_t count) {
  std::string digits = std::to_string(count);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, ",");
  return digits;
}

std::string counted(std::uint64_t count, std::string_view one, std::string_view many) {
  return grouped(count) + " " + std::string(count == 1 ? one : many);
}

std::string shortNumber(double value) { return printed("%.6g", value); }

std::string exactNumber(double value) {
  std::array<char, 32> buffer;
  const auto [end, error] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value);
  return {buffer.data(), end};
}

std::string shortPoint(const Vec3& point) {
  return shortNumber(point.x()) + " " + shortNumber(point.y()) + " " + shortNumber(point.z());
}

std::string byteSize(std::uint64_t bytes) {
  if (bytes < 1000) return std::to_string(bytes) + " B";
  double value = static_cast<double>(bytes);
  std::string_view unit;
  for (const std::string_view next : {"kB", "MB", "GB", "TB"}) {
    unit = next;
    value /= 1000;
    if (value < 999.5) break;
  }
  return printed(value < 10 ? "%.1f " : "%.0f ", value) + std::string(unit);
}

std::string duration(double seconds) {
  if (seconds < 9.95) return printed("%.1f s", seconds);
  const auto whole = std::llround(seconds);
  if (whole < 60) return printed("%lld s", whole);
  if (whole < 3600) return printed("%lld:%02lld", whole / 60, whole % 60);
  return printed("%lld:%02lld:%02lld", whole / 3600, whole / 60 % 60, whole % 60);
}

std::string table(const std::vector<std::vector<std::string>>& rows, const std::vector<std::size_t>& right,
                  std::string_view indent) {
  std::vector<std::size_t> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string text;
  for (const auto& row : rows) {
    std::string line(indent);
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (c > 0) line += "  ";
      const std::string blanks(widths[c] - row[c].size(), ' ');
      const bool flushRight = std::find(right.begin(), right.end(), c) != right.end();
      line += flushRight ? blanks + row[c] : row[c] + blanks;
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + "\n";
  }
  return text;
}

std::vector<double> parseNumbers(std::string_view text) {
  std::vector<double> numbers;
  std::string_view rest = text;
  while (true) {
    rest.remove_prefix(std::min(rest.find_first_not_of(kSeparators), rest.size()));
    if (rest.empty()) return numbers;
    // from_chars knows no leading plus.
    if (rest.size() > 1 && rest[0] == '+' && rest[1] != '-') rest.remove_prefix(1);
    double number = 0;
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    const bool ended = rest.empty() || kSeparators.find(rest[0]) != std::string_view::npos;
    if (error != std::errc() || !std::isfinite(number) || !ended) {
      throw Error(Errc::usage,
                  "expected finite numbers such as 0.5,-1,2e-3, found \"" + std::string(text) + "\"");
    }
    numbers.push_back(number);
  }
}

Vec3 parsePoint(std::string_view text) {
  const std::vector<double> numbers = parseNumbers(text);
  if (numbers.size() != 3) {
    throw Error(Errc::usage,
                "expected three numbers such as 0.5,-1,2e-3, found \"" + std::string(text) + "\"");
  }
  return {numbers[0], numbers[1], numbers[2]};
}

}  // namespace polestar::cli
