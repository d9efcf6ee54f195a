#pragma once
// A map between two surfaces that another program found, registration or wrapping, as a map between their
// balls.

#include "polestar/map/ball_map.h"
#include "polestar/map/shell_map.h"

namespace polestar {

struct SurfaceTableOptions {
  /// Vertices may miss their surface by this share of its box's diagonal, along the ray from the center; they
  /// are taken for the surface's points on their rays.
  double reach = 0.01;
  double coreRadius = 0.25;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// The same triangles twice: with their vertices on the surface of `from`'s solid and on that of `to`'s, in
/// mesh units. Every vertex goes from phi_from of the one to phi_to of the other; linear in between.
/// @throws Error{Errc::usage} when the triangles differ, or a vertex lies off its surface (the message says
/// how many, and which lies farthest off); Error{Errc::notConverged} when triangles are folded, on either
/// side or within the core, with ids and places, or when they do not cover the surface once.
ShellMap surfaceTable(const BallMap& from, const TriMesh& onFrom, const BallMap& to, const TriMesh& onTo,
                      const SurfaceTableOptions& options = {});

}  // namespace polestar
