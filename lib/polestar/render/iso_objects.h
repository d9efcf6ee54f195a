#pragma once
// The foliation on the stage: iso-surfaces as shells within the solid, field lines as tubes through them.
// [Xia 2010, fig. 1]

#include <span>
#include <vector>

#include "polestar/map/volume_map.h"
#include "polestar/render/render_solid.h"

namespace polestar {

struct IsoObjectOptions {
  std::vector<double> shells = {};  ///< ball radii, in (0, 1); the innermost is not cut
  int lines = 0;                    ///< field lines, spread evenly, from the innermost shell to the surface
  double lineWidth = 0.006;         ///< diameter of their tubes, share of the solid's box diagonal, > 0

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// A shell for each level, colored from the hot pole outward, and the field lines as one object that no plane
/// cuts: where the solid is cut away, they show where it was. `surface`: of the body that `map` takes to the
/// ball, mesh units; `directions`: where its vertices go on the sphere.
std::vector<StageObject> isoObjects(const VolumeMap& map, const TriMesh& surface,
                                    std::span<const Vec3> directions, const IsoObjectOptions& options,
                                    Context& context = Context::quiet());

/// A tube of a radius around a polyline, round at both ends; closed. Corners are mitred.
TriMesh tubeAround(std::span<const Vec3> line, double radius);

}  // namespace polestar
