#include "polestar/chart/detail/local_refinement.h"

#include <numeric>
#include <optional>
#include <string>

#include "polestar/chart/detail/line_repair.h"
#include "polestar/star/subdivide.h"

namespace polestar::detail {
namespace {

constexpr int kRounds = 8;
// Above bad cells; more are not a matter of single places, but of the field.
constexpr double kLargestShare = 0.01;
constexpr std::size_t kFew = 100;
constexpr double kWorthwhile = 0.9;  // of the bad area, left by a round

struct BadColumns {
  std::vector<char> marked;  // by triangle
  std::size_t triangles = 0;
  double area = 0;
};

BadColumns badColumns(const Foliation& f) {
  BadColumns bad;
  bad.marked.assign(f.triangles.size(), 0);
  for (const std::size_t cell : badCells(f, f.nodes)) {
    const std::size_t t = f.triangleOf(cell);
    if (bad.marked[t]) continue;
    bad.marked[t] = 1;
    ++bad.triangles;
    const Triangle& c = f.triangles[t];
    bad.area += 0.5 * (f.node(0, c[1]) - f.node(0, c[0])).cross(f.node(0, c[2]) - f.node(0, c[0])).norm();
  }
  return bad;
}

}  // namespace

LocalRefinement refineAboveBadCells(GreenChart::Data& data, LineTracing& tracing, Context& context) {
  LocalRefinement result;
  const Foliation& f = data.foliation;
  BadColumns bad = badColumns(f);
  for (int round = 0; round < kRounds && bad.triangles > 0; ++round) {
    if (bad.triangles > kFew &&
        static_cast<double>(bad.triangles) > kLargestShare * static_cast<double>(f.triangles.size()))
      break;
    const std::optional<RefinedShape> finer = bisect(data.green.shape(), bad.marked);
    if (!finer) break;
    const std::size_t before = f.vertexCount;
    tracing.refineSurface(finer->shape, finer->parents);
    std::vector<std::int32_t> added(f.vertexCount - before);
    std::iota(added.begin(), added.end(), static_cast<std::int32_t>(before));
    const std::vector<std::int32_t> failed = tracing.traceAll(std::move(added), context);
    fillLines(data.foliation, failed);
    result.vertices += f.vertexCount - before;
    result.failed.insert(result.failed.end(), failed.begin(), failed.end());
    BadColumns now = badColumns(f);
    context.log(LogLevel::debug, "lines added: " + std::to_string(f.vertexCount - before) +
                                     "; triangles above bad cells: " + std::to_string(bad.triangles) +
                                     ", then " + std::to_string(now.triangles));
    const bool worthwhile = now.area < kWorthwhile * bad.area;
    bad = std::move(now);
    if (!worthwhile) break;
  }
  return result;
}

}  // namespace polestar::detail
