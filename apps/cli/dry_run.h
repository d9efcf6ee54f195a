#pragma once
// What --dry-run prints: the files that would be read and made.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cli/session.h"

namespace polestar::cli {

struct PlannedFile {
  std::filesystem::path path;
  std::string content;  ///< such as "grids surface, density, rest, green of 96 x 128 x 64 voxels"
  std::optional<std::uint64_t> bytes;  ///< at most, where it can be told beforehand
};

/// Fills the session's answer with its inputs and the files that would be made.
/// @throws Error{Errc::io} for an input that is not there.
void describePlan(Session& session, const std::vector<PlannedFile>& writes = {});

}  // namespace polestar::cli
