// texture_sheet: each procedural texture from outside, cut along the equator, along a meridian and open at a
// corner. With --time, what a sample costs.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "ball_view.h"
#include "polestar/core/error.h"
#include "polestar/texture/procedural.h"

namespace polestar::bench {
namespace {

/// In the order of the sheet's quarters. The textures' axis is z.
std::vector<BallView> views() {
  const Vec3 y = Vec3::UnitY(), z = Vec3::UnitZ();
  return {{.towardsCamera = Vec3(0.5, -1, 0.45).normalized(), .up = z, .cuts = {}},
          {.towardsCamera = z, .up = y, .cuts = {z}},
          {.towardsCamera = -y, .up = z, .cuts = {-y}},
          {.towardsCamera = Vec3(0.75, -1, 0.7).normalized(),
           .up = z,
           .cuts = {Vec3(0.98, 0.15, 0.1).normalized(), Vec3(0.2, -1, 0.15).normalized(),
                    Vec3(-0.1, -0.12, 1).normalized()},
           .corner = Vec3(0.02, 0.03, 0.01)}};
}

Picture sheet(const SolidTexture& texture, int size, int side, double width) {
  Picture picture(2 * size, 2 * size);
  int quarter = 0;
  for (BallView view : views()) {
    view.width = width;
    drawBall(texture, view, side, {quarter % 2 * size, quarter / 2 * size, size}, picture);
    ++quarter;
  }
  return picture;
}

/// CPU microseconds a sample, one thread: a million points, uniform in the ball, with the footprint of a
/// voxel of a grid that has `dim` voxels across the ball.
double microsecondsPerSample(const SolidTexture& texture, int dim) {
  std::mt19937 generator(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<TexturePoint> points;
  while (points.size() < 1000000) {
    TexturePoint point;
    point.ball = Vec3(uniform(generator), uniform(generator), uniform(generator));
    point.footprint = Mat3::Identity() * (2.0 / dim);
    if (point.ball.norm() < 1) points.push_back(point);
  }
  std::vector<TextureSample> samples(points.size());
  const std::clock_t start = std::clock();
  texture.sample(points, samples);
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

struct Options {
  std::filesystem::path folder = ".";
  std::vector<std::string> names;
  TextureSettings settings;
  int size = 600, side = 2;
  double width = 2.2;
  bool time = false;
};

void run(const Options& options) {
  for (const std::string& name : options.names) {
    const auto texture = makeTexture(name, options.settings);
    if (options.time) {
      std::printf("%-12s %.3f us a sample at 256 voxels across, %.3f at points\n", name.c_str(),
                  microsecondsPerSample(*texture, 256), microsecondsPerSample(*texture, 1000000));
      continue;
    }
    writePicture(options.folder / (name + ".png"),
                 sheet(*texture, options.size, options.side, options.width));
  }
}

}  // namespace
}  // namespace polestar::bench

int main(int argc, char** argv) {
  polestar::bench::Options options;
  CLI::App app("Pictures of the procedural textures, NAME.png each");
  app.add_option("names", options.names, "textures; all without a name");
  app.add_option("-o", options.folder, "folder for the pictures");
  std::vector<std::string> settings;
  app.add_option("--set", settings, "NAME=VALUE of a parameter")->allow_extra_args(false);
  app.add_option("--size", options.size, "pixels of a quarter of a sheet");
  app.add_option("--side", options.side, "samples a pixel: the square of this");
  app.add_option("--width", options.width, "of a quarter, ball radii: small ones show the center");
  app.add_flag("--time", options.time, "measure instead");
  CLI11_PARSE(app, argc, argv);
  if (options.names.empty()) {
    for (const auto& info : polestar::proceduralTextures()) options.names.emplace_back(info.name);
  }
  for (const std::string& setting : settings) {
    const std::size_t equals = std::min(setting.find('='), setting.size() - 1);
    options.settings.emplace_back(setting.substr(0, equals), std::atof(setting.c_str() + equals + 1));
  }
  try {
    polestar::bench::run(options);
  } catch (const polestar::Error& error) {
    std::fprintf(stderr, "texture_sheet: %s\n", error.what());
    return 1;
  }
}
