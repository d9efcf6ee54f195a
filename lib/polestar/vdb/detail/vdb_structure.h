#pragma once
// The skeleton of a .vdb, walked with every length checked against the file. OpenVDB's reader believes what
// it reads: a truncated file makes programs abort, a damaged length makes it allocate gigabytes.

#include <cstdint>
#include <istream>

namespace polestar::detail {

/// Walks header, metadata and grid descriptors of a .vdb of `fileSize` bytes, without decoding trees. Files
/// older than format 222 (OpenVDB 2.0, 2013) and grids without offsets (written to a pipe) are followed as
/// far as they allow.
/// @throws Error{Errc::io} with the reason, without the file's name: no .vdb, newer than our OpenVDB,
/// truncated.
void checkVdbStructure(std::istream& stream, std::int64_t fileSize);

}  // namespace polestar::detail
