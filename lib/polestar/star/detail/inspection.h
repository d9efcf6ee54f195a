#pragma once
// The whole star test on a bare mesh; star_shape.cpp puts the types around it that carry its proof.

#include "polestar/star/star_shape.h"

namespace polestar::detail {

struct Inspection {
  StarReport report;
  TriMesh inner;  ///< in `frame`, about report.center
  Frame frame;
};

/// Precondition for a meaningful "yes": the mesh is the mesh of a ClosedSurface.
Inspection inspectMesh(const TriMesh& mesh, const StarOptions& options, Context& context);

}  // namespace polestar::detail
