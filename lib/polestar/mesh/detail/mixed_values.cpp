#include "polestar/mesh/detail/mixed_values.h"

#include <algorithm>
#include <charconv>
#include <string>
#include <utility>

namespace polestar::detail {
namespace {

std::string nameOf(const Item& item) { return std::string(item.kind) + " " + std::to_string(item.number); }

}  // namespace

std::size_t rawBytes(RawType type) {
  constexpr std::array<std::size_t, 10> kBytes{1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kBytes[static_cast<std::size_t>(type)];
}

bool isWhole(RawType type) { return type != RawType::float32 && type != RawType::float64; }

std::int64_t rawInteger(const char* at, RawType type, bool bigEndian) {
  switch (type) {
    case RawType::int8:
      return static_cast<signed char>(*at);
    case RawType::uint8:
      return static_cast<unsigned char>(*at);
    case RawType::int16:
      return fromBytes<std::int16_t>(at, bigEndian);
    case RawType::uint16:
      return fromBytes<std::uint16_t>(at, bigEndian);
    case RawType::int32:
      return fromBytes<std::int32_t>(at, bigEndian);
    case RawType::uint32:
      return fromBytes<std::uint32_t>(at, bigEndian);
    default:
      // A uint64 beyond the signed range turns negative, which no reader takes for a count or an index.
      return fromBytes<std::int64_t>(at, bigEndian);
  }
}

double rawValue(const char* at, RawType type, bool bigEndian) {
  if (type == RawType::float32) return fromBytes<float>(at, bigEndian);
  if (type == RawType::float64) return fromBytes<double>(at, bigEndian);
  if (type == RawType::uint64) return static_cast<double>(fromBytes<std::uint64_t>(at, bigEndian));
  return static_cast<double>(rawInteger(at, type, bigEndian));
}

bool MixedValues::toWord() {
  if (inRaw_) endRaw();
  if (!started_) {
    started_ = true;
    if (!lines_.nextFullLine()) return false;
  }
  while (lines_.atLineEnd()) {
    if (!lines_.nextFullLine()) return false;
  }
  return true;
}

void MixedValues::endRaw() {
  // Raw values count as no lines.
  lines_ = TextLines(source_, syntax_, rawAt_, lines_.line() + std::exchange(linesInRaw_, 0));
  inRaw_ = false;
  started_ = false;
}

bool MixedValues::nextLine() {
  if (inRaw_) endRaw();
  started_ = true;
  return lines_.nextLine();
}

std::string_view MixedValues::word() { return toWord() ? lines_.word() : std::string_view(); }

std::string_view MixedValues::peek() {
  if (!toWord()) return {};
  TextLines ahead = lines_;
  return ahead.word();
}

std::string_view MixedValues::restOfLine() {
  std::string_view rest = lines_.rest();
  lines_.skipLine();
  constexpr std::string_view kBlanks = " \t\r";
  rest.remove_prefix(std::min(rest.find_first_not_of(kBlanks), rest.size()));
  return rest.substr(0, rest.find_last_not_of(kBlanks) + 1);
}

double MixedValues::number(const Item& item) {
  if (!toWord()) failTruncated(item);
  return lines_.number(item);
}

double MixedValues::value(const Item& item) {
  if (!toWord()) failTruncated(item);
  const std::string_view text = peek();
  double value = 0;
  const auto [stop, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc() && stop == text.data() + text.size()) {
    lines_.word();
    return value;
  }
  return lines_.number(item);  // a leading plus, or the message
}

std::int64_t MixedValues::integer(const Item& item) {
  if (!toWord()) failTruncated(item);
  return lines_.integer(item);
}

std::int64_t MixedValues::count(const char* what) {
  const std::int64_t count = integer({what, 1});
  if (count < 0) fail(std::string(what) + ": " + std::to_string(count) + "; the file is damaged");
  return count;
}

bool MixedValues::skipPast(std::string_view text) {
  const std::size_t begin = inRaw_ ? rawAt_ : lines_.nextOffset();
  const std::size_t found = std::string_view(source_.bytes).find(text, begin);
  if (found == std::string_view::npos) return false;
  rawAt_ = found + text.size();
  const auto from = source_.bytes.begin() + static_cast<std::ptrdiff_t>(begin);
  linesInRaw_ =
      static_cast<std::size_t>(std::count(from, from + static_cast<std::ptrdiff_t>(rawAt_ - begin), '\n'));
  inRaw_ = true;
  return true;
}

const char* MixedValues::raw(std::size_t size, const Item& item) {
  if (!inRaw_) {
    rawAt_ = lines_.nextOffset();
    inRaw_ = true;
  }
  if (size > source_.bytes.size() - rawAt_) failTruncated(item);
  const char* at = source_.bytes.data() + rawAt_;
  rawAt_ += size;
  return at;
}

void MixedValues::fail(const std::string& what) const {
  if (inRaw_) source_.failAtByte(rawAt_, what);
  lines_.fail(what);
}

void MixedValues::failTruncated(const Item& item) const {
  fail("the file ends inside " + nameOf(item) + "; it is truncated, export or copy it again");
}

}  // namespace polestar::detail
