#pragma once
// How checks are made, and bits of the sentences that they say.

#include <cstdio>
#include <string>
#include <utility>

#include "polestar/certify/certificate.h"

namespace polestar::detail {

inline Check check(CheckRole role, const char* name, double value, double limit, std::string what) {
  return {name, role, value <= limit, value, limit, std::move(what)};
}

inline std::string counted(std::size_t bad, std::size_t all, const std::string& what) {
  return std::to_string(bad) + " of " + std::to_string(all) + " " + what;
}

inline std::string formatted(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

}  // namespace polestar::detail
