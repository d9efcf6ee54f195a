#pragma once
// Setting the stage: from options to pieces of the solid in the renderer's own frame.

#include <vector>

#include "polestar/render/detail/camera.h"
#include "polestar/render/detail/solid_scene.h"
#include "polestar/render/detail/tile.h"
#include "polestar/render/render_solid.h"

namespace polestar::detail {

/// @throws Error{Errc::usage} when there is nothing.
RenderFrame renderFrame(const TriMesh& surface);

TriMesh inRenderFrame(const TriMesh& surface, const RenderFrame& frame);

/// The options' planes and what they make of the solid. All in the render frame.
std::vector<Piece> cutPieces(const RenderOptions& options, const TriMesh& mesh, const Vec3& center);

/// What the piece keeps of a mesh; triangles across a plane are cut along it. Both in the render frame.
TriMesh clipped(const TriMesh& mesh, const Piece& piece);

CameraPose cameraPose(const RenderOptions& options);

/// The key light stands where it shines into the cut: 1 for the right, -1 for the left; left where nothing is
/// cut.
double keySide(const RenderOptions& options, const Camera& camera);

/// @throws Error{Errc::usage}
void require(bool holds, const std::string& what);

}  // namespace polestar::detail
