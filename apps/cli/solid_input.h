#pragma once
// From a file name to a solid, with everything that check, map and eval say about it on the way.

#include <filesystem>
#include <optional>

#include "cli/session.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/star/star_shape.h"

namespace polestar::cli {

/// Reads a mesh. @throws Error{Errc::io}; Error{Errc::usage} for "-", because a mesh's format is told by its
/// name.
MeshFile loadMesh(const std::filesystem::path& path, Session& session);

struct InspectedSolid {
  ClosedSurface surface;
  StarReport star;
};

/// Reads, repairs and judges: fills the members of `check` in session.json() and the lines of session.text().
/// @throws Error with the code of the first "no"; the session then says what is known.
InspectedSolid inspectSolid(const std::filesystem::path& path, const StarOptions& options, Session& session);

}  // namespace polestar::cli
