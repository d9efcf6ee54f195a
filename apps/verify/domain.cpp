#include "domain.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "report.h"

namespace polestar::verify {
namespace {

constexpr int kFarthest = 4096;       // from the origin, of a cell
constexpr double kMostCells = 2.7e8;  // of the box around them

struct Block {
  std::array<int, 3> first{}, last{};
};

/// "i" or "i:i'"
void readRange(const std::string& word, int& first, int& last) {
  const char* const end = word.data() + word.size();
  auto [rest, failed] = std::from_chars(word.data(), end, first);
  last = first;
  if (failed == std::errc() && rest != end && *rest == ':') {
    const auto second = std::from_chars(rest + 1, end, last);
    rest = second.ptr, failed = second.ec;
  }
  if (failed != std::errc() || rest != end || first > last || std::abs(first) > kFarthest ||
      std::abs(last) > kFarthest) {
    throw Unreadable("the cells of its domain are not to be understood at \"" + word.substr(0, 40) + "\"");
  }
}

std::vector<Block> readBlocks(std::string cells) {
  std::replace(cells.begin(), cells.end(), ';', '\n');
  std::istringstream lines(cells);
  std::vector<Block> blocks;
  for (std::string line; std::getline(lines, line);) {
    std::istringstream words(line);
    std::array<std::string, 3> word;
    if (!(words >> word[0])) continue;
    std::string more;
    if (!(words >> word[1] >> word[2]) || words >> more)
      throw Unreadable("a cell of its domain is three numbers; it has \"" + line.substr(0, 40) + "\"");
    Block block;
    for (std::size_t k = 0; k < 3; ++k) readRange(word[k], block.first[k], block.last[k]);
    blocks.push_back(block);
  }
  if (blocks.empty()) throw Unreadable("its domain has no cells");
  return blocks;
}

}  // namespace

Domain::Domain(const std::string& cells, double side) : side_(side) {
  if (!(side > 0 && std::isfinite(side))) throw Unreadable("the cells of its domain have no size");
  const std::vector<Block> blocks = readBlocks(cells);
  first_ = blocks.front().first, last_ = blocks.front().last;
  double room = 1;
  for (std::size_t k = 0; k < 3; ++k) {
    for (const Block& block : blocks) {
      first_[k] = std::min(first_[k], block.first[k]);
      last_[k] = std::max(last_[k], block.last[k]);
    }
    room *= last_[k] - first_[k] + 1.0;
  }
  if (room > kMostCells) throw Unreadable("its domain has too many cells");
  filled_.assign(static_cast<std::size_t>(room), 0);
  for (const Block& block : blocks) {
    Cell cell{};
    for (cell[0] = block.first[0]; cell[0] <= block.last[0]; ++cell[0]) {
      for (cell[1] = block.first[1]; cell[1] <= block.last[1]; ++cell[1]) {
        for (cell[2] = block.first[2]; cell[2] <= block.last[2]; ++cell[2]) {
          count_ += filled_[slot(cell)] == 0;
          filled_[slot(cell)] = 1;
        }
      }
    }
  }
}

std::size_t Domain::slot(const Cell& cell) const {
  std::size_t at = 0;
  for (std::size_t k = 0; k < 3; ++k)
    at = at * static_cast<std::size_t>(last_[k] - first_[k] + 1) +
         static_cast<std::size_t>(cell[k] - first_[k]);
  return at;
}

bool Domain::hasCell(const Cell& cell) const {
  for (std::size_t k = 0; k < 3; ++k) {
    if (cell[k] < first_[k] || cell[k] > last_[k]) return false;
  }
  return filled_[slot(cell)] != 0;
}

// A ray from the origin crosses, on each axis, cells of rising distance alone. So it leaves a set of cells
// once when every cell has its neighbours towards 0.
std::string Domain::defect() const {
  if (isBall()) return "";
  if (!hasCell({0, 0, 0})) return "cell (0, 0, 0) is missing";
  Cell cell{};
  for (cell[0] = first_[0]; cell[0] <= last_[0]; ++cell[0]) {
    for (cell[1] = first_[1]; cell[1] <= last_[1]; ++cell[1]) {
      for (cell[2] = first_[2]; cell[2] <= last_[2]; ++cell[2]) {
        if (!hasCell(cell)) continue;
        for (std::size_t k = 0; k < 3; ++k) {
          Cell inner = cell;
          inner[k] -= (cell[k] > 0) - (cell[k] < 0);
          if (hasCell(inner)) continue;
          return "cell (" + std::to_string(cell[0]) + ", " + std::to_string(cell[1]) + ", " +
                 std::to_string(cell[2]) + ") is not joined to its neighbour towards the center";
        }
      }
    }
  }
  return "";
}

double Domain::gauge(const Vec3& y) const {
  if (isBall()) return length(y);
  // From cell to cell along t y, t from 0 until the way leaves the domain at some t > 0: the gauge is 1/t.
  Cell cell{};
  double leaves[3];  // t at which the current cell ends on each axis
  for (int k = 0; k < 3; ++k) leaves[k] = y[k] == 0 ? HUGE_VAL : 0.5 * side_ / std::abs(y[k]);
  while (true) {
    const int k = static_cast<int>(std::min_element(leaves, leaves + 3) - leaves);
    if (leaves[k] == HUGE_VAL) return 0;  // the origin
    cell[static_cast<std::size_t>(k)] += y[k] > 0 ? 1 : -1;
    if (!hasCell(cell)) return 1 / leaves[k];
    leaves[k] += side_ / std::abs(y[k]);
  }
}

double Domain::volume() const {
  return isBall() ? 4 * std::numbers::pi / 3 : static_cast<double>(count_) * side_ * side_ * side_;
}

Vec3 Domain::low() const {
  if (isBall()) return {-1, -1, -1};
  return {side_ * (first_[0] - 0.5), side_ * (first_[1] - 0.5), side_ * (first_[2] - 0.5)};
}

Vec3 Domain::high() const {
  if (isBall()) return {1, 1, 1};
  return {side_ * (last_[0] + 0.5), side_ * (last_[1] + 0.5), side_ * (last_[2] + 0.5)};
}

}  // namespace polestar::verify
