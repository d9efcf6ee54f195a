#include "cli/render_options.h"

#include <charconv>
#include <cmath>
#include <map>
#include <vector>

#include "cli/text.h"
#include "polestar/core/error.h"

namespace polestar::cli {

CutPlane parseCut(const std::string& text) {
  const bool negative = !text.empty() && text[0] == '-';
  const std::size_t letter = negative ? 1 : 0;
  const std::size_t axis = std::string("xyz").find(letter < text.size() ? text[letter] : ' ');
  CutPlane cut;
  std::vector<double> numbers;
  if (axis != std::string::npos) {
    cut.normal = (negative ? -1 : 1) * Vec3::Unit(static_cast<Eigen::Index>(axis));
    const std::string rest = text.substr(letter + 1);
    if (!rest.empty()) numbers = parseNumbers(rest);
    if (numbers.size() <= 1 && (rest.empty() || rest[0] == ',')) {
      if (!numbers.empty()) cut.offset = numbers[0];
      return cut;
    }
  } else {
    numbers = parseNumbers(text);
    if (numbers.size() == 3 || numbers.size() == 4) {
      cut.normal = Vec3(numbers[0], numbers[1], numbers[2]);
      if (numbers.size() == 4) cut.offset = numbers[3];
      return cut;
    }
  }
  throw Error(Errc::usage, "a cut is x, -y, z,0.2, nx,ny,nz or nx,ny,nz,offset; found \"" + text + "\"");
}

void parseSize(const std::string& text, RenderOptions& options) {
  const char* const end = text.data() + text.size();
  const auto [cross, first] = std::from_chars(text.data(), end, options.width);
  if (first == std::errc() && cross != end && *cross == 'x') {
    const auto [last, second] = std::from_chars(cross + 1, end, options.height);
    if (second == std::errc() && last == end) return;
  }
  throw Error(Errc::usage, "a size is WIDTHxHEIGHT such as 1280x960; found \"" + text + "\"");
}

PixelBox parseCrop(const std::string& text) {
  const std::vector<double> numbers = parseNumbers(text);
  std::vector<int> pixels;
  for (const double number : numbers) {
    if (number == std::floor(number) && std::abs(number) < 1e6) pixels.push_back(static_cast<int>(number));
  }
  if (numbers.size() != 4 || pixels.size() != 4) {
    throw Error(Errc::usage, "a crop is x0,y0,x1,y1 in whole pixels; found \"" + text + "\"");
  }
  return {pixels[0], pixels[1], pixels[2], pixels[3]};
}

void parseBackground(const std::string& text, RenderOptions& options) {
  static const std::map<std::string, std::uint32_t> kNames{
      {"white", 0xffffff}, {"grey", 0xb0b0b0}, {"black", 0x000000}};
  options.transparent = text == "transparent";
  if (options.transparent) return;
  std::uint32_t color = 0;
  if (const auto named = kNames.find(text); named != kNames.end()) {
    color = named->second;
  } else {
    const char* const end = text.data() + text.size();
    const bool hash = text.size() == 7 && text[0] == '#';
    const auto [last, error] = std::from_chars(text.data() + (hash ? 1 : 0), end, color, 16);
    if (!hash || error != std::errc() || last != end) {
      throw Error(Errc::usage,
                  "a background is #rrggbb, white, grey, black or transparent; found \"" + text + "\"");
    }
  }
  options.background = linearFromSrgb(color);
}

}  // namespace polestar::cli
