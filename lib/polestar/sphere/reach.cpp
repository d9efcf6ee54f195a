#include "polestar/sphere/reach.h"

#include <algorithm>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {
namespace {

constexpr int kTableCells = 128;  // along a side of a face
constexpr int kTableNodes = kTableCells + 1;

}  // namespace

Vec3 throughCubeFace(std::size_t face, double u, double v) {
  const int axis = static_cast<int>(face % 3);
  Vec3 direction;
  direction[axis] = face < 3 ? 1 : -1;
  direction[(axis + 1) % 3] = u;
  direction[(axis + 2) % 3] = v;
  return direction;
}

struct ExactReach::Data {
  SphereLocator locator;
};

ExactReach::ExactReach(const StarShape& shape)
    : data_(new Data{SphereLocator(shape.mesh().vertices, shape.mesh().triangles)}) {}
ExactReach::~ExactReach() = default;

double ExactReach::reach(const Vec3& direction) const {
  const auto hit = data_->locator.locate(direction);
  // The surface of a StarShape covers the directions; rounding on a seam stays within the locator's
  // tolerance.
  if (!hit) throw Error(Errc::notStarShaped, "a ray from the center misses the surface");
  return data_->locator.point(*hit).cwiseAbs().maxCoeff();
}

ReachTable::ReachTable(const StarShape& shape, const Context& context)
    : values_(std::size_t{6} * kTableNodes * kTableNodes) {
  const ExactReach exact(shape);
  detail::parallelChunks(values_.size(), kTableNodes, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto place = [](std::size_t node) { return 2.0 * static_cast<double>(node) / kTableCells - 1; };
      const Vec3 d = throughCubeFace(i / (kTableNodes * kTableNodes), place(i / kTableNodes % kTableNodes),
                                     place(i % kTableNodes));
      values_[i] = exact.reach(d);
    }
  });
}

double ReachTable::reach(const Vec3& direction) const {
  int axis = 0;
  const double longest = direction.cwiseAbs().maxCoeff(&axis);
  const auto place = [&](int k) { return (direction[k] / longest + 1) * (0.5 * kTableCells); };
  const double u = place((axis + 1) % 3), v = place((axis + 2) % 3);
  const int i = std::min(static_cast<int>(u), kTableCells - 1),
            j = std::min(static_cast<int>(v), kTableCells - 1);
  const double a = u - i, b = v - j;
  const int face = direction[axis] < 0 ? axis + 3 : axis;
  const double* at = &values_[(static_cast<std::size_t>(face) * kTableNodes + i) * kTableNodes + j];
  return (1 - a) * ((1 - b) * at[0] + b * at[1]) + a * ((1 - b) * at[kTableNodes] + b * at[kTableNodes + 1]);
}

}  // namespace polestar
