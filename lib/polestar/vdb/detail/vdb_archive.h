#pragma once
// Bytes of a .vdb, to any seekable stream.

#include <openvdb/openvdb.h>

#include <iosfwd>

namespace polestar::detail {

/// Registers OpenVDB's grid types; cheap after the first call.
void initializeOpenVdb();

/// The `file_...` metadata that OpenVDB's own writer puts on a grid: voxel count, box, memory, compression.
void addFileMetadata(openvdb::GridBase& grid);

/// Writes the grids with Blosc and active-mask compression and grid offsets, as openvdb::io::File does, but
/// reproducibly: OpenVDB gives each file a random identifier, here it is a digest of what the file holds. And
/// a full disk is noticed, which io::File does not. `stream` is empty, open for reading and writing, and
/// throws on failure (std::ios::exceptions).
void writeArchive(std::iostream& stream, const openvdb::GridCPtrVec& grids);

}  // namespace polestar::detail
