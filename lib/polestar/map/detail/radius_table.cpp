#include "polestar/map/detail/radius_table.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kChunk = 512;

/// Side 2 k and 2 k + 1: where component k is -1 and 1.
Vec3 nodeDirection(std::size_t side, double row, double column) {
  const auto axis = static_cast<int>(side / 2);
  Vec3 d;
  d[axis] = side % 2 == 0 ? -1 : 1;
  d[(axis + 1) % 3] = column;
  d[(axis + 2) % 3] = row;
  return d;
}

}  // namespace

RadiusTable::RadiusTable(const StarShape& shape, int intervals)
    : intervals_(intervals),
      values_(6 * static_cast<std::size_t>(intervals + 1) * static_cast<std::size_t>(intervals + 1)) {
  const TriMesh& mesh = shape.mesh();
  const SphereLocator surface(mesh.vertices, mesh.triangles);
  const auto nodes = static_cast<std::size_t>(intervals + 1);
  parallelChunks(values_.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto along = [&](std::size_t k) { return 2.0 * static_cast<double>(k) / intervals - 1; };
      const Vec3 d = nodeDirection(i / (nodes * nodes), along(i / nodes % nodes), along(i % nodes));
      const auto hit = surface.locate(d);
      values_[i] = hit ? static_cast<float>(std::log(surface.point(*hit).norm())) : 0.0f;
    }
  });
}

double RadiusTable::operator()(const Vec3& direction) const {
  int axis;
  const double largest = direction.cwiseAbs().maxCoeff(&axis);
  const std::size_t side = 2 * static_cast<std::size_t>(axis) + (direction[axis] > 0);
  const auto place = [&](int k) { return 0.5 * intervals_ * (direction[k % 3] / largest + 1); };
  const double x = place(axis + 1), y = place(axis + 2);
  const int column = std::clamp(static_cast<int>(x), 0, intervals_ - 1),
            row = std::clamp(static_cast<int>(y), 0, intervals_ - 1);
  const double a = x - column, b = y - row;
  const auto nodes = static_cast<std::size_t>(intervals_ + 1);
  const float* v = values_.data() + (side * nodes + static_cast<std::size_t>(row)) * nodes + column;
  return (1 - b) * ((1 - a) * v[0] + a * v[1]) + b * ((1 - a) * v[nodes] + a * v[nodes + 1]);
}

}  // namespace polestar::detail
