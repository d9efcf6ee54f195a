#include "polestar/render/detail/tile_loop.h"

#include <algorithm>
#include <atomic>
#include <thread>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

/// Tiles of the full picture's grid, by row and column.
struct TileRange {
  int x0, y0, across, down;
  explicit TileRange(const Picture& picture)
      : x0(picture.x0 / kTile),
        y0(picture.y0 / kTile),
        across((picture.x0 + picture.width - 1) / kTile + 1 - x0),
        down((picture.y0 + picture.height - 1) / kTile + 1 - y0) {}
};

}  // namespace

Picture emptyPicture(const RenderOptions& options) {
  const PixelBox box = options.crop.value_or(PixelBox{0, 0, options.width, options.height});
  Picture picture(box.x1 - box.x0, box.y1 - box.y0);
  picture.x0 = box.x0;
  picture.y0 = box.y0;
  picture.fullWidth = options.width;
  picture.fullHeight = options.height;
  return picture;
}

std::size_t tileCount(const Picture& picture) {
  const TileRange range(picture);
  return static_cast<std::size_t>(range.across) * static_cast<std::size_t>(range.down);
}

void forEachTile(const RenderOptions& options, const Picture& picture, std::string_view stage,
                 Context& context,
                 const std::function<void(std::size_t number, const PixelBox& tile)>& render) {
  const TileRange range(picture);
  const std::size_t tiles = tileCount(picture);
  std::atomic<std::size_t> done{0};
  const std::thread::id driver = std::this_thread::get_id();
  parallelChunks(tiles, 1, context, [&](std::size_t t, std::size_t) {
    const int x0 = (range.x0 + static_cast<int>(t) % range.across) * kTile,
              y0 = (range.y0 + static_cast<int>(t) / range.across) * kTile;
    render(t, {x0, y0, std::min(x0 + kTile, options.width), std::min(y0 + kTile, options.height)});
    const std::size_t finished = ++done;
    if (std::this_thread::get_id() == driver)
      context.progress(stage, static_cast<double>(finished) / static_cast<double>(tiles));
  });
}

void copyTile(const PixelBox& tile, const std::vector<Eigen::Vector4f>& pixels, Picture& picture) {
  for (int y = std::max(tile.y0, picture.y0); y < std::min(tile.y1, picture.y0 + picture.height); ++y) {
    for (int x = std::max(tile.x0, picture.x0); x < std::min(tile.x1, picture.x0 + picture.width); ++x) {
      const int from = (y - tile.y0) * (tile.x1 - tile.x0) + x - tile.x0;
      std::copy_n(pixels[from].data(), 4, picture.pixel(x - picture.x0, y - picture.y0));
    }
  }
}

}  // namespace polestar::detail
