#pragma once
// Numbers from bytes of either order.

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>

namespace polestar::detail {

/// The value of type T whose bytes begin at `at`; `bigEndian` says how the file orders them.
template <class T>
T fromBytes(const char* at, bool bigEndian = false) {
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), at, sizeof(T));
  if (bigEndian != (std::endian::native == std::endian::big)) std::reverse(bytes.begin(), bytes.end());
  return std::bit_cast<T>(bytes);
}

}  // namespace polestar::detail
