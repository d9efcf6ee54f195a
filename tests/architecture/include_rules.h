#pragma once
// The dependency direction of the library's stages, as a table and a check of #include lines against it.

#include <filesystem>
#include <string>
#include <vector>

namespace polestar::testing {

/// One #include line that breaks a rule, in words: file, line, what it includes and why that is not allowed.
using Violations = std::vector<std::string>;

/// Checks one source text as if it stood at `file`, a path relative to the repository root such as
/// "lib/polestar/star/star_shape.h".
Violations checkIncludes(const std::filesystem::path& file, const std::string& text);

/// Checks every .h, .h.in and .cpp under `folder` of the repository `root`; `files` counts them.
Violations checkTree(const std::filesystem::path& root, const std::filesystem::path& folder,
                     std::size_t& files);

}  // namespace polestar::testing
