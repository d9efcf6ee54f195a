#pragma once
// What all frames of a morph share: one complex of tetrahedra in the unit ball, and where each shape has its
// nodes. x(t) is a blend of the inverse maps over that ball. [Xia 2010, sec. 5, "volumetric morphing"]
//
//   maps of the shapes -> MorphComplex -> MorphPath -> MorphFrame -> proof, grids, surface
//
// The complex is one of directions times levels, as the table of a map is (chart/foliation.h), so every frame
// is judged by the same exact counts. All maps are asked once, when the complex is made; a frame is a
// weighted mean of nodes.

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "polestar/chart/foliation.h"
#include "polestar/map/ball_map.h"
#include "polestar/mesh/tri_mesh.h"
#include "polestar/morph/mend_cells.h"

namespace polestar {

/// A shape, and how its own ball lies in the common one.
struct MorphShape {
  BallMap map;
  /// From the common ball to the shape's own, one to one and onto; null: the identity.
  std::shared_ptr<const VolumeMap> motion;
  /// What `motion` is at the center. Frames turn by the blend of these rotations, and the rest is blended in
  /// frames that were turned back: a shape that is only turned does not collapse on its way.
  Mat3 rotation = Mat3::Identity();
};

struct MorphOptions {
  /// How far the common triangles may lie from each shape's surface, mesh units, positive; measured at its
  /// vertices and in the middle of its edges.
  double surfaceTolerance = 0;
  double largestStep = 0.06;   ///< between levels, ball radii
  double innermost = 0.03;     ///< radius of the last level, in (0, 0.25)
  double largestAngle = 0.06;  ///< sides of triangles on the sphere, radians
  /// Refinement ends there, with a warning when a surface is farther away than it may be.
  std::size_t mostVertices = 120000;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// What it took to make a complex.
struct MorphReport {
  struct End {
    double surfaceMax = 0, surfaceRms = 0;  ///< of the surface, off the common triangles; mesh units
    Mending mending = {};                   ///< of cells that straight edges turned over
  };
  std::vector<End> ends;  ///< one a shape
  int rounds = 0;         ///< of refinement
  double seconds = 0;
};

/// Cheap to copy, immutable.
class MorphComplex {
 public:
  /// The triangles are those of the sphere map of the shape with most vertices, bisected until they meet all
  /// shapes' surfaces within the tolerance. Cost: one inverse a node and shape, about 10 us each; two shapes
  /// of 10,000 vertices make some 500,000 nodes.
  /// @throws Error{Errc::usage} for fewer than one shape; Error{Errc::notConverged} where an inverse map has
  /// no answer at more than one node in a thousand; Error{Errc::cancelled}
  MorphComplex(std::vector<MorphShape> shapes, const MorphOptions& options,
               Context& context = Context::quiet());

  std::size_t shapeCount() const { return data_->shapes.size(); }
  const MorphShape& shape(std::size_t i) const { return data_->shapes[i]; }
  /// The levels are radii in the ball, the nodes their places there.
  const Foliation& ball() const { return data_->ball; }
  /// Where the nodes lie in a shape: from its center, turned back by its rotation, mesh units.
  std::span<const Vec3> nodes(std::size_t shape) const { return data_->nodes[shape]; }
  /// Mesh units.
  const Vec3& center(std::size_t shape) const { return data_->centers[shape]; }
  const MorphReport& report() const { return data_->report; }

  /// Where the nodes lie in some other map's solid, its mesh units; as for the shapes, but nothing is mended.
  /// `motion` as in MorphShape.
  std::vector<Vec3> nodesIn(const BallMap& map, const VolumeMap* motion) const;

 private:
  struct Data {
    std::vector<MorphShape> shapes;
    Foliation ball;
    std::vector<std::vector<Vec3>> nodes;
    std::vector<Vec3> centers;
    MorphReport report;
  };
  std::shared_ptr<const Data> data_;
};

}  // namespace polestar
