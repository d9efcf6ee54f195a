#pragma once
// One row of the tables: which method on which shape.

#include <string>
#include <vector>

#include "polestar/core/types.h"
#include "results.h"

namespace polestar::bench {

struct Method {
  std::string id;     ///< as --only takes it
  std::string title;  ///< as legends and tables have it
  /// What `Row::size` counts: voxels along the longest side, else vertices of the surface.
  bool voxels = false;
};
const std::vector<Method>& methods();
const Method& method(const std::string& id);

struct Row {
  std::string method;
  std::string shape;     ///< an exact solid, "head", "asteroid", or a file of the mesh folder
  int size = 0;          ///< see Method::voxels; 0: the file's own
  double tolerance = 0;  ///< of our solver; 0: its default

  bool operator==(const Row&) const = default;
};
Json toJson(const Row& row);
Row rowOf(const Json& result);
/// The members of a result that make it this row's.
const std::vector<std::string>& rowKeys();

/// The exact Green's function at the points where all methods are compared; made once a shape, since the cube
/// is slow.
struct Reference {
  std::vector<Vec3> points;
  std::vector<double> green;
};
Reference referenceFor(const std::string& exactShape);

}  // namespace polestar::bench
