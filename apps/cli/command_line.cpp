#include "cli/command_line.h"

#include <algorithm>

namespace polestar::cli {
namespace {

bool isShortFlags(std::string_view word, std::string_view letters) {
  return word.size() >= 2 && word[0] == '-' && word.find_first_not_of(letters, 1) == std::string_view::npos;
}

bool isNumber(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

/// How many words, from `at` on, belong to an option that does not change results.
std::size_t wordsToLeaveOut(std::span<const std::string> words, std::size_t at) {
  const std::string_view word = words[at];
  if (word == "--json" || word == "--overwrite" || word == "--quiet" || word == "--verbose" ||
      isShortFlags(word, "qv") || word.starts_with("--threads=") ||
      (word.starts_with("-j") && isNumber(word.substr(2)))) {
    return 1;
  }
  return word == "-j" || word == "--threads" ? std::min<std::size_t>(2, words.size() - at) : 0;
}

}  // namespace

std::string shellQuoted(std::string_view word) {
  const bool plain = !word.empty() && word.find_first_not_of(
                                          "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                          "0123456789-_./,=:+%@") == std::string_view::npos;
  if (plain) return std::string(word);
  std::string quoted = "'";
  for (const char c : word) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string commandLine(std::span<const std::string> words) {
  std::string line = "polestar";
  for (std::size_t i = 0; i < words.size();) {
    if (const std::size_t skip = wordsToLeaveOut(words, i)) {
      i += skip;
      continue;
    }
    line += ' ' + shellQuoted(words[i++]);
  }
  return line;
}

}  // namespace polestar::cli
