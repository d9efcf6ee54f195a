#include "integration/blender.h"

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/scratch_folder.h"

namespace polestar::test {
namespace {

// Thin enough to be a plane beside the voxels that it is interpolated from.
constexpr double kSlabVoxels = 0.2;

nlohmann::json jsonOf(const BlenderCut& cut, const BlenderJob& job) {
  const CutView& view = cut.view;
  const Vec3 position = view.position + Vec3::Constant(cut.voxelsTooFar * job.voxelSize);
  nlohmann::json camera = nlohmann::json::array();
  // Blender's cameras look along their -z.
  for (int row = 0; row < 3; ++row)
    camera.push_back({view.axes(row, 0), view.axes(row, 1), -view.axes(row, 2), position[row]});
  camera.push_back({0, 0, 0, 1});
  const double half = 0.5 * kSlabVoxels * job.voxelSize;
  return {{"out", (job.folder / cut.out).string()},
          {"attribute", cut.attribute},
          {"shader", cut.shader == BlenderCut::Shader::emission ? "emission" : "principled"},
          {"scale", cut.scale},
          {"offset", cut.offset},
          {"optical_depth", kFogOpticalDepth},
          {"camera", camera},
          {"field_of_view", view.fieldOfView},
          {"size", {view.width, view.height}},
          {"slab", {view.depth - half, view.depth + half}}};
}

}  // namespace

bool haveBlender() { return std::system("command -v blender > /dev/null 2>&1") == 0; }

BlenderOutcome runBlender(const BlenderJob& job) {
  nlohmann::json json = {{"file", job.vdb.string()}, {"grids", job.grids}, {"cuts", nlohmann::json::array()}};
  for (const BlenderCut& cut : job.cuts) json["cuts"].push_back(jsonOf(cut, job));
  const std::string file = (job.folder / "job.json").string(), log = (job.folder / "blender.log").string();
  std::ofstream(file) << json;
  const std::string command =
      "blender -b --factory-startup --python-exit-code 3 --python '" POLESTAR_INTEGRATION_FOLDER
      "/blender_cut.py' -- '" +
      file + "' > '" + log + "' 2>&1";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytesOf(log)};
}

}  // namespace polestar::test
