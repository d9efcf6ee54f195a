#pragma once
// What the writers of meshes share: numbers as text and bytes, and the file at the end.

#include <bit>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <string>

namespace polestar::detail {

/// The shortest decimal that reads back as the same number.
template <class Number>
void appendText(std::string& out, Number value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  out.append(buffer, result.ptr);
}

/// In the given byte order.
template <class Value>
void appendBytes(std::string& out, const Value& value, std::endian order = std::endian::little) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  if (order == std::endian::native) {
    out.append(bytes, sizeof value);
  } else {
    out.append(std::make_reverse_iterator(bytes + sizeof value), std::make_reverse_iterator(bytes));
  }
}

/// Every line of `comment` behind `prefix`.
std::string commentLines(const std::string& comment, const std::string& prefix);

/// ".obj" for "a.OBJ"
std::string lowerExtension(const std::filesystem::path& path);

/// Writes atomically. @throws Error{Errc::io}
void writeWhole(const std::filesystem::path& path, const std::string& bytes);

}  // namespace polestar::detail
