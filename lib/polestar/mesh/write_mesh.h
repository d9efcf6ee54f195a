#pragma once
// Surface meshes out: OBJ, PLY, OFF and STL.

#include <filesystem>
#include <string>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Whether writeMesh can write to that name: .obj, .ply, .off or .stl.
bool isMeshOutputName(const std::filesystem::path& path);

/// The bytes that writeMesh writes to a file of that extension. @throws Error{Errc::usage}
std::string meshBytes(const std::string& extension, const TriMesh& mesh, const std::string& comment = {});

/// Writes the mesh; the name's extension says how: .obj or .off (text, the shortest decimals that read back
/// as the same double), .ply (binary little endian, double coordinates, int indices) or .stl (binary, which
/// has single precision and no shared vertices). `comment` becomes comment lines of the header; a .stl takes
/// its first 80 characters. Atomic: the file appears whole or not at all.
/// @throws Error{Errc::usage} for another extension, Error{Errc::io} with the reason when it cannot be
/// written.
void writeMesh(const std::filesystem::path& path, const TriMesh& mesh, const std::string& comment = {});

}  // namespace polestar
