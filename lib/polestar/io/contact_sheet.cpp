#include "polestar/io/contact_sheet.h"

#include <OpenImageIO/imagebuf.h>
#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>

#include "polestar/core/error.h"
#include "polestar/io/detail/image_file.h"
#include "polestar/io/detail/text_raster.h"
#include "polestar/io/picture.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;
using OIIO::ImageBuf;

constexpr int kGap = 6, kLabelHeight = 28, kFontSize = 16;  // pixels
constexpr float kPaper[] = {0.95F, 0.95F, 0.95F}, kEmpty[] = {0.82F, 0.82F, 0.82F},
                kInk[] = {0.1F, 0.1F, 0.1F};
constexpr double kEmptyAspect = 0.75;  // of cells on a sheet without a single picture

/// A whole file as RGBA floats, code values.
ImageBuf readCell(const fs::path& path) {
  ImageBuf picture(path.string());
  if (!picture.read(0, 0, /*force=*/true, OIIO::TypeDesc::FLOAT))
    throw Error(Errc::io, "cannot read " + path.string() + ": " + picture.geterror());
  const bool gray = picture.nchannels() < 3;
  const int channels[] = {0, gray ? 0 : 1, gray ? 0 : 2, picture.spec().alpha_channel};
  const float values[] = {0, 0, 0, 1};
  ImageBuf rgba = OIIO::ImageBufAlgo::channels(picture, 4, channels, values);
  if (path.extension() != ".exr") return rgba;
  for (ImageBuf::Iterator<float> pixel(rgba); !pixel.done(); ++pixel) {
    for (int c = 0; c < 3; ++c) pixel[c] = displayValue(pixel[c]);
  }
  return rgba;
}

class Sheet {
 public:
  explicit Sheet(const ContactSheet& sheet) : sheet_(sheet) {
    labelWidth_ = 0;
    for (const std::string& row : sheet.rows) labelWidth_ = std::max(labelWidth_, raster_.width(row));
    // A name longer than a cell is cut.
    labelWidth_ = labelWidth_ == 0 ? 0 : std::min(labelWidth_ + 2 * kGap, sheet.cellWidth);
    const bool named = std::any_of(sheet.columns.begin(), sheet.columns.end(),
                                   [](const std::string& name) { return !name.empty(); });
    headHeight_ = named ? kLabelHeight : 0;
    cellHeight_ = static_cast<int>(std::lround(aspect() * sheet.cellWidth));
  }

  bool draw() {
    const int width =
        labelWidth_ + static_cast<int>(sheet_.columns.size()) * (sheet_.cellWidth + kGap) + kGap;
    const int height = headHeight_ + static_cast<int>(sheet_.rows.size()) * (cellHeight_ + kGap) + kGap;
    page_ = ImageBuf(OIIO::ImageSpec(width, height, 3, OIIO::TypeDesc::FLOAT));
    OIIO::ImageBufAlgo::fill(page_, kPaper);
    for (std::size_t column = 0; column < sheet_.columns.size(); ++column) {
      write(sheet_.columns[column], left(column) + sheet_.cellWidth / 2, headHeight_ / 2, sheet_.cellWidth,
            true);
    }
    for (std::size_t row = 0; row < sheet_.rows.size(); ++row) {
      write(sheet_.rows[row], kGap, top(row) + cellHeight_ / 2, labelWidth_ - kGap, false);
      for (std::size_t column = 0; column < sheet_.columns.size(); ++column)
        drawCell(sheet_.cells[row * sheet_.columns.size() + column], left(column), top(row));
    }
    return raster_.hasFont();
  }

  const ImageBuf& page() const { return page_; }

 private:
  /// Of the first picture there is.
  double aspect() const {
    for (const SheetCell& cell : sheet_.cells) {
      if (cell.picture.empty()) continue;
      ImageBuf picture(cell.picture.string());
      if (!picture.init_spec(cell.picture.string(), 0, 0))
        throw Error(Errc::io, "cannot read " + cell.picture.string() + ": " + picture.geterror());
      return static_cast<double>(picture.spec().full_height) / picture.spec().full_width;
    }
    return kEmptyAspect;
  }

  int left(std::size_t column) const {
    return labelWidth_ + kGap + static_cast<int>(column) * (sheet_.cellWidth + kGap);
  }
  int top(std::size_t row) const { return headHeight_ + kGap + static_cast<int>(row) * (cellHeight_ + kGap); }

  /// Centered about the row `y`; about the column `x`, or from there on.
  void write(const std::string& whole, int x, int y, int room, bool centered) {
    const detail::TextImage text = raster_.draw(raster_.cut(whole, room));
    const int left = centered ? x - text.width / 2 : x, top = y - text.height / 2;
    for (int row = 0; row < text.height; ++row) {
      for (int column = 0; column < text.width; ++column) {
        const float ink =
            static_cast<float>(text.coverage[static_cast<std::size_t>(row * text.width + column)]) / 255;
        if (ink > 0) blend(left + column, top + row, kInk, ink);
      }
    }
  }

  void blend(int x, int y, const float* color, float share) {
    float pixel[3];
    page_.getpixel(x, y, 0, pixel, 3);
    for (int c = 0; c < 3; ++c) pixel[c] = share * color[c] + (1 - share) * pixel[c];
    page_.setpixel(x, y, 0, pixel, 3);
  }

  void drawCell(const SheetCell& cell, int x, int y) {
    const OIIO::ROI box(x, x + sheet_.cellWidth, y, y + cellHeight_, 0, 1, 0, 3);
    OIIO::ImageBufAlgo::fill(page_, kEmpty, box);
    if (!cell.picture.empty()) paste(cell.picture, x, y);
    if (!cell.note.empty())
      write(cell.note, x + sheet_.cellWidth / 2, y + cellHeight_ / 2, sheet_.cellWidth - 2 * kGap, true);
  }

  void paste(const fs::path& path, int x, int y) {
    const OIIO::ROI size(0, sheet_.cellWidth, 0, cellHeight_, 0, 1, 0, 4);
    const ImageBuf picture = readCell(path);
    // Pictures of another shape keep theirs and are centered.
    ImageBuf small = OIIO::ImageBufAlgo::fit(picture, "", 0, "letterbox", false, size);
    if (small.has_error()) throw Error(Errc::io, "cannot scale " + path.string() + ": " + small.geterror());
    ImageBuf::ConstIterator<float> from(small, size);
    for (; !from.done(); ++from) {
      float under[3];
      page_.getpixel(x + from.x(), y + from.y(), 0, under, 3);
      for (int c = 0; c < 3; ++c) under[c] = from[c] + (1 - from[3]) * under[c];
      page_.setpixel(x + from.x(), y + from.y(), 0, under, 3);
    }
  }

  const ContactSheet& sheet_;
  ImageBuf page_;
  int labelWidth_ = 0, headHeight_ = 0, cellHeight_ = 0;
  const detail::TextRaster raster_{kFontSize};
};

const char* formatOf(const fs::path& path) {
  if (path.extension() == ".png") return "png";
  if (path.extension() == ".jpg" || path.extension() == ".jpeg") return "jpeg";
  throw Error(Errc::usage, "a sheet is a .png or .jpg; found " + path.string());
}

}  // namespace

bool writeContactSheet(const fs::path& path, const ContactSheet& sheet) {
  const char* format = formatOf(path);
  if (sheet.cells.empty() || sheet.cells.size() != sheet.rows.size() * sheet.columns.size())
    throw Error(Errc::usage, "a sheet wants a cell for every row and column, and at least one");
  Sheet drawn(sheet);
  const bool named = drawn.draw();
  const OIIO::ImageSpec& page = drawn.page().spec();
  OIIO::ImageSpec spec(page.width, page.height, 3, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  spec.attribute("Compression", "jpeg:90");
  detail::writeImage(path, format, spec, {}, OIIO::TypeDesc::FLOAT, drawn.page().localpixels());
  return named;
}

}  // namespace polestar
