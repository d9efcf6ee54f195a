#include "polestar/io/slice_stack.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"
#include "polestar/io/picture.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 5;  // missing numbers in a message

struct Slice {
  int width = 0, height = 0, channels = 0;
  bool linear = false;
  std::vector<float> values;  ///< straight alpha
};

Slice readSlice(const fs::path& path) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path.string(), &config);
  if (!input) throw Error(Errc::io, "cannot read " + path.string() + ": " + OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  Slice slice{spec.width, spec.height, spec.nchannels, false, {}};
  if (slice.channels > 4) {
    throw Error(Errc::io, path.string() + " has " + std::to_string(slice.channels) +
                              " channels; a slice has 1 to 4: gray, gray and alpha, RGB or RGBA");
  }
  const std::string space = spec.get_string_attribute("oiio:ColorSpace");
  slice.linear = spec.format.is_floating_point() ? space != "sRGB" : OIIO::Strutil::iequals(space, "linear");
  slice.values.resize(std::size_t{1} * spec.width * spec.height * spec.nchannels);
  if (!input->read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, slice.values.data()))
    throw Error(Errc::io, "cannot read " + path.string() + ": " + input->geterror());
  // Formats that store color times alpha hand it over so.
  if (!spec.get_int_attribute("oiio:UnassociatedAlpha") && slice.channels % 2 == 0) {
    for (std::size_t i = 0; i < slice.values.size(); i += static_cast<std::size_t>(slice.channels)) {
      const float alpha = slice.values[i + static_cast<std::size_t>(slice.channels) - 1];
      for (int c = 0; c + 1 < slice.channels && alpha > 0; ++c)
        slice.values[i + static_cast<std::size_t>(c)] /= alpha;
    }
  }
  return slice;
}

std::string shapeOf(const Slice& slice) {
  return std::to_string(slice.width) + " x " + std::to_string(slice.height) + " pixels of " +
         std::to_string(slice.channels) + (slice.channels == 1 ? " channel" : " channels");
}

}  // namespace

void SliceOptions::validate() const {
  if (!voxelSize.allFinite() || !(voxelSize.minCoeff() > 0))
    throw Error(Errc::usage, "the voxels of slices must have a positive size");
  if (!origin.allFinite()) throw Error(Errc::usage, "the slices' origin must be a point");
}

std::vector<fs::path> numberedFiles(const fs::path& path) {
  const FramePath pattern(path);
  if (!pattern.numbered())
    throw Error(Errc::usage, path.string() + " has no place for a number, such as ####");
  const std::string before = pattern.before(), after = pattern.after();
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  std::map<long, fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.size() <= before.size() + after.size() || !name.starts_with(before) || !name.ends_with(after))
      continue;
    long number = 0;
    const char *begin = name.data() + before.size(), *end = name.data() + name.size() - after.size();
    const auto [stop, failed] = std::from_chars(begin, end, number);
    if (failed != std::errc() || stop != end || number < 0) continue;
    if (!files.emplace(number, entry.path()).second) {
      throw Error(Errc::io, "two files have the number " + std::to_string(number) + ": " +
                                files[number].string() + " and " + entry.path().string());
    }
  }
  if (error) throw Error(Errc::io, "cannot read the folder " + folder.string() + ": " + error.message());
  if (files.size() < 2) {
    throw Error(Errc::io, path.string() + ": " + (files.empty() ? "no file" : "only one file") +
                              " has such a name; a stack needs at least two");
  }
  std::string missing;
  std::size_t count = 0;
  for (long number = files.begin()->first; number < files.rbegin()->first; ++number) {
    if (files.contains(number)) continue;
    if (count < kMostNamed) missing += (count > 0 ? ", " : "") + std::to_string(number);
    ++count;
  }
  if (count > 0) {
    throw Error(Errc::io, path.string() + ": " + std::to_string(count) + " of the numbers " +
                              std::to_string(files.begin()->first) + " to " +
                              std::to_string(files.rbegin()->first) + " are missing: " + missing +
                              (count > kMostNamed ? " ..." : ""));
  }
  std::vector<fs::path> ordered;
  for (const auto& [number, file] : files) ordered.push_back(file);
  return ordered;
}

SampledGrids readSlices(const fs::path& pattern, const SliceOptions& options, Context& context) {
  options.validate();
  const std::vector<fs::path> files = numberedFiles(pattern);
  Slice first;
  std::optional<SliceVolume> volume;
  std::vector<SliceVolume::Pixel> pixels;
  for (std::size_t z = 0; z < files.size(); ++z) {
    context.throwIfCancelled();
    context.progress("reading slices", static_cast<double>(z) / static_cast<double>(files.size()));
    Slice slice = readSlice(files[z]);
    if (z == 0) {
      first = slice;
      volume.emplace(slice.width, slice.height, options.voxelSize, options.origin, slice.channels % 2 == 0);
    } else if (slice.width != first.width || slice.height != first.height ||
               slice.channels != first.channels) {
      throw Error(Errc::io, files[z].string() + " has " + shapeOf(slice) + ", " + files[0].string() +
                                " has " + shapeOf(first) + ": all slices must be alike");
    }
    const auto channels = static_cast<std::size_t>(slice.channels);
    pixels.resize(slice.values.size() / channels);
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const float* value = &slice.values[i * channels];
      for (int c = 0; c < 3; ++c) {
        const float v = value[channels >= 3 ? c : 0];
        pixels[i].color[c] = slice.linear ? v : linearFromSrgbValue(v);
      }
      pixels[i].alpha = channels % 2 == 0 ? value[channels - 1] : 1;
    }
    volume->addSlice(pixels);
  }
  context.progress("reading slices", 1);
  return volume->finish();
}

}  // namespace polestar
