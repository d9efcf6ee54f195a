#include "cli/points.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>

#include "cli/outputs.h"
#include "cli/text.h"
#include "polestar/core/error.h"

namespace polestar::cli {

std::vector<Vec3> parsePoints(std::istream& in, const std::string& name, const Context& context) {
  std::vector<Vec3> points;
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    context.throwIfCancelled();
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    try {
      points.push_back(parsePoint(line));
    } catch (const Error& error) {
      throw Error(Errc::io, name + ", line " + std::to_string(number) + ": " + error.what());
    }
  }
  context.throwIfCancelled();
  if (in.bad()) throw Error(Errc::io, "cannot read " + name + ": " + std::strerror(errno));
  return points;
}

std::vector<Vec3> readPoints(const std::filesystem::path& path, const Context& context) {
  if (isStandardStream(path)) return parsePoints(std::cin, "standard input", context);
  std::ifstream in(path);
  if (!in) throw Error(Errc::io, "cannot read the points of " + path.string() + ": " + std::strerror(errno));
  return parsePoints(in, path.string(), context);
}

}  // namespace polestar::cli
