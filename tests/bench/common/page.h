#pragma once
// Text of the pages that benchmarks write.

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>

#include "polestar/core/atomic_file.h"

namespace polestar::bench {

/// As printf has it, up to 511 characters.
template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[512];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

/// Whole or not at all.
inline void writeText(const std::filesystem::path& file, const std::string& content) {
  writeAtomically(file, [&](const std::filesystem::path& temporary) { std::ofstream(temporary) << content; });
}

}  // namespace polestar::bench
