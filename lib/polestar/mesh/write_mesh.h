#pragma once
// Surface meshes out: OBJ and PLY, with every bit of the coordinates.

#include <filesystem>
#include <string>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

/// Writes the mesh; the name's extension says how: .obj (text, the shortest decimals that read back as the
/// same double) or .ply (binary little endian, double coordinates, int indices). `comment` becomes comment
/// lines of the header. Atomic: the file appears whole or not at all.
/// @throws Error{Errc::usage} for another extension, Error{Errc::io} with the reason when it cannot be
/// written.
void writeMesh(const std::filesystem::path& path, const TriMesh& mesh, const std::string& comment = {});

}  // namespace polestar
