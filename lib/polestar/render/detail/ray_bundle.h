#pragma once
// Rays by the thousand, component by component: as packets and vectorized loops want them.

#include <cstddef>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

struct RayBundle {
  std::vector<float> origin[3], direction[3];  ///< directions of unit length

  std::size_t size() const { return origin[0].size(); }
  void resize(std::size_t count) {
    for (int k = 0; k < 3; ++k) {
      origin[k].resize(count);
      direction[k].resize(count);
    }
  }
  void set(std::size_t i, const Vec3f& from, const Vec3f& towards) {
    for (int k = 0; k < 3; ++k) {
      origin[k][i] = from[k];
      direction[k][i] = towards[k];
    }
  }
  void add(const Vec3f& from, const Vec3f& towards) {
    resize(size() + 1);
    set(size() - 1, from, towards);
  }
  Vec3f originOf(std::size_t i) const { return {origin[0][i], origin[1][i], origin[2][i]}; }
  Vec3f directionOf(std::size_t i) const { return {direction[0][i], direction[1][i], direction[2][i]}; }
};

}  // namespace polestar::detail
