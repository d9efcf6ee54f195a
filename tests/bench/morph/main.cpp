// What OpenVDB makes of the way between two level sets: LevelSetMorphing, and the blend of their distances that
// takes no tool at all. Volumes at even times and seconds a frame, one object of JSON on standard output.
//   morph_peers FIRST.vdb LAST.vdb FRAMES      level sets whose bands are as wide as the solids

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/GridTransformer.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetMorph.h>
#include <openvdb/tools/LevelSetRebuild.h>

#include <chrono>
#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>

namespace {

using openvdb::FloatGrid;
using Clock = std::chrono::steady_clock;

FloatGrid::Ptr surfaceOf(const char* path) {
  openvdb::io::File file(path);
  file.open();
  return openvdb::gridPtrCast<FloatGrid>(file.readGrid("surface"));
}

double seconds(Clock::time_point since) { return std::chrono::duration<double>(Clock::now() - since).count(); }

double volumeOf(const FloatGrid& grid) { return openvdb::tools::levelSetVolume(grid); }

/// The level set of the last solid in the voxels of the first.
FloatGrid::Ptr resampled(const FloatGrid& last, const FloatGrid& first) {
  auto result = FloatGrid::create(first.background());
  result->setTransform(first.transform().copy());
  result->setGridClass(openvdb::GRID_LEVEL_SET);
  openvdb::tools::resampleToMatch<openvdb::tools::BoxSampler>(last, *result);
  return result;
}

/// Normal flow towards the target's distances. How long it takes is told by nothing: it runs, a voxel's worth of
/// time a step, until the volume stays, and the frames are even shares of that.
nlohmann::json morphing(const FloatGrid& first, const FloatGrid& target, int frames) {
  const auto passes = [&](double end) {
    const FloatGrid::Ptr grid = openvdb::tools::levelSetRebuild(first, 0, 3);
    openvdb::tools::LevelSetMorphing<FloatGrid> morph(*grid, target);
    std::vector<double> volumes{volumeOf(*grid)};
    for (int frame = 1; frame < frames; ++frame) {
      morph.advect(end * (frame - 1) / (frames - 1), end * frame / (frames - 1));
      volumes.push_back(volumeOf(*grid));
    }
    return volumes;
  };
  constexpr double kSettled = 1e-3;
  double end = 1;
  const double wanted = volumeOf(target);
  for (int doubling = 0; doubling < 6; ++doubling, end *= 2) {
    if (std::abs(passes(end).back() / wanted - 1) < kSettled) break;
  }
  const auto start = Clock::now();
  const std::vector<double> volumes = passes(end);
  return {{"name", "OpenVDB LevelSetMorphing"},
          {"time_needed", end},
          {"volumes", volumes},
          {"seconds_a_frame", seconds(start) / (frames - 1)}};
}

nlohmann::json blending(const FloatGrid& first, const FloatGrid& target, int frames) {
  std::vector<double> volumes;
  const auto start = Clock::now();
  for (int frame = 0; frame < frames; ++frame) {
    const auto t = static_cast<float>(frame) / static_cast<float>(frames - 1);
    const FloatGrid::Ptr a = first.deepCopy(), b = target.deepCopy();
    a->tree().combine(b->tree(), [t](const float& x, const float& y, float& out) { out = (1 - t) * x + t * y; });
    volumes.push_back(volumeOf(*openvdb::tools::levelSetRebuild(*a, 0, 3)));
  }
  return {{"name", "blended distances"}, {"volumes", volumes}, {"seconds_a_frame", seconds(start) / frames}};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::cerr << "usage: morph_peers FIRST.vdb LAST.vdb FRAMES\n";
    return 2;
  }
  openvdb::initialize();
  const FloatGrid::Ptr first = surfaceOf(argv[1]), target = resampled(*surfaceOf(argv[2]), *first);
  const int frames = std::atoi(argv[3]);
  std::cout << nlohmann::json{morphing(*first, *target, frames), blending(*first, *target, frames)}.dump(1) << "\n";
}
