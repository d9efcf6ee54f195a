#include "polestar/star/detail/least_bad.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

struct Candidate {
  Vec3 center;
  double area;
};

bool better(const Candidate& a, const Candidate& b) { return a.area < b.area; }

// Compass search over the 26 neighbours of a point; the step halves when none of them is better.
Candidate refine(const HalfSpaces& halfSpaces, Candidate best, double step, double smallestStep) {
  while (step > smallestStep) {
    Candidate next = best;
    for (int dx = -1; dx <= 1; ++dx) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dz = -1; dz <= 1; ++dz) {
          const Vec3 c = best.center + step * Vec3(dx, dy, dz);
          const double area = halfSpaces.areaBehind(c);
          if (area < next.area) next = {c, area};
        }
      }
    }
    if (next.area < best.area) {
      best = next;
    } else {
      step /= 2;
    }
  }
  return best;
}

}  // namespace

Vec3 leastBadCenter(const TriMesh& mesh, const Frame& frame, const HalfSpaces& halfSpaces,
                    const std::vector<Vec3>& starts, const Context& context) {
  constexpr std::size_t kSample = 20000;
  const std::size_t stride = mesh.triangles.size() / kSample + 1;
  const HalfSpaces sample(mesh, frame, stride);

  constexpr int kGrid = 8;
  const Box box = boundingBox(mesh);
  std::vector<Candidate> candidates(kGrid * kGrid * kGrid + starts.size());
  parallelChunks(candidates.size(), 8, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Vec3 c;
      if (i < starts.size()) {
        c = starts[i];
      } else {
        const std::size_t cell = i - starts.size();
        const Vec3 share((cell % kGrid + 0.5) / kGrid, (cell / kGrid % kGrid + 0.5) / kGrid,
                         (cell / (kGrid * kGrid) + 0.5) / kGrid);
        c = frame.toInner(box.min + share.cwiseProduct(box.extent()));
      }
      candidates[i] = {c, sample.areaBehind(c)};
    }
  });
  std::stable_sort(candidates.begin(), candidates.end(), better);

  constexpr std::size_t kKept = 6;
  candidates.resize(std::min(kKept, candidates.size()));
  const double cell = box.diagonal() / frame.unit / kGrid;
  parallelChunks(candidates.size(), 1, context, [&](std::size_t begin, std::size_t) {
    candidates[begin] = refine(sample, candidates[begin], cell / 2, cell / 128);
    candidates[begin].area = halfSpaces.areaBehind(candidates[begin].center);
  });
  for (const Vec3& start : starts) candidates.push_back({start, halfSpaces.areaBehind(start)});
  return std::min_element(candidates.begin(), candidates.end(), better)->center;
}

}  // namespace polestar::detail
