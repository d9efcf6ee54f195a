#include "polestar/star/star_shape.h"

#include <cmath>
#include <utility>

#include "polestar/core/error.h"
#include "polestar/star/detail/inspection.h"

namespace polestar {

void StarOptions::validate() const {
  if (center && !center->allFinite())
    throw Error(Errc::usage, "the center must have three finite coordinates");
  if (!(marginShare > 0 && marginShare <= 1)) throw Error(Errc::usage, "marginShare must lie in (0, 1]");
  if (rays < 0) throw Error(Errc::usage, "the number of rays must not be negative");
}

StarReport inspectStar(const ClosedSurface& surface, const StarOptions& options, Context& context) {
  return detail::inspectMesh(surface.mesh(), options, context).report;
}

StarShape verifyStarShape(const ClosedSurface& surface, const StarOptions& options, Context& context) {
  detail::Inspection inspection = detail::inspectMesh(surface.mesh(), options, context);
  if (!inspection.report.star) throw Error(Errc::notStarShaped, inspection.report.reason);
  return StarShape(std::make_shared<const StarShape::Data>(
      StarShape::Data{std::move(inspection.inner), inspection.frame, std::move(inspection.report), surface}));
}

}  // namespace polestar
