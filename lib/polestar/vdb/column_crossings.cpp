#include <algorithm>
#include <cmath>
#include <utility>

#include "polestar/core/detail/parallel.h"
#include "polestar/vdb/detail/column_crossings.h"

namespace polestar::detail {
namespace {

struct RowEnd {
  double x, z;
};

// Where the edge meets row y. The ends are put in a fixed order first, so that both triangles at the edge get
// the same bits.
RowEnd meetRow(const Vec3* p, const Vec3* q, double y) {
  if (std::lexicographical_compare(q->data(), q->data() + 3, p->data(), p->data() + 3)) std::swap(p, q);
  const double t = (y - p->y()) / (q->y() - p->y());
  return {p->x() + t * (q->x() - p->x()), p->z() + t * (q->z() - p->z())};
}

// Calls visit(x, y, z) for every integer column that triangle (a, b, c) covers, at the height where it is
// met.
template <class Visit>
void forEachColumn(const Vec3& a, const Vec3& b, const Vec3& c, Visit&& visit) {
  const Vec3* corner[3] = {&a, &b, &c};
  const auto [low, high] = std::minmax({a.y(), b.y(), c.y()});
  // A row belongs to the edge with one end at or below it and the other above: two edges of the triangle, or
  // none.
  for (int y = static_cast<int>(std::ceil(low)); y < high; ++y) {
    RowEnd end[2];
    int found = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 *p = corner[k], *q = corner[(k + 1) % 3];
      if ((p->y() <= y) != (q->y() <= y)) end[found++] = meetRow(p, q, y);
    }
    if (end[0].x > end[1].x) std::swap(end[0], end[1]);
    const double slope = (end[1].z - end[0].z) / (end[1].x - end[0].x);
    for (int x = static_cast<int>(std::ceil(end[0].x)); x < end[1].x; ++x) {
      visit(x, y, end[0].z + (x - end[0].x) * slope);
    }
  }
}

}  // namespace

ColumnCrossings::ColumnCrossings(const TriMesh& surface, const Context& context) {
  const Box box = boundingBox(surface);
  xMin_ = static_cast<int>(std::floor(box.min.x()));
  yMin_ = static_cast<int>(std::floor(box.min.y()));
  xCount_ = static_cast<std::size_t>(std::ceil(box.max.x()) - xMin_ + 1);
  yCount_ = static_cast<std::size_t>(std::ceil(box.max.y()) - yMin_ + 1);

  const auto forEachCrossing = [&](auto&& visit) {
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      if (t % 65536 == 0) context.throwIfCancelled();
      forEachColumn(surface.corner(t, 0), surface.corner(t, 1), surface.corner(t, 2), visit);
    }
  };
  // Count, then fill: two passes over the triangles instead of one small vector a column.
  first_.assign(xCount_ * yCount_ + 1, 0);
  forEachCrossing([&](int x, int y, double) { ++first_[column(x, y) + 1]; });
  for (std::size_t i = 1; i < first_.size(); ++i) first_[i] += first_[i - 1];
  z_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  forEachCrossing([&](int x, int y, double z) { z_[next[column(x, y)]++] = z; });

  parallelChunks(xCount_ * yCount_, 4096, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) std::sort(z_.begin() + first_[i], z_.begin() + first_[i + 1]);
  });
}

bool ColumnCrossings::inside(int x, int y, int z) const {
  if (x < xMin_ || y < yMin_ || x >= xMin_ + static_cast<int>(xCount_) ||
      y >= yMin_ + static_cast<int>(yCount_)) {
    return false;
  }
  const std::size_t i = column(x, y);
  const auto begin = z_.begin() + first_[i], end = z_.begin() + first_[i + 1];
  return (end - std::upper_bound(begin, end, static_cast<double>(z))) % 2 == 1;
}

}  // namespace polestar::detail
