#include "polestar/green/detail/sparse_inverse.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/detail/simd.h"
#include "polestar/core/detail/simd_math.h"
#include "polestar/green/detail/octree.h"

namespace polestar::detail {
namespace {

using Eigen::VectorXd;

// Vertices level by level: in cells of halving size, one vertex for each cell that none lies in yet. By place
// alone, so that a renumbered mesh has the same.
struct Levels {
  std::vector<std::int32_t> order;
  std::vector<std::size_t> start;  // of each level in `order`, and the end
  std::vector<double> cell;        // the cells' sides
};

Levels coarseToFine(const std::vector<Vec3>& vertices) {
  const Cube cube = enclosingCube(vertices);
  const SortedPoints sorted(vertices, cube);
  // The first vertex of a cell along the curve stands for it. It did so already on coarser levels if it was
  // the first of its cell there.
  std::array<std::vector<std::int32_t>, SortedPoints::kMaxLevel + 2> entering;
  for (std::size_t i = 0; i < sorted.size(); ++i)
    entering[sorted.levelApart(i)].push_back(static_cast<std::int32_t>(sorted.order()[i]));
  Levels levels;
  double cell = cube.side;
  for (const std::vector<std::int32_t>& level : entering) {
    if (!level.empty()) {
      levels.start.push_back(levels.order.size());
      levels.cell.push_back(cell);
      levels.order.insert(levels.order.end(), level.begin(), level.end());
    }
    cell *= 0.5;
  }
  levels.start.push_back(levels.order.size());
  return levels;
}

using Found = std::vector<std::pair<double, std::int32_t>>;

// The `count` places in `order` up to `last` that are nearest to it, itself among them, by distance.
void findNearest(const AabbTree& tree, const std::vector<Vec3>& vertices,
                 const std::vector<std::int32_t>& order, std::size_t last, std::size_t count,
                 double squaredRadius, Found& found) {
  const Vec3& center = vertices[order[last]];
  for (;; squaredRadius *= 2) {
    found.clear();
    tree.visitWithin(center, squaredRadius, [&](std::size_t j) {
      const double d = (vertices[order[j]] - center).squaredNorm();
      if (j <= last && d <= squaredRadius) found.emplace_back(d, static_cast<std::int32_t>(j));
      return false;
    });
    if (found.size() >= count) break;
  }
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), found.end());
  found.resize(count);
}

// Columns of L, as many at a time as a register has lanes.
struct FactorColumns {
  static constexpr int kMost = SparseInverse::kMaxNeighbours;
  const std::vector<Vec3>& vertices;
  const VectorXd& area;
  int count, size;             // columns, entries of each
  const std::int32_t* vertex;  // of the entries, the column's own vertex last; -1: none
  double* value;

  template <int kLanes>
  POLESTAR_INTO_CLONES void run() const {
    for (int first = 0; first < count; first += kLanes) factor<kLanes>(first);
  }

 private:
  static constexpr double kSelf = SparseInverse::kSelf, kPair = SparseInverse::kPair;

  // K^-1 e / sqrt(e^T K^-1 e) = C^-T e for the last unit vector e and K = C C^T.
  template <int kLanes>
  POLESTAR_INTO_CLONES void factor(int first) const {
    using V = Lanes<kLanes>;
    V x[kMost]{}, y[kMost]{}, z[kMost]{}, length[kMost]{};
    for (int l = 0; l < kLanes; ++l) {
      const std::int32_t* of = vertex + std::min(first + l, count - 1) * size;
      for (int a = 0; a < size; ++a) {
        const bool none = of[a] < 0;  // far from everything
        const Vec3 p = none ? Vec3(1e30 * (a + 1), 0, 0) : vertices[of[a]];
        x[a][l] = p[0];
        y[a][l] = p[1];
        z[a][l] = p[2];
        length[a][l] = none ? 1 : __builtin_sqrt(area[of[a]]);
      }
    }
    V rows[kMost * (kMost + 1) / 2];  // of C, lower triangle
    V inverse[kMost];                 // of its diagonal
    V least = V{} + 1;                // pivot
    V* row = rows;
    for (int a = 0; a < size; ++a) {
      const V* other = rows;
      for (int b = 0; b < a; ++b) {
        const V dx = x[a] - x[b], dy = y[a] - y[b], dz = z[a] - z[b];
        V kernel = dx * dx + dy * dy + dz * dz + kPair * kPair * length[a] * length[b];
        invertRoots(kernel);
        subtractProduct(row, other, b, kernel);
        row[b] = kernel * inverse[b];
        other += b + 1;
      }
      inverse[a] = 1 / (kSelf * length[a]);
      subtractProduct(row, row, a, inverse[a]);  // the pivot
      least = inverse[a] < least ? inverse[a] : least;
      invertRoots(inverse[a]);
      row += a + 1;
    }
    V column[kMost]{};
    column[size - 1] += 1;
    for (int a = size; a-- > 0;) {
      row -= a + 1;
      column[a] *= inverse[a];
      for (int b = 0; b < a; ++b) column[b] -= row[b] * column[a];
    }
    for (int l = 0; l < kLanes && first + l < count; ++l) {
      const std::int32_t* of = vertex + (first + l) * size;
      double* to = value + (first + l) * size;
      const bool definite = least[l] > 0;
      for (int a = 0; a < size; ++a) to[a] = of[a] < 0 || !definite ? 0 : column[a][l];
      if (!definite) to[size - 1] = __builtin_sqrt(kSelf * length[size - 1][l]);
    }
  }

  // Four sums, since one would wait for itself.
  template <class V>
  static POLESTAR_INTO_CLONES void subtractProduct(const V* a, const V* b, int size, V& from) {
    V s0{}, s1{}, s2{}, s3{};
    int i = 0;
    for (; i + 4 <= size; i += 4) {
      s0 += a[i] * b[i];
      s1 += a[i + 1] * b[i + 1];
      s2 += a[i + 2] * b[i + 2];
      s3 += a[i + 3] * b[i + 3];
    }
    for (; i < size; ++i) s0 += a[i] * b[i];
    from -= (s0 + s1) + (s2 + s3);
  }
};

}  // namespace

SparseInverse::SparseInverse(const std::vector<Vec3>& vertices, const VectorXd& area, int neighbours,
                             const Context& context)
    : size_(std::min<std::size_t>(std::min(neighbours, kMaxNeighbours), vertices.size())) {
  const Levels levels = coarseToFine(vertices);
  vertex_.resize(vertices.size() * size_);
  value_.resize(vertices.size() * size_);
  for (std::size_t level = 0; level + 1 < levels.start.size(); ++level) {
    const std::size_t first = levels.start[level], end = levels.start[level + 1];
    std::vector<Bounds> points(end);
    for (std::size_t i = 0; i < end; ++i) points[i].include(vertices[levels.order[i]]);
    const AabbTree tree(points);
    parallelChunks(end - first, 64, context, [&](std::size_t chunkBegin, std::size_t chunkEnd) {
      Found found;
      std::vector<std::int32_t> entries((chunkEnd - chunkBegin) * size_, -1);
      std::vector<double> values(entries.size());
      std::size_t at = 0;
      for (std::size_t i = first + chunkBegin; i < first + chunkEnd; ++i) {
        const std::size_t count = std::min(size_, i + 1);
        findNearest(tree, vertices, levels.order, i, count,
                    0.8 * static_cast<double>(count) * levels.cell[level] * levels.cell[level], found);
        at += size_;
        for (std::size_t a = 0; a < count; ++a) entries[at - 1 - a] = levels.order[found[a].second];
      }
      runAtSimdLevel(FactorColumns{vertices, area, static_cast<int>(chunkEnd - chunkBegin),
                                   static_cast<int>(size_), entries.data(), values.data()});
      for (std::size_t c = 0; c < entries.size(); c += size_) {
        const std::int32_t own = entries[c + size_ - 1];
        for (std::size_t a = 0; a < size_; ++a) {
          vertex_[static_cast<std::size_t>(own) * size_ + a] = std::max(entries[c + a], 0);
          value_[static_cast<std::size_t>(own) * size_ + a] = values[c + a];
        }
      }
    });
  }
  transpose();
}

void SparseInverse::transpose() {
  const std::size_t n = vertex_.size() / std::max<std::size_t>(size_, 1);
  rowStart_.assign(n + 1, 0);
  for (const std::int32_t row : vertex_) ++rowStart_[row + 1];
  for (std::size_t i = 0; i < n; ++i) rowStart_[i + 1] += rowStart_[i];
  column_.resize(vertex_.size());
  byRow_.resize(vertex_.size());
  std::vector<std::size_t> next(rowStart_.begin(), rowStart_.end() - 1);
  for (std::size_t e = 0; e < vertex_.size(); ++e) {
    const std::size_t to = next[vertex_[e]]++;
    column_[to] = static_cast<std::int32_t>(e / size_);
    byRow_[to] = value_[e];
  }
}

VectorXd SparseInverse::apply(const VectorXd& potential) const {
  constexpr std::size_t kChunk = 2048;
  const auto n = static_cast<std::size_t>(potential.size());
  VectorXd half(potential.size()), charge(potential.size());
  parallelChunks(n, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (std::size_t e = i * size_; e < (i + 1) * size_; ++e) sum += value_[e] * potential[vertex_[e]];
      half[static_cast<Eigen::Index>(i)] = sum;
    }
  });
  parallelChunks(n, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (std::size_t e = rowStart_[i]; e < rowStart_[i + 1]; ++e) sum += byRow_[e] * half[column_[e]];
      charge[static_cast<Eigen::Index>(i)] = sum;
    }
  });
  return charge;
}

}  // namespace polestar::detail
