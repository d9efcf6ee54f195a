#pragma once
// Lines of text as coverage of pixels. A facade: FreeType stays in the .cpp.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace polestar::detail {

/// Text as it goes onto a picture: coverage 0 to 255, rows from the top.
struct TextImage {
  int width = 0, height = 0;
  int baseline = 0;  ///< row of the line on which letters stand
  std::vector<std::uint8_t> coverage;
};

/// DejaVu Sans at one size. Glyphs follow each other from left to right, without ligatures.
/// (OpenImageIO draws text, too, but up to 2.4 at least keeps only the last six bits of what is no ASCII.)
class TextRaster {
 public:
  explicit TextRaster(int pixels);
  ~TextRaster();

  bool hasFont() const;  ///< without one every text is empty
  /// Columns that the text takes.
  int width(const std::string& utf8) const;
  TextImage draw(const std::string& utf8) const;
  /// As many of its first characters as `room` columns take, with an ellipsis where some were left out.
  std::string cut(const std::string& utf8, int room) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace polestar::detail
