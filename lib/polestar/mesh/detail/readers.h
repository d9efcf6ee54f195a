#pragma once
// One reader a format; readMesh picks among them.

#include "polestar/mesh/detail/mesh_source.h"
#include "polestar/mesh/read_mesh.h"

namespace polestar::detail {

/// What readMesh does once the file is in memory. @throws Error{Errc::io}
MeshFile parseMesh(MeshSource source);

MeshFile parseObj(const MeshSource& source);
MeshFile parsePly(const MeshSource& source);
MeshFile parseStl(const MeshSource& source);
MeshFile parseOff(const MeshSource& source);

/// True for a first word such as OFF, COFF or STCNOFF: letters of the format's own prefixes, then OFF.
bool isOffKeyword(std::string_view word);

/// True when the size is that of a binary STL with as many triangles as bytes 80 to 83 say.
bool hasBinaryStlSize(std::string_view bytes);

}  // namespace polestar::detail
