// Grids as a numbered stack of pictures.

#include <algorithm>
#include <cmath>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/io/detail/image_file.h"
#include "polestar/io/slice_stack.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

constexpr float kThere = 0.5f;  // weight of a voxel that holds a value, read at its center
constexpr int kMostPixels = 1 << 16;

const SampledGrid* findShown(const SampledGrids& grids) {
  for (const char* name : {"Cd", "color"}) {
    if (const SampledGrid* grid = grids.find(name, true)) return grid;
  }
  if (const SampledGrid* grid = grids.find("density", false)) return grid;
  const SampledGrid* only = nullptr;
  for (const SampledGrid& grid : grids.grids()) {
    if (grid.isVector()) continue;
    if (only) return nullptr;
    only = &grid;
  }
  return only;
}

std::string extensionOf(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

struct Format {
  const char* name;
  OIIO::TypeDesc type;
  bool associated;  ///< stores color times alpha
};

Format formatOf(const fs::path& path) {
  const std::string extension = extensionOf(path);
  if (extension == ".png") return {"png", OIIO::TypeDesc::UINT16, false};
  if (extension == ".exr") return {"openexr", OIIO::TypeDesc::FLOAT, true};
  return {"tiff", OIIO::TypeDesc::FLOAT, false};
}

/// One slice's values, `channels` a pixel.
class SliceReader {
 public:
  SliceReader(const SampledGrids& grids, const SliceLayout& stack)
      : stack_(stack),
        shown_(*grids.find(stack.grid, stack.color)),
        density_(stack.color ? grids.find("density", false) : nullptr) {}

  int channels() const { return (stack_.color ? 3 : 1) + (stack_.alpha ? 1 : 0); }

  std::vector<float> read(int z, const Context& context) const {
    const auto width = static_cast<std::size_t>(stack_.width),
               height = static_cast<std::size_t>(stack_.height),
               channels = static_cast<std::size_t>(this->channels());
    std::vector<float> values(width * height * channels);
    detail::parallelChunks(height, 8, context, [&](std::size_t begin, std::size_t end) {
      for (std::size_t row = begin; row < end; ++row)
        readRow(static_cast<int>(row), z,
                std::span(values).subspan(row * width * channels, width * channels));
    });
    return values;
  }

 private:
  void readRow(int row, int z, std::span<float> out) const {
    const auto width = static_cast<std::size_t>(stack_.width), channels = out.size() / width;
    std::vector<Vec3> points(width);
    for (std::size_t x = 0; x < width; ++x) {
      const Vec3 voxel(static_cast<double>(x) + 0.5, stack_.height - row - 0.5, z + 0.5);
      points[x] = stack_.place.origin + voxel.cwiseProduct(stack_.place.voxelSize);
    }
    std::vector<Vec3f> values(width), densities(width);
    std::vector<float> weights(width), ignored(width);
    shown_.sample(points, {}, values, weights);
    if (density_) density_->sample(points, {}, densities, ignored);
    for (std::size_t x = 0; x < width; ++x) {
      const bool there = weights[x] > kThere;
      float* pixel = &out[x * channels];
      for (std::size_t c = 0; c < (stack_.color ? 3U : 1U); ++c)
        pixel[c] = there ? values[x][static_cast<int>(c)] : 0;
      if (stack_.alpha) pixel[channels - 1] = !there ? 0 : density_ ? densities[x].x() * ignored[x] : 1;
    }
  }

  const SliceLayout& stack_;
  const SampledGrid& shown_;
  const SampledGrid* density_;
};

/// Into what a format stores; returns how many values were clipped.
std::size_t encode(std::vector<float>& values, std::size_t channels, const SliceLayout& stack,
                   const Format& format) {
  const std::size_t colors = channels - (stack.alpha ? 1 : 0);
  std::size_t clipped = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const bool isAlpha = i % channels >= colors;
    if (format.type == OIIO::TypeDesc::UINT16) {
      const float in = std::clamp(std::isnan(values[i]) ? 0 : values[i], 0.0f, 1.0f);
      if (in != values[i]) ++clipped;
      values[i] = stack.color && !isAlpha ? detail::srgbFromLinear(in) : in;
    } else if (format.associated && stack.alpha && !isAlpha) {
      values[i] *= values[i - i % channels + channels - 1];
    }
  }
  return clipped;
}

}  // namespace

bool isSliceOutputName(const fs::path& path) {
  const std::string extension = extensionOf(path);
  return extension == ".png" || extension == ".tif" || extension == ".tiff" || extension == ".exr";
}

SliceLayout planSlices(const SampledGrids& grids) {
  const SampledGrid* shown = findShown(grids);
  if (!shown) {
    std::string names;
    for (const SampledGrid& grid : grids.grids()) names += (names.empty() ? "" : ", ") + grid.name();
    throw Error(Errc::usage, "slices show colors or one grid of scalars; of " +
                                 (names.empty() ? std::string("no grids") : names) + " pick one by --pick");
  }
  const std::optional<Vec3> edges = shown->voxelEdges();
  if (!edges) {
    throw Error(Errc::usage, "the voxels of the grid " + shown->name() +
                                 " lie askew to x, y and z; straighten them with --voxel");
  }
  if (shown->activeVoxels() == 0) throw Error(Errc::usage, "the grid " + shown->name() + " is empty");
  const Box box = shown->activeBox();
  const Vec3 counts = box.extent().cwiseQuotient(*edges).array().round() + 1;
  if (counts.maxCoeff() > kMostPixels) {
    throw Error(Errc::usage, "the grid " + shown->name() +
                                 " has more than 65536 voxels along an axis; use "
                                 "larger ones with --voxel");
  }
  SliceLayout stack;
  stack.grid = shown->name();
  stack.color = shown->isVector();
  stack.width = static_cast<int>(counts.x());
  stack.height = static_cast<int>(counts.y());
  stack.count = static_cast<int>(counts.z());
  const bool full = static_cast<double>(shown->activeVoxels()) == counts.prod();
  stack.alpha = stack.color && (grids.find("density", false) || !full);
  stack.place = {.voxelSize = *edges, .origin = box.min - 0.5 * *edges};
  return stack;
}

std::size_t writeSlices(const FramePath& pattern, const SampledGrids& grids, const SliceLayout& stack,
                        Context& context) {
  const SliceReader reader(grids, stack);
  const Format format = formatOf(pattern.pattern());
  const int channels = reader.channels();
  OIIO::ImageSpec spec(stack.width, stack.height, channels, format.type);
  if (channels == 2) spec.channelnames = {"Y", "A"};
  if (stack.alpha) spec.alpha_channel = channels - 1;
  const bool coded = stack.color && format.type == OIIO::TypeDesc::UINT16;
  spec.attribute("oiio:ColorSpace", coded ? "sRGB" : "Linear");
  if (!format.associated) spec.attribute("oiio:UnassociatedAlpha", 1);
  // The same bytes for the same grids: without a date some writers take the clock's.
  spec.attribute("DateTime", "1970:01:01 00:00:00");
  std::size_t clipped = 0;
  for (int z = 0; z < stack.count; ++z) {
    context.throwIfCancelled();
    context.progress("writing slices", static_cast<double>(z) / stack.count);
    std::vector<float> values = reader.read(z, context);
    clipped += encode(values, static_cast<std::size_t>(channels), stack, format);
    detail::writeImage(pattern.at(z + 1), format.name, spec, {}, OIIO::TypeDesc::FLOAT, values.data());
  }
  context.progress("writing slices", 1);
  return clipped;
}

}  // namespace polestar
