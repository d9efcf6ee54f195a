#pragma once
// One pair of solids by every method: a row of figures each.

#include <string>
#include <vector>

#include "polestar/morph/morph_complex.h"
#include "results.h"

namespace polestar::bench {

struct PairOptions {
  int dim = 96;    ///< voxels along the longer of the two boxes
  int frames = 9;  ///< both ends included
};

struct Pair {
  std::string name;         ///< in the tables
  std::string first, last;  ///< files of volumes/, or of the mesh folder
  /// The last solid is turned by this about (1, 1, 1) first, and ours are brought into line with --align.
  /// Radians.
  double turn = 0;
};

/// Those of volumes/, then those of the mesh folder, where there is one.
std::vector<Pair> pairs();

/// Parts and handles of a closed surface, by counting.
struct Topology {
  std::size_t parts = 0;
  long handles = 0;  ///< of all parts together
};
Topology topologyOf(const TriMesh& surface);

/// The surfaces of a complex by linear interpolation of its vertices, from either correspondence. Mesh units.
struct VertexPaths {
  std::vector<Triangle> triangles;
  std::vector<Vec3> first, last;

  TriMesh at(double t) const;
};
/// Vertices belong together that both maps send to one point of the sphere.
VertexPaths bySphereMaps(const MorphComplex& complex);
/// Vertices belong together that lie in one direction from the centers, the triangles of the first solid.
VertexPaths byDirections(const MorphComplex& complex);

/// A row a method, with `pair`, `method`, `frames` and what else the page wants. Half a minute to some
/// minutes.
std::vector<Json> measurePair(const Pair& pair, const PairOptions& options);

}  // namespace polestar::bench
