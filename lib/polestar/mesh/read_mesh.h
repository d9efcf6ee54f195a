#pragma once
// Surface meshes in: OBJ, PLY (ascii, binary little and big endian, triangle strips), STL (ascii, binary),
// OFF. Our own readers, because coordinates must stay doubles where the file has doubles, and a hostile file
// must end in a message.

#include <cstddef>
#include <filesystem>
#include <string>

#include "polestar/mesh/tri_mesh.h"

namespace polestar {

struct MeshFile {
  TriMesh mesh;              ///< mesh units, vertices as in the file (STL: three of its own per triangle)
  std::string format;        ///< "obj", "ply", "stl" or "off"
  std::size_t polygons = 0;  ///< faces with more than three corners, triangulated on reading
};

/// Reads a surface mesh; the format is recognized by the content where it has a signature, else by the file's
/// name.
///
/// Polygons are triangulated (quads along the diagonal that makes both halves agree best, others by ear
/// clipping in their best-fitting plane); faces of one or two corners bound no area and are passed over.
/// Memory grows with the size of the file, never with the counts it claims.
/// @throws Error{Errc::io} with file, line or byte, and reason: unreadable, truncated, index out of range, a
/// number that is no number, NaN or infinite coordinates, no triangles.
MeshFile readMesh(const std::filesystem::path& path);

/// The same of a file's bytes, which came from somewhere else; `name` is for the format and for messages.
MeshFile readMesh(std::string bytes, const std::filesystem::path& name);

}  // namespace polestar
