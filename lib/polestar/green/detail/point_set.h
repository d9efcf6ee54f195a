#pragma once
// The points at which a surface is looked at, shared by the triangles that meet in them.

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "polestar/core/types.h"

namespace polestar::detail {

/// Points, each once: a point that two triangles ask for has the same coordinates from both.
class PointSet {
 public:
  /// The number of the point; a new one is the last.
  std::uint32_t add(const Vec3& p) {
    const auto [place, isNew] = index_.try_emplace(p, static_cast<std::uint32_t>(points_.size()));
    if (isNew) points_.push_back(p);
    return place->second;
  }
  std::span<const Vec3> points() const { return points_; }

 private:
  struct Hash {
    std::size_t operator()(const Vec3& p) const {
      std::uint64_t hash = 0;
      for (int k = 0; k < 3; ++k)
        hash = (hash ^ std::bit_cast<std::uint64_t>(p[k])) * 0x9e3779b97f4a7c15u + (hash >> 29);
      return static_cast<std::size_t>(hash ^ hash >> 32);
    }
  };
  struct Same {
    bool operator()(const Vec3& a, const Vec3& b) const { return a == b; }
  };
  std::vector<Vec3> points_;
  std::unordered_map<Vec3, std::uint32_t, Hash, Same> index_;
};

}  // namespace polestar::detail
