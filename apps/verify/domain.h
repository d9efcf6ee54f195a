#pragma once
// What `rest` maps onto: the unit ball, or a union of the cells of a cubic lattice that is star-shaped about
// the middle of its cell (0, 0, 0).

#include <array>
#include <string>
#include <vector>

#include "vec3.h"

namespace polestar::verify {

class Domain {
 public:
  /// The unit ball about the origin.
  Domain() = default;
  /// Cells of side `side`, the origin in the middle of cell (0, 0, 0); `cells` as the files name them: "i j
  /// k" or "i:i' j k" for a row of them, blocks likewise, with semicolons or line ends between.
  /// @throws Unreadable for text that names no cells, or too many.
  Domain(const std::string& cells, double side);

  bool isBall() const { return filled_.empty(); }
  /// Why rays from the origin do not leave it once; empty when they do. Exact.
  std::string defect() const;
  /// 0 at the origin, 1 on the boundary, linear along rays: the share of the way out that y has come.
  double gauge(const Vec3& y) const;
  double volume() const;
  Vec3 low() const;  ///< corners of the box around it
  Vec3 high() const;

  bool hasCell(const std::array<int, 3>& cell) const;
  double side() const { return side_; }  ///< of a cell; 0 for the ball
  std::size_t cellCount() const { return count_; }

 private:
  using Cell = std::array<int, 3>;
  std::size_t slot(const Cell& cell) const;

  double side_ = 0;
  std::size_t count_ = 0;
  Cell first_{}, last_{};     ///< of the cells, inclusive
  std::vector<char> filled_;  ///< within that box, z fastest
};

}  // namespace polestar::verify
