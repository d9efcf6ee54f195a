#pragma once
// Whole .vdb files, in and out.

#include <openvdb/openvdb.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "polestar/vdb/detail/vdb_archive.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::detail {

struct VdbContent {
  openvdb::GridPtrVec grids;
  openvdb::MetaMap metadata;  ///< of the file itself
};

/// All of a file, with truncated files caught before OpenVDB reads their trees; "-" is standard input.
/// @throws Error{Errc::io} for a file that is missing, truncated or no .vdb.
VdbContent readVdb(const std::filesystem::path& path);

/// The grids with `metadata` on every one of them; they themselves stay as they are. The same bytes every
/// time: to a temporary name in the same folder, synced, then renamed; "-" is standard output.
/// @throws Error{Errc::io}
void writeVdb(const std::filesystem::path& path, const std::vector<openvdb::GridBase::Ptr>& grids,
              const std::map<std::string, Metadata>& metadata, const VdbForm& form = {});

}  // namespace polestar::detail
