#include "polestar/io/detail/text_raster.h"

#include <ft2build.h>
#include FT_FREETYPE_H

#include <algorithm>
#include <array>

namespace polestar::detail {
namespace {

// Where distributions put it.
constexpr std::array kFontFiles{
    "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf", "/usr/share/fonts/dejavu-sans-fonts/DejaVuSans.ttf",
    "/usr/share/fonts/dejavu/DejaVuSans.ttf", "/usr/share/fonts/TTF/DejaVuSans.ttf"};
constexpr char32_t kReplacement = 0xFFFD, kEllipsis = 0x2026;
constexpr long kUnit = 64;  // FreeType counts 64ths of a pixel

/// UTF-8, and the replacement character for bytes that are none.
std::u32string decoded(const std::string& utf8) {
  std::u32string text;
  for (std::size_t i = 0; i < utf8.size();) {
    const auto lead = static_cast<unsigned char>(utf8[i++]);
    const int more = lead < 0x80                   ? 0
                     : lead >= 0xF0 && lead < 0xF8 ? 3
                     : lead >= 0xE0                ? 2
                     : lead >= 0xC0                ? 1
                                                   : -1;
    char32_t code = more <= 0 ? lead : lead & (0x3F >> more);
    bool good = more >= 0 && lead < 0xF8;
    for (int k = 0; good && k < more; ++k) {
      good = i < utf8.size() && (static_cast<unsigned char>(utf8[i]) & 0xC0) == 0x80;
      if (good) code = code << 6 | (static_cast<unsigned char>(utf8[i++]) & 0x3F);
    }
    text += good ? code : kReplacement;
  }
  return text;
}

std::string encoded(std::u32string_view text) {
  std::string utf8;
  for (const char32_t code : text) {
    const int more = code < 0x80 ? 0 : code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
    constexpr std::array<unsigned, 4> kLeads{0, 0xC0, 0xE0, 0xF0};
    utf8 += static_cast<char>(kLeads[static_cast<std::size_t>(more)] | code >> (6 * more));
    for (int k = more; k-- > 0;) utf8 += static_cast<char>(0x80 | (code >> (6 * k) & 0x3F));
  }
  return utf8;
}

}  // namespace

struct TextRaster::Impl {
  FT_Library library = nullptr;
  FT_Face face = nullptr;

  explicit Impl(int pixels) {
    if (FT_Init_FreeType(&library) != 0) return;
    for (const char* file : kFontFiles) {
      if (FT_New_Face(library, file, 0, &face) == 0) break;
      face = nullptr;
    }
    if (face) FT_Set_Pixel_Sizes(face, 0, static_cast<FT_UInt>(pixels));
  }
  ~Impl() {
    if (face) FT_Done_Face(face);
    if (library) FT_Done_FreeType(library);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  int advance(char32_t code) const {
    return face && FT_Load_Char(face, code, FT_LOAD_DEFAULT) == 0
               ? static_cast<int>(face->glyph->advance.x / kUnit)
               : 0;
  }

  int width(std::u32string_view text) const {
    int sum = 0;
    for (const char32_t code : text) sum += advance(code);
    return sum;
  }
};

TextRaster::TextRaster(int pixels) : impl_(std::make_unique<Impl>(pixels)) {}
TextRaster::~TextRaster() = default;

bool TextRaster::hasFont() const { return impl_->face != nullptr; }

int TextRaster::width(const std::string& utf8) const { return impl_->width(decoded(utf8)); }

std::string TextRaster::cut(const std::string& utf8, int room) const {
  std::u32string text = decoded(utf8);
  if (impl_->width(text) <= room) return utf8;
  const int left = room - impl_->advance(kEllipsis);
  while (!text.empty() && impl_->width(text) > left) text.pop_back();
  return encoded(text + kEllipsis);
}

TextImage TextRaster::draw(const std::string& utf8) const {
  TextImage image;
  if (!hasFont()) return image;
  const FT_Face face = impl_->face;
  const std::u32string text = decoded(utf8);
  image.width = impl_->width(text);
  image.baseline = static_cast<int>(face->size->metrics.ascender / kUnit);
  image.height = image.baseline - static_cast<int>(face->size->metrics.descender / kUnit);
  image.coverage.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  int pen = 0;
  for (const char32_t code : text) {
    if (FT_Load_Char(face, code, FT_LOAD_RENDER) != 0) continue;
    const FT_Bitmap& glyph = face->glyph->bitmap;
    for (int row = 0; row < static_cast<int>(glyph.rows); ++row) {
      for (int column = 0; column < static_cast<int>(glyph.width); ++column) {
        const int x = pen + face->glyph->bitmap_left + column,
                  y = image.baseline - face->glyph->bitmap_top + row;
        if (x < 0 || y < 0 || x >= image.width || y >= image.height) continue;
        std::uint8_t& pixel = image.coverage[static_cast<std::size_t>(y * image.width + x)];
        pixel = std::max(pixel, glyph.buffer[row * glyph.pitch + column]);
      }
    }
    pen += static_cast<int>(face->glyph->advance.x / kUnit);
  }
  return image;
}

}  // namespace polestar::detail
