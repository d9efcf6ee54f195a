#include "polestar/star/detail/inspection.h"

#include <algorithm>
#include <utility>

#include "polestar/star/detail/exact_verdict.h"
#include "polestar/star/detail/half_spaces.h"
#include "polestar/star/detail/kernel_programs.h"
#include "polestar/star/detail/least_bad.h"
#include "polestar/star/detail/ray_count.h"
#include "polestar/star/detail/star_reason.h"

namespace polestar::detail {
namespace {

/// Everything that the steps of one inspection share.
struct StarProblem {
  const TriMesh& mesh;
  Frame working;
  HalfSpaces halfSpaces;
  LargestMargin largest;
  Vec3 centroid;  ///< of the solid, working frame

  explicit StarProblem(const TriMesh& surface)
      : mesh(surface),
        working(workingFrame(surface)),
        halfSpaces(surface, working),
        largest(largestMargin(halfSpaces)),
        centroid(working.toInner(volumeProperties(surface).centroid)) {}
};

struct JudgedCenter {
  Vec3 center;  ///< mesh units
  ExactVerdict verdict;
};

JudgedCenter judge(const StarProblem& problem, const Vec3& center, const Context& context) {
  return {center, judgeCenter(problem.mesh, center, problem.working.unit, context)};
}

// The paper's center kept off the kernel's rim; if rounding spoils it, the point of largest margin; if there
// is neither, the one that misses least.
JudgedCenter findCenter(const StarProblem& problem, double marginShare, const Context& context) {
  if (problem.largest.margin > 0) {
    const ClosestCenter closest =
        closestCenter(problem.halfSpaces, problem.centroid, marginShare * problem.largest.margin,
                      problem.largest.workingSet);
    JudgedCenter judged = judge(problem, problem.working.toWorld(closest.center), context);
    if (judged.verdict.star()) return judged;
  }
  JudgedCenter judged = judge(problem, problem.working.toWorld(problem.largest.center), context);
  // Faces that wind twice or have no area stay so for any center.
  if (judged.verdict.star() || problem.largest.margin > 0) return judged;
  const Vec3 leastBad = leastBadCenter(problem.mesh, problem.working, problem.halfSpaces,
                                       {problem.largest.center, problem.centroid}, context);
  return judge(problem, problem.working.toWorld(leastBad), context);
}

// The faces that carry the largest margin, if by themselves they keep it negative.
std::vector<std::int32_t> witnesses(const StarProblem& problem) {
  std::vector<std::int32_t> faces;
  for (const ActiveFace& a : problem.largest.active) faces.push_back(a.face);
  if (problem.largest.bound >= 0 || largestMargin(problem.halfSpaces, faces).bound >= 0) return {};
  std::sort(faces.begin(), faces.end());
  return faces;
}

StarReport describe(const StarProblem& problem, const JudgedCenter& judged) {
  StarReport report;
  const double unit = problem.working.unit;
  report.star = judged.verdict.star();
  report.center = judged.center;
  const double slack = unit * problem.halfSpaces.tightest(problem.working.toInner(judged.center)).slack;
  // The sign is the predicates' to say; a rounded distance must not contradict it.
  report.centerMargin = judged.verdict.badFaces.empty() ? std::max(0.0, slack) : std::min(0.0, slack);
  report.margin = std::max(unit * problem.largest.margin, report.centerMargin);
  report.marginRelative = report.margin / boundingBox(problem.mesh).diagonal();
  double badArea = 0;
  for (const std::int32_t f : judged.verdict.badFaces) badArea += problem.halfSpaces.area(f);
  report.badAreaFraction = badArea / problem.halfSpaces.totalArea();
  return report;
}

void explain(const StarProblem& problem, const JudgedCenter& judged, const StarOptions& options,
             const Context& context, StarReport& report) {
  report.witnessFaces = witnesses(problem);
  std::optional<BadPatch> patch;
  if (!judged.verdict.badFaces.empty()) {
    patch = largestBadPatch(problem.mesh, problem.halfSpaces, problem.working.toInner(judged.center),
                            judged.verdict.badFaces);
    const std::size_t face = static_cast<std::size_t>(patch->deepestFace);
    report.badPlace = problem.mesh.corner(face, 0) / 3 + problem.mesh.corner(face, 1) / 3 +
                      problem.mesh.corner(face, 2) / 3;
  }
  std::optional<StarReport> alternative;
  if (options.center && problem.largest.margin > 0) {
    const JudgedCenter other = findCenter(problem, options.marginShare, context);
    if (other.verdict.star()) alternative = describe(problem, other);
  }
  report.reason = whyNotStar(report, judged.verdict, patch, options.center.has_value(), alternative);
}

}  // namespace

Inspection inspectMesh(const TriMesh& mesh, const StarOptions& options, Context& context) {
  options.validate();
  context.progress("testing star-ness", 0);
  const StarProblem problem(mesh);
  context.throwIfCancelled();
  JudgedCenter judged = options.center ? judge(problem, *options.center, context)
                                       : findCenter(problem, options.marginShare, context);
  Inspection inspection;
  inspection.report = describe(problem, judged);
  if (!inspection.report.star) explain(problem, judged, options, context, inspection.report);
  if (options.rays > 0) {
    context.progress("testing star-ness", 0.3);
    const RayCount rays = countRayHits(judged.verdict.mesh, options.rays, context);
    inspection.report.rays = {rays.count, rays.failed};
  }
  inspection.inner = std::move(judged.verdict.mesh);
  inspection.frame = judged.verdict.frame;
  context.progress("testing star-ness", 1);
  return inspection;
}

}  // namespace polestar::detail
