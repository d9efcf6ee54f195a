#include "polestar/polycube/polycube_text.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <set>
#include <sstream>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar {
namespace {

constexpr int kFarthest = Polycube::kLargestIndex;

/// One line of a text, and how to complain about it.
struct Line {
  const std::string& name;
  std::size_t number;

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Errc::io, name + ": line " + std::to_string(number) + ": " + what);
  }
};

/// A piece of the line between quotes, short and printable whatever it holds.
std::string excerpt(std::string_view text) {
  constexpr std::size_t kLongest = 24;
  std::string result = "'";
  for (const char c : text.substr(0, kLongest)) result += c >= ' ' && c <= '~' ? c : '?';
  return result + (text.size() > kLongest ? "...'" : "'");
}

int indexFrom(std::string_view text, const Line& line) {
  int value = 0;
  const char* begin = text.starts_with('+') ? text.data() + 1 : text.data();
  const char* end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error != std::errc() || stop != end)
    line.fail(excerpt(text) + " is neither a whole number nor a range such as -2:2");
  if (value < -kFarthest || value > kFarthest) {
    line.fail(excerpt(text) + " is farther than " + std::to_string(kFarthest) +
              " cells from the center; make the cells larger");
  }
  return value;
}

CellBox boxFrom(std::string_view text, const Line& line) {
  CellBox box;
  int axis = 0;
  std::istringstream words{std::string(text)};
  for (std::string word; words >> word; ++axis) {
    if (axis == 3) line.fail("more than three numbers or ranges; give one cell or box of cells a line");
    const std::size_t colon = word.find(':');
    box.min[axis] = indexFrom(std::string_view(word).substr(0, colon), line);
    box.max[axis] =
        colon == word.npos ? box.min[axis] : indexFrom(std::string_view(word).substr(colon + 1), line);
    if (box.min[axis] > box.max[axis])
      line.fail(excerpt(word) + " runs backwards; the smaller number comes first");
  }
  if (axis < 3) line.fail("three numbers or ranges are due, such as 0 0 0 or -2:2 0 0");
  return box;
}

void addCells(const CellBox& box, std::set<Cell>& cells) {
  for (int i = box.min[0]; i <= box.max[0]; ++i) {
    for (int j = box.min[1]; j <= box.max[1]; ++j) {
      for (int k = box.min[2]; k <= box.max[2]; ++k) cells.insert(cells.end(), {i, j, k});
    }
  }
}

}  // namespace

std::string toText(const Polycube& polycube) {
  const std::span<const Cell> cells = polycube.cells();
  std::string text;
  for (std::size_t first = 0; first < cells.size();) {
    // Every row of cells is one interval.
    std::size_t last = first;
    while (last + 1 < cells.size() && cells[last + 1][0] == cells[first][0] &&
           cells[last + 1][1] == cells[first][1])
      ++last;
    text += toString(cells[first]);
    if (last > first) text += ":" + std::to_string(cells[last][2]);
    text += '\n';
    first = last + 1;
  }
  return text;
}

Polycube polycubeFromText(std::string_view text, const std::string& name) {
  std::set<Cell> cells;
  Line line{name, 0};
  while (!text.empty()) {
    ++line.number;
    const std::size_t end = text.find_first_of("\n;");
    const std::string_view content = text.substr(0, std::min(end, text.find('#')));
    if (content.find_first_not_of(" \t\r\v\f") != content.npos) addCells(boxFrom(content, line), cells);
    text.remove_prefix(end == text.npos ? text.size() : end + 1);
  }
  try {
    return verifyPolycube({cells.begin(), cells.end()});
  } catch (const Error& error) {
    throw Error(error.code(), name + ": " + error.what());
  }
}

Polycube readPolycube(const std::filesystem::path& path) {
  const auto fail = [&](const char* what) {
    throw Error(Errc::io, "cannot read " + path.string() + ": " + what);
  };
  std::error_code error;
  if (!std::filesystem::exists(path, error)) fail("there is no such file; check the name");
  if (!std::filesystem::is_regular_file(path, error)) fail("it is no file of text");
  std::ifstream in(path, std::ios::binary);
  if (!in) fail("it cannot be opened; check its permissions");
  std::ostringstream text;
  text << in.rdbuf();
  return polycubeFromText(text.str(), path.string());
}

void writePolycube(const std::filesystem::path& path, const Polycube& polycube) {
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << "# polestar polycube: cells and rows of cells, the center in the middle of 0 0 0\n"
        << toText(polycube);
    out.close();
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + ": the disk may be full");
  });
}

}  // namespace polestar
