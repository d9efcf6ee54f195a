#pragma once
// The bytes of a mesh file and the one way in which its readers complain about them.

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "polestar/core/error.h"

namespace polestar::detail {

/// A mesh file in memory: as large as the file, whatever counts its header claims.
struct MeshSource {
  std::filesystem::path path;
  std::string bytes;

  /// @throws Error{Errc::io} "cannot read PATH: WHAT", WHAT being place, reason and remedy.
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Errc::io, "cannot read " + path.string() + ": " + what);
  }
  [[noreturn]] void failAtLine(std::size_t line, const std::string& what) const {
    fail("line " + std::to_string(line) + ": " + what);
  }
  [[noreturn]] void failAtByte(std::size_t byte, const std::string& what) const {
    fail("byte " + std::to_string(byte) + ": " + what);
  }
};

/// The whole file. @throws Error{Errc::io}
MeshSource loadMeshSource(const std::filesystem::path& path);

/// Takes off a byte order mark. @throws Error{Errc::io} for a compressed file.
void prepareMeshSource(MeshSource& source);

/// A piece of the file between quotes, short and printable whatever it holds.
inline std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 32;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest)) result += c >= ' ' && c <= '~' ? c : '?';
  if (text.size() > kLongest) result += "...";
  return result + "'";
}

}  // namespace polestar::detail
