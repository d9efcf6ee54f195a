#pragma once
// The inner frame. Meshes come with offsets of 1e6 and sizes of 1e-7; every computation runs on coordinates
// that were moved and scaled in double precision, so no tolerance and no predicate depends on where the user
// put the model.

#include "polestar/core/types.h"

namespace polestar {

/// Similarity between mesh units ("world") and the inner frame: inner = (world - origin) / unit.
///
/// For a StarShape the origin is its center and the unit is the distance from the center to the farthest
/// vertex: the solid lies in the unit ball, and turning the mesh turns its inner coordinates and changes
/// nothing else.
struct Frame {
  Vec3 origin = Vec3::Zero();
  double unit = 1;  ///< length of one inner unit in mesh units, positive

  Vec3 toInner(const Vec3& world) const { return (world - origin) / unit; }
  Vec3 toWorld(const Vec3& inner) const { return origin + unit * inner; }
};

}  // namespace polestar
