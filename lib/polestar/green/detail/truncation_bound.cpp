#include "polestar/green/detail/truncation_bound.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

const double kHalfDiagonal = std::sqrt(0.75);  // of a box, in sides

// Magnitudes of the charges of a box; lengths in its sides.
struct BoxMoments {
  double charge = 0;  // sum |q|
  double high = 0;    // sum |q| (a_j / half diagonal)^(order + 1)
};

using Of = TruncationBound::Of;

// Sum over n, m > order of C(n+m, n) (half diagonal)^(n+m) / r^(n+m+1); of gradients, of m / half diagonal
// times as much.
double doubleTail(int order, double r, Of what) {
  const double share = kHalfDiagonal / r;  // < 1/2, since boxes that are translated do not touch
  // Diagonals n + m = N have at most (2 share)^N together, N times as much for gradients.
  constexpr double kNegligible = 1e-24;
  const int last = std::max(2 * order + 2,
                            static_cast<int>(std::log(kNegligible * (1 - 2 * share)) / std::log(2 * share)));
  double sum = kNegligible * (what == Of::gradient ? 2 * last / (1 - 2 * share) : 1);
  // term(n, m), row by row; the first of each row from that of the row before.
  double first = 1;
  for (int n = 1; n <= order + 1; ++n) first *= share * (order + 1 + n) / n;
  first *= std::pow(share, order + 1);
  for (int n = order + 1; n + order + 1 <= last; ++n) {
    double term = first;
    for (int m = order + 1; n + m <= last; ++m) {
      sum += what == Of::gradient ? m * term : term;
      term *= share * (n + m + 1) / (m + 1);
    }
    first *= share * (n + 1 + order + 1) / (n + 1);
  }
  return sum / (what == Of::gradient ? r * kHalfDiagonal : r);
}

// Distance from the center of a box to the nearest point of another one, `offset` sides away.
double toNearestPoint(const std::array<int, 3>& offset) {
  double squared = 0;
  for (const int d : offset) squared += std::pow(std::max(0.0, std::abs(d) - 0.5), 2);
  return std::sqrt(squared);
}

// Tails of expansions at a distance D of charges from a center, b the half diagonal, s = b/D: of potentials
// sum s^n/D = s^(order + 1)/(D - b), whichever side is expanded.
double potentialTail(int order, double distance) {
  return std::pow(kHalfDiagonal / distance, order + 1) / (distance - kHalfDiagonal);
}
// Of gradients of multipole expansions: sum (n + 1) s^n / D^2, n > order.
double multipoleSlopeTail(int order, double distance) {
  const double s = kHalfDiagonal / distance, rest = 1 / (1 - s);
  return std::pow(s, order + 1) * rest * (order + 2 + s * rest) / (distance * distance);
}
// Of gradients of local expansions: sum m s^(m - 1) / D^2, m > order.
double localSlopeTail(int order, double distance) {
  const double s = kHalfDiagonal / distance, rest = 1 / (1 - s);
  return std::pow(s, order) * rest * (order + 1 + s * rest) / (distance * distance);
}

}  // namespace

TruncationBound::TruncationBound(const SourceTree& sources, const TargetTree& targets,
                                 const PointCharges& sorted, int order, Of what)
    : sources_(sources),
      targets_(targets),
      power_(what == Of::gradient ? order : order + 1),
      terms_(targets.boxes().size()),
      parent_(targets.boxes().size()) {
  const Cube& cube = sources.cube();
  const std::span<const OctreeBox> boxes = sources.boxes();
  std::vector<BoxMoments> moments(boxes.size());
  parallelChunks(boxes.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t s = begin; s < end; ++s) {
      if (boxes[s].level < 2) continue;  // they touch everything
      const ExpansionFrame frame = frameOf(cube, boxes[s]);
      const double scale = 1 / (frame.scale * frame.scale * kHalfDiagonal * kHalfDiagonal);
      for (std::uint32_t j = boxes[s].begin; j < boxes[s].end; ++j) {
        const Vec3 offset = Vec3(sorted.x[j], sorted.y[j], sorted.z[j]) - frame.center;
        const double magnitude = std::abs(sorted.charge[j]);
        moments[s].charge += magnitude;
        moments[s].high += magnitude * std::pow(scale * offset.squaredNorm(), 0.5 * (order + 1));
      }
    }
  });

  std::map<int, double> tails;  // by the squared length of the offset
  for (int x = 0; x <= 3; ++x) {
    for (int y = 0; y <= x; ++y) {
      for (int z = 0; z <= y; ++z) {
        const int squared = x * x + y * y + z * z;
        if (x >= 2 && !tails.contains(squared)) tails[squared] = doubleTail(order, std::sqrt(squared), what);
      }
    }
  }
  for (std::uint32_t level = 1; level + 1 < targets.levelStart().size(); ++level) {
    const std::span<const TargetTree::Chunk> chunks = targets.chunks(level);
    const double side = std::ldexp(cube.side, -static_cast<int>(level));
    const double unit = what == Of::gradient ? side * side : side;
    const auto multipoleTail = what == Of::gradient ? multipoleSlopeTail : potentialTail;
    const auto localTail = what == Of::gradient ? localSlopeTail : potentialTail;
    parallelChunks(chunks.size(), 1, [&](std::size_t c, std::size_t) {
      for (const TargetTree::Group& group : targets.groups(chunks[c])) {
        const auto& o = group.offset;
        const double both = tails.at(o[0] * o[0] + o[1] * o[1] + o[2] * o[2]) / unit;
        const double toNearest = toNearestPoint(o);
        const double above = multipoleTail(order, toNearest) / unit,
                     below = localTail(order, toNearest) / unit;
        for (const Translations::Pair& pair : targets.pairs(group)) {
          const BoxMoments& source = moments[pair.source];
          terms_[pair.target].fixed += above * source.high;
          terms_[pair.target].growing += below * source.charge + both * source.high;
        }
      }
      for (std::uint32_t b = chunks[c].boxes.begin; b < chunks[c].boxes.end; ++b) {
        const Vec3 center = frameOf(cube, targets.boxes()[b]).center;
        for (const std::uint32_t s : targets.singles(b)) {
          for (std::uint32_t j = boxes[s].begin; j < boxes[s].end; ++j) {
            const double distance = (Vec3(sorted.x[j], sorted.y[j], sorted.z[j]) - center).norm() / side;
            terms_[b].growing += std::abs(sorted.charge[j]) * localTail(order, distance) / unit;
          }
        }
      }
    });
  }
  for (std::uint32_t b = 0; b < targets.boxes().size(); ++b) {
    const OctreeBox& box = targets.boxes()[b];
    for (std::uint32_t c = 0; c < box.childCount; ++c) parent_[box.firstChild + c] = b;
  }
}

// For targets in a leaf within the box from low to high.
double TruncationBound::at(std::uint32_t leaf, const Vec3& low, const Vec3& high) const {
  double sum = 0;
  for (std::uint32_t b = leaf; targets_.boxes()[b].level >= 1; b = parent_[b]) {
    const ExpansionFrame frame = frameOf(sources_.cube(), targets_.boxes()[b]);
    const Vec3 farthest = (high - frame.center).cwiseAbs().cwiseMax((low - frame.center).cwiseAbs());
    const double share = farthest.norm() / (kHalfDiagonal * frame.scale);
    sum += terms_[b].fixed + terms_[b].growing * std::pow(share, power_);
  }
  return sum;
}

std::vector<double> TruncationBound::atTargets() const {
  const std::span<const std::uint32_t> order = targets_.points().order();
  const std::span<const OctreeBox> boxes = targets_.boxes();
  std::vector<double> result(order.size());
  parallelChunks(boxes.size(), 32, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      if (!boxes[b].isLeaf()) continue;
      const PointView view = targets_.points().view(boxes[b].begin, boxes[b].end);
      for (std::size_t i = 0; i < view.count; ++i) {
        const Vec3 p(view.x[i], view.y[i], view.z[i]);
        result[order[boxes[b].begin + i]] = at(static_cast<std::uint32_t>(b), p, p);
      }
    }
  });
  return result;
}

double TruncationBound::anywhere() const {
  double largest = 0;
  for (std::uint32_t b = 0; b < targets_.boxes().size(); ++b) {
    if (!targets_.boxes()[b].isLeaf()) continue;
    const ExpansionFrame frame = frameOf(sources_.cube(), targets_.boxes()[b]);
    const Vec3 half = Vec3::Constant(0.5 * frame.scale);
    largest = std::max(largest, at(b, frame.center - half, frame.center + half));
  }
  return largest;
}

}  // namespace polestar::detail
