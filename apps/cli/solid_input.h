#pragma once
// From a file name to a solid, with everything that check, map and eval say about it on the way.

#include <filesystem>
#include <optional>

#include "cli/session.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/star/star_shape.h"
#include "polestar/vdb/sampled_grids.h"

namespace polestar::cli {

/// Reads a mesh; of a .vdb the surface of its level set or fog, in triangles of about a voxel. A .vdb that
/// has a map of its own beside it is warned about: that map is not looked at.
/// @throws Error{Errc::io}; Error{Errc::usage} for "-", because a mesh's format is told by its name.
MeshFile loadMesh(const std::filesystem::path& path, Session& session);

/// The surface of a file's level set or fog. @throws Error{Errc::io} when it has neither, or no surface.
TriMesh solidSurface(const SampledGrids& grids, const std::string& name, const SurfaceChoice& choice = {});

struct InspectedSolid {
  ClosedSurface surface;
  StarReport star;
};

/// Reads, repairs and judges: fills the members of `check` in session.json() and the lines of session.text().
/// @throws Error with the code of the first "no"; the session then says what is known.
InspectedSolid inspectSolid(const std::filesystem::path& path, const StarOptions& options, Session& session);

}  // namespace polestar::cli
