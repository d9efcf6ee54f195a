#include "polestar/green/detail/gradient_sums.h"

#include <algorithm>

#include "polestar/core/detail/parallel.h"
#include "polestar/green/detail/expansion_passes.h"
#include "polestar/green/detail/solid_harmonics.h"
#include "polestar/green/detail/truncation_bound.h"

namespace polestar::detail {
namespace {

// Gradients cost about twice what potentials do, by pairs as well as by expansions: as in MultipoleSums.
constexpr std::uint32_t kLeafCharges = 120;
constexpr double kLeafWork = 32000;
constexpr std::size_t kBoxChunk = 32;

SourceTree treeOf(const PointCharges& charges, std::span<const Vec3> points) {
  const std::vector<Vec3> places = positionsOf(charges);
  std::vector<Vec3> all = places;
  all.insert(all.end(), points.begin(), points.end());
  return {places, enclosingCube(all), kLeafCharges};
}

}  // namespace

GradientSums::GradientSums(const PointCharges& charges, std::span<const Vec3> points)
    : sources_(treeOf(charges, points)),
      targets_(sources_, points, kLeafWork),
      sorted_(sortedCharges(sources_, charges.charge, charges.squaredSoftening)) {}

std::vector<double> GradientSums::truncation(int order) const {
  return TruncationBound(sources_, targets_, sorted_, order, TruncationBound::Of::gradient).atTargets();
}

void GradientSums::evaluate(int order, std::span<Vec3> gradient, const Context& context) const {
  const std::vector<double> local =
      localExpansions(sources_, targets_, sorted_, Translations(order), context);
  const std::span<const OctreeBox> boxes = targets_.boxes();
  const std::span<const std::uint32_t> place = targets_.points().order();
  parallelChunks(boxes.size(), kBoxChunk, context, [&](std::size_t begin, std::size_t end) {
    std::vector<Vec3> points, slope;
    std::vector<double> value;
    for (std::size_t b = begin; b < end; ++b) {
      const OctreeBox& box = boxes[b];
      if (!box.isLeaf()) continue;
      const PointView view = targets_.points().view(box.begin, box.end);
      points.resize(view.count);
      value.assign(view.count, 0.0);
      slope.assign(view.count, Vec3::Zero());
      for (std::size_t i = 0; i < view.count; ++i) points[i] = Vec3(view.x[i], view.y[i], view.z[i]);
      sumPotentialAndGradient(gatherCharges(sorted_, targets_.near(static_cast<std::uint32_t>(b))), points,
                              value, slope);
      if (box.level >= 1) {
        addLocalPotentialAndGradient(order, frameOf(sources_.cube(), box), &local[expansionSize(order) * b],
                                     points, value.data(), slope.data());
      }
      for (std::size_t i = 0; i < view.count; ++i) gradient[place[box.begin + i]] = slope[i];
    }
  });
}

}  // namespace polestar::detail
