#pragma once
// Bytes of a .vdb, to any seekable stream.

#include <openvdb/openvdb.h>

#include <cstdint>
#include <iosfwd>

namespace polestar::detail {

/// Registers OpenVDB's grid types; cheap after the first call.
void initializeOpenVdb();

/// OpenVDB's flags for files of ours: Blosc, and inactive voxels left out.
inline constexpr std::uint32_t kVdbCompression =
    openvdb::io::COMPRESS_BLOSC | openvdb::io::COMPRESS_ACTIVE_MASK;

/// The `file_...` metadata that OpenVDB's own writer puts on a grid: voxel count, box, memory, compression.
void addFileMetadata(openvdb::GridBase& grid, std::uint32_t compression);

/// What a file says beside its grids, and how it packs them.
struct VdbForm {
  openvdb::MetaMap metadata;
  std::uint32_t compression = kVdbCompression;
};

/// Writes the grids with grid offsets, as openvdb::io::File does, but
/// reproducibly: OpenVDB gives each file a random identifier, here it is a digest of what the file holds. And
/// a full disk is noticed, which io::File does not. `stream` is empty, open for reading and writing, and
/// throws on failure (std::ios::exceptions).
void writeArchive(std::iostream& stream, const openvdb::GridCPtrVec& grids, const VdbForm& form);

}  // namespace polestar::detail
