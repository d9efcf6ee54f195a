#pragma once
// Command lines as text: what a result says it was made by, and what people paste into a shell.

#include <span>
#include <string>
#include <string_view>

namespace polestar::cli {

/// A word as a shell takes it, in single quotes where it needs them.
std::string shellQuoted(std::string_view word);

/// "polestar" and the words after it, as one would type them again, without what has no part in the result:
/// -j, -v, -q, --json and --overwrite. Results carry this line, so it must not differ where they do not.
std::string commandLine(std::span<const std::string> words);

}  // namespace polestar::cli
