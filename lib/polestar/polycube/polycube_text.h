#pragma once
// Polycubes as text: files made by hand, and what metadata holds.
//
// A line is a box of cells, three numbers or ranges: "0 0 0" is a cell, "-2:2 0 0" five in a row, "-1:1 -1:1
// 2:3" a block. The polycube is the union of all lines; what # begins is a comment. A line ends with a
// newline or, as in the metadata of a .vdb, with a semicolon. Cell 0 0 0 holds the center.

#include <filesystem>
#include <string>
#include <string_view>

#include "polestar/polycube/polycube.h"

namespace polestar {

/// The shortest lines along the last axis, one a row of cells: fromText(toText(p)) == p.
std::string toText(const Polycube& polycube);

/// @throws Error{Errc::io} naming the line of `text` that cannot be understood, Error{Errc::notStarShaped} as
/// verifyPolycube() does. `name` is what messages call the text.
Polycube polycubeFromText(std::string_view text, const std::string& name = "the text");

/// @throws Error{Errc::io} when the file cannot be read, and what polycubeFromText() throws.
Polycube readPolycube(const std::filesystem::path& path);

/// Atomic: the file appears whole or not at all. @throws Error{Errc::io}
void writePolycube(const std::filesystem::path& path, const Polycube& polycube);

}  // namespace polestar
