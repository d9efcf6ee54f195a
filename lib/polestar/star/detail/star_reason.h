#pragma once
// The sentences of a "no".

#include <optional>
#include <string>

#include "polestar/star/detail/exact_verdict.h"
#include "polestar/star/detail/half_spaces.h"
#include "polestar/star/star_shape.h"

namespace polestar::detail {

/// Bad faces that hang together by vertices.
struct BadPatch {
  std::size_t faces = 0;
  double area = 0;                ///< in squared units of the working frame
  std::int32_t deepestFace = -1;  ///< the one whose plane the center lies farthest behind
  double depth = 0;               ///< how far, working frame
};

/// The largest patch by area. Precondition: there are bad faces.
BadPatch largestBadPatch(const TriMesh& mesh, const HalfSpaces& halfSpaces, const Vec3& center,
                         const std::vector<std::int32_t>& badFaces);

/// @param alternative a verified center (mesh units), for when a given one failed
std::string whyNotStar(const StarReport& report, const ExactVerdict& verdict,
                       const std::optional<BadPatch>& patch, bool centerWasGiven,
                       const std::optional<StarReport>& alternative);

}  // namespace polestar::detail
