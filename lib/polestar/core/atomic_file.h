#pragma once
// Outputs appear whole or not at all.

#include <filesystem>
#include <functional>
#include <string>

namespace polestar {

/// Lets `write` fill a temporary file in the folder of `path`, syncs it and renames it to `path`. When
/// anything fails or throws, the temporary is removed and `path` is as it was.
/// @throws Error{Errc::io} naming the path and the system's reason; what `write` throws passes through.
void writeAtomically(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

}  // namespace polestar
