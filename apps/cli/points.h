#pragma once
// Point lists as `eval` reads them.

#include <filesystem>
#include <istream>
#include <string>
#include <vector>

#include "polestar/core/context.h"
#include "polestar/core/types.h"

namespace polestar::cli {

/// One point a line: three numbers, separated by blanks or commas. Empty lines and lines that start with #
/// are skipped. `name` is for messages.
/// @throws Error{Errc::io} with the line's number and text; Error{Errc::cancelled}.
std::vector<Vec3> parsePoints(std::istream& in, const std::string& name,
                              const Context& context = Context::quiet());

/// parsePoints on a file, or on standard input for "-".
std::vector<Vec3> readPoints(const std::filesystem::path& path, const Context& context);

}  // namespace polestar::cli
