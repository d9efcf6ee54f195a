#include "polestar/mesh/detail/text_lines.h"

#include <charconv>
#include <cmath>
#include <cstring>

namespace polestar::detail {

TextLines::TextLines(const MeshSource& source, Syntax syntax, std::size_t offset, std::size_t linesBefore)
    : source_(&source), syntax_(syntax), line_(linesBefore) {
  next_ = source.bytes.data() + offset;
  end_ = source.bytes.data() + source.bytes.size();
  at_ = lineEnd_ = next_;
  if (next_ != end_ && !std::memchr(next_, '\n', end_ - next_)) newline_ = '\r';
  linesJoined_ = 1;
}

bool TextLines::nextLine() {
  if (next_ == end_) return false;
  line_ += linesJoined_;
  linesJoined_ = 0;
  at_ = next_;
  for (;;) {
    const void* found = next_ == end_ ? nullptr : std::memchr(next_, newline_, end_ - next_);
    lineEnd_ = found ? static_cast<const char*>(found) : end_;
    next_ = found ? lineEnd_ + 1 : end_;
    ++linesJoined_;
    if (!syntax_.continuation || next_ == end_) break;
    const char* last = lineEnd_;
    while (last != at_ && last[-1] == '\r') --last;
    if (last == at_ || last[-1] != '\\') break;
  }
  if (syntax_.comment && at_ != lineEnd_) {
    if (const void* comment = std::memchr(at_, syntax_.comment, lineEnd_ - at_)) {
      lineEnd_ = static_cast<const char*>(comment);
    }
  }
  return true;
}

bool TextLines::nextFullLine() {
  while (nextLine()) {
    if (!atLineEnd()) return true;
  }
  return false;
}

bool TextLines::atLineEnd() {
  skipBlanks();
  return at_ == lineEnd_;
}

std::string_view TextLines::word() {
  skipBlanks();
  const char* begin = at_;
  at_ = wordEnd();
  return {begin, static_cast<std::size_t>(at_ - begin)};
}

double TextLines::number(const Item& item) {
  skipBlanks();
  const char* begin = at_ != lineEnd_ && *at_ == '+' ? at_ + 1 : at_;
  double value = 0;
  const auto [stop, error] = std::from_chars(begin, lineEnd_, value);
  if (error == std::errc::invalid_argument || (stop != lineEnd_ && !isBlank(*stop)))
    failNumber(item, "a number");
  if (error == std::errc::result_out_of_range) value = outOfRange(item);
  if (!std::isfinite(value)) failNumber(item, "a finite number");
  at_ = stop;
  return value;
}

double TextLines::outOfRange(const Item& item) const {
  // from_chars does not tell 1e-999, which is zero for all purposes, from 1e999, which is an error.
  const std::string_view text(at_, static_cast<std::size_t>(wordEnd() - at_));
  const std::size_t exponent = text.find_first_of("eE");
  const bool small = exponent == text.npos ? text.find('.') <= 2 : text.substr(exponent + 1).starts_with('-');
  if (!small) failNumber(item, "a number that a double can hold");
  return 0;
}

std::int64_t TextLines::integer(const Item& item, bool slash) {
  skipBlanks();
  const char* begin = at_ != lineEnd_ && *at_ == '+' ? at_ + 1 : at_;
  std::int64_t value = 0;
  const auto [stop, error] = std::from_chars(begin, lineEnd_, value);
  const bool ends = stop == lineEnd_ || isBlank(*stop) || (slash && *stop == '/');
  if (error != std::errc() || !ends) failNumber(item, "a whole number of this program's range");
  at_ = stop;
  if (slash) at_ = wordEnd();
  return value;
}

void TextLines::failNumber(const Item& item, const char* kind) const {
  const std::string name = std::string(item.kind) + " " + std::to_string(item.number);
  if (at_ == lineEnd_)
    fail(name + ": the line ends where " + kind + " is due; the file is damaged, export it again");
  const std::string_view text(at_, static_cast<std::size_t>(wordEnd() - at_));
  fail(name + ": " + excerpt(text) + " is not " + kind + "; mend the line or export the file again");
}

}  // namespace polestar::detail
