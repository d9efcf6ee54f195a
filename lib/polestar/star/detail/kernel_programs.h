#pragma once
// The two small optimization problems behind a center: the point with the largest margin (linear program in
// four unknowns) and the point closest to the centroid that keeps a given margin (quadratic program in
// three). Both by cutting planes: solve on a small working set of faces, scan all faces for violated ones,
// add them, repeat. What they return is a candidate; verdicts are for exact predicates (exact_verdict.h).

#include <cstdint>
#include <vector>

#include "polestar/star/detail/half_spaces.h"

namespace polestar::detail {

/// A face with its multiplier in the optimality conditions.
struct ActiveFace {
  std::int32_t face;
  double weight;
};

struct LargestMargin {
  Vec3 center = Vec3::Zero();
  double margin = 0;  ///< min over all faces of the slack at `center`
  double bound = 0;   ///< optimum of the working set: no point has more; equals margin to about 1e-11
  std::vector<ActiveFace>
      active;  ///< weights positive, sum 1, weighted normals sum to 0, weighted offsets to the bound
  std::vector<std::int32_t> workingSet;
  int scans = 0;  ///< passes over all faces
};

/// max t subject to slack_f(c) >= t for all faces. `faces` restricts the program to these faces, empty means
/// all. The closed surface's normals span space positively, so the optimum is finite.
LargestMargin largestMargin(const HalfSpaces& halfSpaces);
LargestMargin largestMargin(const HalfSpaces& halfSpaces, const std::vector<std::int32_t>& faces);

struct ClosestCenter {
  Vec3 center = Vec3::Zero();
  std::vector<ActiveFace> active;  ///< goal - center = sum of weight * normal, weights >= 0
  int scans = 0;
};

/// min |c - goal|^2 subject to slack_f(c) >= margin for all faces, by a dual active-set method [Goldfarb,
/// Idnani 1983]. `start`: faces that are likely to be active. Precondition: some point has that margin.
ClosestCenter closestCenter(const HalfSpaces& halfSpaces, const Vec3& goal, double margin,
                            const std::vector<std::int32_t>& start = {});

}  // namespace polestar::detail
