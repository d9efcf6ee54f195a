#include "polestar/green/detail/expansion_passes.h"

#include <array>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kBoxChunk = 32;

// Multipole expansions of all boxes, from the leaves up.
std::vector<double> multipoles(const SourceTree& tree, const PointCharges& sorted, const Translations& t,
                               const Context& context) {
  const std::size_t size = expansionSize(t.order());
  const std::span<const OctreeBox> boxes = tree.boxes();
  std::vector<double> result(size * boxes.size());
  parallelChunks(boxes.size(), kBoxChunk, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      if (!boxes[b].isLeaf() || boxes[b].level < 2) continue;
      addMultipole(t.order(), frameOf(tree.cube(), boxes[b]),
                   tree.points().view(boxes[b].begin, boxes[b].end), &sorted.charge[boxes[b].begin],
                   &result[size * b]);
    }
  });
  // Levels 0 and 1 touch everything: their expansions act on nobody.
  for (std::size_t level = tree.levelStart().size() - 2; level-- > 2;) {
    const std::size_t first = tree.levelStart()[level], count = tree.levelStart()[level + 1] - first;
    parallelChunks(count, kBoxChunk * 4, context, [&](std::size_t begin, std::size_t end) {
      std::array<std::vector<Translations::Pair>, 8> byOctant;
      for (std::size_t b = first + begin; b < first + end; ++b) {
        for (std::uint32_t c = 0; c < boxes[b].childCount; ++c) {
          const std::uint32_t child = boxes[b].firstChild + c;
          byOctant[boxes[child].octant()].push_back({child, static_cast<std::uint32_t>(b)});
        }
      }
      for (int octant = 0; octant < 8; ++octant)
        t.multipoleToParent(octant, byOctant[octant], result.data(), result.data());
    });
  }
  return result;
}

}  // namespace

PointCharges sortedCharges(const SourceTree& tree, std::span<const double> charge, double squaredSoftening) {
  const std::span<const std::uint32_t> order = tree.points().order();
  const PointView view = tree.points().view(0, static_cast<std::uint32_t>(order.size()));
  PointCharges sorted{{view.x, view.x + view.count},
                      {view.y, view.y + view.count},
                      {view.z, view.z + view.count},
                      std::vector<double>(order.size()),
                      squaredSoftening};
  for (std::size_t i = 0; i < order.size(); ++i) sorted.charge[i] = charge[order[i]];
  return sorted;
}

std::vector<double> localExpansions(const SourceTree& sources, const TargetTree& targets,
                                    const PointCharges& sorted, const Translations& t,
                                    const Context& context) {
  const std::vector<double> multipole = multipoles(sources, sorted, t, context);
  const std::size_t size = expansionSize(t.order());
  const std::span<const OctreeBox> boxes = targets.boxes();
  std::vector<double> result(size * boxes.size());
  for (std::uint32_t level = 1; level + 1 < targets.levelStart().size(); ++level) {
    const std::span<const TargetTree::Chunk> chunks = targets.chunks(level);
    parallelChunks(chunks.size(), 1, context, [&](std::size_t c, std::size_t) {
      const TargetTree::Chunk& chunk = chunks[c];
      for (const TargetTree::Group& group : targets.groups(chunk))
        t.multipoleToLocal(group.offset, targets.pairs(group), multipole.data(), result.data());
      std::array<std::vector<Translations::Pair>, 8> byOctant;
      for (std::uint32_t b = chunk.boxes.begin; b < chunk.boxes.end; ++b) {
        for (const std::uint32_t s : targets.singles(b)) {
          const OctreeBox& source = sources.boxes()[s];
          addLocal(t.order(), frameOf(sources.cube(), boxes[b]),
                   sources.points().view(source.begin, source.end), &sorted.charge[source.begin],
                   &result[size * b]);
        }
        for (std::uint32_t k = 0; k < boxes[b].childCount; ++k) {
          const std::uint32_t child = boxes[b].firstChild + k;
          byOctant[boxes[child].octant()].push_back({b, child});
        }
      }
      for (int octant = 0; octant < 8; ++octant)
        t.localToChild(octant, byOctant[octant], result.data(), result.data());
    });
  }
  return result;
}

PointCharges gatherCharges(const PointCharges& sorted, std::span<const TargetTree::Range> ranges) {
  PointCharges near;
  near.squaredSoftening = sorted.squaredSoftening;
  std::size_t count = 0;
  for (const TargetTree::Range& r : ranges) count += r.end - r.begin;
  for (auto [to, from] : {std::pair{&near.x, &sorted.x}, std::pair{&near.y, &sorted.y},
                          std::pair{&near.z, &sorted.z}, std::pair{&near.charge, &sorted.charge}}) {
    to->reserve(count);
    for (const TargetTree::Range& r : ranges)
      to->insert(to->end(), from->begin() + r.begin, from->begin() + r.end);
  }
  return near;
}

}  // namespace polestar::detail
