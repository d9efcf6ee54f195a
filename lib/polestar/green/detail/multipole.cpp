#include "polestar/green/detail/multipole.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/green/detail/expansion_passes.h"
#include "polestar/green/detail/leaf_groups.h"
#include "polestar/green/detail/truncation_bound.h"

namespace polestar::detail {
namespace {

// Charges of a leaf, and pairs of a leaf's near work: where splitting a box further stopped to pay.
constexpr std::uint32_t kLeafCharges = 120;
constexpr double kLeafWork = 64000;
constexpr std::uint32_t kFieldLeafCharges = 48, kFieldNearCharges = 400;
constexpr std::size_t kBoxChunk = 32;

// The charges that act directly on a leaf, in single precision about `middle`.
SinglePointCharges gather(const PointCharges& sorted, std::span<const TargetTree::Range> ranges,
                          const Vec3& middle) {
  SinglePointCharges near;
  near.squaredSoftening = static_cast<float>(sorted.squaredSoftening);
  std::size_t count = 0;
  for (const TargetTree::Range& r : ranges) count += r.end - r.begin;
  for (std::vector<float>* values : {&near.x, &near.y, &near.z, &near.charge}) values->reserve(count);
  for (const TargetTree::Range& r : ranges) {
    for (std::uint32_t i = r.begin; i < r.end; ++i) {
      near.x.push_back(static_cast<float>(sorted.x[i] - middle[0]));
      near.y.push_back(static_cast<float>(sorted.y[i] - middle[1]));
      near.z.push_back(static_cast<float>(sorted.z[i] - middle[2]));
      near.charge.push_back(static_cast<float>(sorted.charge[i]));
    }
  }
  return near;
}

}  // namespace

double truncationError(int order) { return std::pow(10, -2.75 - 0.28 * order); }

int orderFor(double accuracy) {
  // At lower orders the law promises too much, and little time is left to be saved.
  int order = 6;
  while (order < kMaxOrder && truncationError(order) > accuracy) ++order;
  return order;
}

MultipoleSums::MultipoleSums(const PointCharges& places, std::span<const Vec3> targets, int order,
                             PairPrecision precision)
    : precision_(precision) {
  const std::vector<Vec3> charged = positionsOf(places);
  std::vector<Vec3> all = charged;
  all.insert(all.end(), targets.begin(), targets.end());
  SourceTree sources(charged, enclosingCube(all), kLeafCharges);
  TargetTree tree(sources, targets, kLeafWork);
  trees_ = std::make_shared<const Trees>(Trees{std::move(sources), std::move(tree), places.squaredSoftening});
  translations_ = std::make_shared<const Translations>(order);
}

MultipoleSums::MultipoleSums(std::shared_ptr<const Trees> trees, int order, PairPrecision precision)
    : trees_(std::move(trees)),
      precision_(precision),
      translations_(std::make_shared<const Translations>(order)) {}

MultipoleSums MultipoleSums::withOrder(int order, PairPrecision precision) const {
  return {trees_, order, precision};
}

void MultipoleSums::potential(std::span<const double> charge, std::span<double> potential,
                              const Context& context) const {
  const SourceTree& sources = trees_->sources;
  const TargetTree& targets = trees_->targets;
  const PointCharges sorted = sortedCharges(sources, charge, trees_->squaredSoftening);
  const std::vector<double> local = localExpansions(sources, targets, sorted, *translations_, context);
  const int order = translations_->order();
  const std::span<const OctreeBox> boxes = targets.boxes();
  const std::span<const std::uint32_t> place = targets.points().order();
  parallelChunks(boxes.size(), kBoxChunk, context, [&](std::size_t begin, std::size_t end) {
    std::vector<double> values;
    std::vector<Vec3> points;
    std::vector<Eigen::Vector3f> singlePoints;
    for (std::size_t b = begin; b < end; ++b) {
      const OctreeBox& box = boxes[b];
      if (!box.isLeaf()) continue;
      const PointView view = targets.points().view(box.begin, box.end);
      points.resize(view.count);
      values.resize(view.count);
      for (std::size_t i = 0; i < view.count; ++i) points[i] = Vec3(view.x[i], view.y[i], view.z[i]);
      const std::span<const TargetTree::Range> near = targets.near(static_cast<std::uint32_t>(b));
      if (precision_ == PairPrecision::single) {
        const Vec3 middle = frameOf(sources.cube(), box).center;
        singlePoints.resize(view.count);
        for (std::size_t i = 0; i < view.count; ++i) singlePoints[i] = (points[i] - middle).cast<float>();
        sumPotential(gather(sorted, near, middle), singlePoints, values);
      } else {
        sumPotential(gatherCharges(sorted, near), points, values);
      }
      if (box.level >= 1) {
        addLocalPotential(order, frameOf(sources.cube(), box), &local[expansionSize(order) * b], view,
                          values.data());
      }
      for (std::size_t i = 0; i < view.count; ++i) potential[place[box.begin + i]] = values[i];
    }
  });
}

std::vector<double> MultipoleSums::truncation(std::span<const double> charge) const {
  const PointCharges sorted = sortedCharges(trees_->sources, charge, trees_->squaredSoftening);
  return TruncationBound(trees_->sources, trees_->targets, sorted, translations_->order()).atTargets();
}

MultipoleField::MultipoleField(const PointCharges& charges, int order, double finest, const Context& context,
                               double truncation)
    : order_(order),
      sources_(positionsOf(charges), enclosingCube(positionsOf(charges)), kFieldLeafCharges),
      targets_(sources_, kFieldNearCharges, finest / sources_.cube().side),
      charges_(sortedCharges(sources_, charges.charge, charges.squaredSoftening)) {
  auto exceeds = [&] { return std::isfinite(truncation) && this->truncation() > truncation; };
  while (order_ < kMaxOrder && exceeds()) ++order_;
  local_ = localExpansions(sources_, targets_, charges_, Translations(order_), context);
}

double MultipoleField::truncation() const {
  return TruncationBound(sources_, targets_, charges_, order_).anywhere();
}

void MultipoleField::evaluate(std::span<const Vec3> points, std::span<double> potential,
                              std::span<Vec3> gradient, const Context& context) const {
  auto leaf = [&](std::uint32_t b, std::span<const std::uint32_t> indices, std::span<const Vec3> group) {
    std::vector<double> value(group.size());
    std::vector<Vec3> slope(group.size());
    sumPotentialAndGradient(gatherCharges(charges_, targets_.near(b)), group, value, slope);
    addLocalPotentialAndGradient(order_, frameOf(sources_.cube(), targets_.boxes()[b]),
                                 &local_[expansionSize(order_) * b], group, value.data(), slope.data());
    for (std::size_t i = 0; i < group.size(); ++i) {
      potential[indices[i]] = value[i];
      gradient[indices[i]] = slope[i];
    }
  };
  forPointBlocks(points.size(), context, [&](std::size_t begin, std::size_t end) {
    visitLeafGroups(
        points, begin, end, [&](const Vec3& p) { return targets_.locate(sources_.cube(), p); }, leaf);
  });
}

}  // namespace polestar::detail
