#include "polestar/certify/voxel_untangling.h"

#include <Eigen/LU>
#include <algorithm>
#include <bit>
#include <cmath>
#include <unordered_map>
#include <utility>

#include "polestar/core/detail/untangle_tets.h"

namespace polestar {
namespace {

constexpr int kBorder = 2;
constexpr std::size_t kCornerTets = 8;  // of a cell
constexpr int kRings[] = {0, 1, 2};
/// A corner of a cell is the reference of its own tetrahedron unless its determinant is below this share of
/// the patch's mean Jacobian's.
constexpr double kSoundShare = 0.2;
constexpr int kAttempts = 6;
constexpr double kMostMove = 2;  // of the mean length of the images of a patch's voxel steps
/// Of a patch: 20 ms each at worst, and hundreds are no accident of sampling.
constexpr std::size_t kMostSamples = 1500;

using Place = std::array<int, 3>;

/// A tetrahedron between corners of a cell, positive where the cell is not deformed. Corners are numbered by
/// their steps along the axes, the last axis first.
struct CubeTet {
  std::array<int, 4> corner;
  Mat3 edges;  ///< in the lattice
};

CubeTet cubeTet(std::array<int, 4> corner) {
  const auto steps = [](int c) { return Vec3(c >> 2 & 1, c >> 1 & 1, c & 1); };
  CubeTet tet{corner, {}};
  for (int k = 0; k < 3; ++k) tet.edges.col(k) = steps(corner[k + 1]) - steps(corner[0]);
  if (tet.edges.determinant() >= 0) return tet;
  std::swap(tet.corner[2], tet.corner[3]);
  tet.edges.col(1).swap(tet.edges.col(2));
  return tet;
}

/// Whether one of them is a neighbour of the three others.
bool isAtCorner(const std::array<int, 4>& corner) {
  return std::any_of(corner.begin(), corner.end(), [&](int a) {
    return std::all_of(corner.begin(), corner.end(),
                       [&](int b) { return std::popcount(unsigned(a ^ b)) < 2; });
  });
}

/// At the eight corners first, then all others that are not flat. Where all 58 are positive, so is the
/// trilinear Jacobian [Ushakova 2001]; eight are often enough.
const std::vector<CubeTet>& cubeTets() {
  static const std::vector<CubeTet> tets = [] {
    std::vector<CubeTet> all;
    for (int c = 0; c < 8; ++c) all.push_back(cubeTet({c, c ^ 4, c ^ 2, c ^ 1}));
    for (int a = 0; a < 8; ++a) {
      for (int b = a + 1; b < 8; ++b) {
        for (int c = b + 1; c < 8; ++c) {
          for (int d = c + 1; d < 8; ++d) {
            const CubeTet tet = cubeTet({a, b, c, d});
            if (tet.edges.determinant() > 0.5 && !isAtCorner({a, b, c, d})) all.push_back(tet);
          }
        }
      }
    }
    return all;
  }();
  return tets;
}

class Untangling {
 public:
  Untangling(const VoxelBlock& block, const IsOutside& outside)
      : block_(block), outside_(outside), n_(block.size), rest_(block.rest.begin(), block.rest.end()) {}

  MendedBlock run(const Context& context) {
    for (const std::size_t tets : {kCornerTets, cubeTets().size()}) {
      tetsOfACell_ = tets;
      for (const int rings : kRings) {
        for (const std::vector<std::size_t>& patch : patchesAround(deepInvertedCells(now()), rings)) {
          if (patch.size() <= kMostSamples) mend(patch, context);
        }
      }
    }
    return mendedBlock(block_, std::move(rest_));
  }

 private:
  std::size_t at(const Place& p) const { return (static_cast<std::size_t>(p[0]) * n_ + p[1]) * n_ + p[2]; }
  Place placeOf(std::size_t id) const {
    const auto n = static_cast<std::size_t>(n_);
    return {static_cast<int>(id / (n * n)), static_cast<int>(id / n % n), static_cast<int>(id % n)};
  }
  VoxelBlock now() const {
    VoxelBlock block = block_;
    block.rest = rest_;
    return block;
  }

  template <class Visit>
  static void visitAround(const Place& p, int rings, Visit&& visit) {
    for (int a = -rings; a <= rings; ++a) {
      for (int b = -rings; b <= rings; ++b) {
        for (int c = -rings; c <= rings; ++c) visit(Place{p[0] + a, p[1] + b, p[2] + c});
      }
    }
  }
  static Place corner(const Place& cell, int c) {
    return {cell[0] + (c >> 2), cell[1] + (c >> 1 & 1), cell[2] + (c & 1)};
  }

  bool movable(const Place& p) const {
    const auto [low, high] = std::minmax({p[0], p[1], p[2]});
    if (low < kBorder || high >= n_ - kBorder) return false;
    bool known = true;
    visitAround(p, 1, [&](const Place& q) { known = known && block_.active[at(q)]; });
    return known;
  }

  // Samples that may move, as sets that share no cell.
  std::vector<std::vector<std::size_t>> patchesAround(const std::vector<Place>& bad, int rings) const {
    std::vector<char> state(rest_.size(), 0);  // 1: may move, 2: in a patch
    std::vector<std::size_t> all;
    for (const Place& cell : bad) {
      for (int c = 0; c < 8; ++c) {
        visitAround(corner(cell, c), rings, [&](const Place& p) {
          if (*std::min_element(p.begin(), p.end()) < 0 || *std::max_element(p.begin(), p.end()) >= n_)
            return;
          if (state[at(p)] || !movable(p)) return;
          state[at(p)] = 1;
          all.push_back(at(p));
        });
      }
    }
    std::sort(all.begin(), all.end());
    std::vector<std::vector<std::size_t>> patches;
    for (const std::size_t seed : all) {
      if (state[seed] != 1) continue;
      std::vector<std::size_t> patch{seed};
      state[seed] = 2;
      for (std::size_t i = 0; i < patch.size(); ++i) {
        visitAround(placeOf(patch[i]), 1, [&](const Place& p) {
          if (state[at(p)] != 1) return;
          state[at(p)] = 2;
          patch.push_back(at(p));
        });
      }
      std::sort(patch.begin(), patch.end());
      patches.push_back(std::move(patch));
    }
    return patches;
  }

  // Lowest corners of the cells around the samples of a patch, each once.
  std::vector<Place> cellsAround(const std::vector<std::size_t>& patch) const {
    std::vector<std::size_t> cells;
    for (const std::size_t id : patch) {
      const Place p = placeOf(id);
      for (int c = 0; c < 8; ++c) cells.push_back(at({p[0] - (c >> 2), p[1] - (c >> 1 & 1), p[2] - (c & 1)}));
    }
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    std::vector<Place> places;
    for (const std::size_t id : cells) places.push_back(placeOf(id));
    return places;
  }

  CellQuality judge(const std::vector<Place>& cells) const {
    CellQuality total;
    std::array<Vec3f, 8> rest;
    std::array<float, 8> distance;
    std::array<std::uint8_t, 8> active;
    for (const Place& cell : cells) {
      for (int c = 0; c < 8; ++c) {
        const std::size_t id = at(corner(cell, c));
        rest[c] = rest_[id];
        distance[c] = block_.signedDistance[id];
        active[c] = block_.active[id];
      }
      total += judgeCells({2, rest, distance, active, block_.voxelSize});
    }
    return total;
  }

  struct CellTet {
    std::array<std::size_t, 4> sample;
    Mat3 steps;  // its edges in the lattice
    Mat3 edges;  // their images
  };

  CellTet cellTet(const Place& cell, const CubeTet& corners) const {
    CellTet tet;
    for (int k = 0; k < 4; ++k) tet.sample[k] = at(corner(cell, corners.corner[k]));
    tet.steps = corners.edges;
    for (int k = 0; k < 3; ++k)
      tet.edges.col(k) = (rest_[tet.sample[k + 1]] - rest_[tet.sample[0]]).cast<double>();
    return tet;
  }

  // Samples that would leave the domain stay where they are, and the others try again without them.
  void mend(std::vector<std::size_t> patch, const Context& context) {
    for (int attempt = 0; attempt < kAttempts && !patch.empty(); ++attempt) {
      const std::vector<Vec3> places = solve(patch, context);
      if (places.empty()) return;
      const std::vector<std::size_t> leaving = thatLeave(patch, places);
      if (leaving.empty()) return take(patch, places);
      std::erase_if(patch, [&](std::size_t sample) {
        return std::binary_search(leaving.begin(), leaving.end(), sample);
      });
    }
  }

  // The solid's samples alone have to lie in the domain.
  std::vector<std::size_t> thatLeave(const std::vector<std::size_t>& patch,
                                     const std::vector<Vec3>& places) const {
    const std::vector<char> outside = outside_(places);
    std::vector<std::size_t> leaving;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      if (outside[i] && block_.signedDistance[patch[i]] < 0) leaving.push_back(patch[i]);
    }
    return leaving;
  }

  std::vector<Vec3> solve(const std::vector<std::size_t>& patch, const Context& context) const {
    const std::vector<Place> cells = cellsAround(patch);
    std::vector<CellTet> tets;
    Mat3 mean = Mat3::Zero();
    for (const Place& cell : cells) {
      for (std::size_t t = 0; t < tetsOfACell_; ++t) {
        tets.push_back(cellTet(cell, cubeTets()[t]));
        if (t < kCornerTets) mean += tets.back().edges * tets.back().steps.transpose();
      }
    }
    mean /= static_cast<double>(kCornerTets * cells.size());
    const double share = mean.determinant();
    if (!(share > 0)) return {};

    detail::TetPatch problem;
    std::unordered_map<std::size_t, std::uint32_t> slots;
    const auto slot = [&](std::size_t sample) {
      const auto [found, isNew] = slots.try_emplace(sample, static_cast<std::uint32_t>(problem.nodes.size()));
      if (isNew) problem.nodes.push_back(rest_[sample].cast<double>());
      return found->second;
    };
    for (const std::size_t sample : patch) slot(sample);
    problem.free = patch.size();
    for (const CellTet& tet : tets) {
      const bool sound = tet.edges.determinant() > kSoundShare * share * tet.steps.determinant();
      detail::TetPatch::Tet element{{}, sound ? tet.edges : Mat3(mean * tet.steps)};
      for (int k = 0; k < 4; ++k) element.node[k] = slot(tet.sample[k]);
      problem.tets.push_back(element);
    }
    return detail::untangleTets(std::move(problem), context);
  }

  // Unless that would do no good, or cover up what really folds.
  void take(const std::vector<std::size_t>& patch, const std::vector<Vec3>& places) {
    const std::vector<Place> cells = cellsAround(patch);
    const double most = kMostMove * meanStep(cells);
    const CellQuality before = judge(cells);
    std::vector<Vec3f> old;
    bool near = true;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      near = near && (places[i] - block_.rest[patch[i]].cast<double>()).norm() <= most;
      old.push_back(rest_[patch[i]]);
      rest_[patch[i]] = places[i].cast<float>();
    }
    const CellQuality after = judge(cells);
    if (near && after.invertedDeep < before.invertedDeep && after.inverted <= before.inverted) return;
    for (std::size_t i = 0; i < patch.size(); ++i) rest_[patch[i]] = old[i];
  }

  double meanStep(const std::vector<Place>& cells) const {
    double sum = 0;
    for (const Place& cell : cells) sum += cellTet(cell, cubeTets()[0]).edges.colwise().norm().mean();
    return sum / static_cast<double>(cells.size());
  }

  const VoxelBlock& block_;
  const IsOutside& outside_;
  std::size_t tetsOfACell_ = kCornerTets;
  int n_;
  std::vector<Vec3f> rest_;
};

}  // namespace

MendedBlock untangleInvertedCells(const VoxelBlock& block, const IsOutside& outside, const Context& context) {
  return Untangling(block, outside).run(context);
}

}  // namespace polestar
