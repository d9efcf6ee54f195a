#include "random_polycube.h"

#include <algorithm>
#include <random>
#include <set>

namespace polestar::testing {

Polycube randomPolycube(const CellBox& box, std::size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::set<Cell> cells{{0, 0, 0}};
  const auto fits = [&](const Cell& cell) {
    if (!box.contains(cell) || cells.contains(cell)) return false;
    for (int axis = 0; axis < 3; ++axis) {
      Cell inner = cell;
      inner[axis] += cell[axis] > 0 ? -1 : 1;
      if (cell[axis] != 0 && !cells.contains(inner)) return false;
    }
    return true;
  };
  while (cells.size() < count) {
    std::vector<Cell> possible;
    for (const Cell& cell : cells) {
      for (int axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
          Cell beside = cell;
          beside[axis] += step;
          if (fits(beside)) possible.push_back(beside);
        }
      }
    }
    if (possible.empty()) break;
    cells.insert(possible[random() % possible.size()]);
  }
  return verifyPolycube({cells.begin(), cells.end()});
}

}  // namespace polestar::testing
