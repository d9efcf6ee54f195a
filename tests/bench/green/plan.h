#pragma once
// Which rows there are.

#include <string>
#include <vector>

#include "row.h"

namespace polestar::bench {

struct PlanOptions {
  bool quick = false;             ///< small sizes and few models: about a minute
  std::vector<std::string> only;  ///< methods; empty: all
  std::string part = "all";       ///< "exact", "models" or "all"
  int maxVertices = 2000000;      ///< of a surface as asked for; files of the mesh folder always run
  int maxDim = 256;               ///< voxels along the longest side
};

/// The cheap ones first within each part.
std::vector<Row> planRows(const PlanOptions& options);

/// Boundary errors asked for at a size, as goals have them.
struct Goal {
  int size;
  double seconds, tolerance;
};
const std::vector<Goal>& goals();

bool isExactShape(const std::string& shape);
/// The shapes that exist at every size.
const std::vector<std::string>& scalingShapes();

}  // namespace polestar::bench
