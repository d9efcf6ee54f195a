#pragma once
// Whole .vdb files, in and out.

#include <openvdb/openvdb.h>

#include <filesystem>

namespace polestar::detail {

/// All grids of a file, with truncated files caught before OpenVDB reads their trees.
/// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
openvdb::GridPtrVec readVdb(const std::filesystem::path& path);

/// The same bytes every time: to a temporary name in the same folder, synced, then renamed; "-" is standard
/// output. @throws Error{Errc::io}
void writeVdb(const std::filesystem::path& path, const openvdb::GridCPtrVec& grids);

}  // namespace polestar::detail
