#include "integration/blender.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>

#include "cli/run_tool.h"
#include "support/scratch_folder.h"

namespace polestar::test {
namespace {

namespace fs = std::filesystem;

// Thin enough to be a plane beside the voxels that it is interpolated from.
constexpr double kSlabVoxels = 0.2;

const char* nameOf(BlenderCut::Shader shader) {
  switch (shader) {
    case BlenderCut::Shader::emission:
      return "emission";
    case BlenderCut::Shader::principled:
      return "principled";
    case BlenderCut::Shader::imported:
      return "imported";
  }
  return "";
}

nlohmann::json jsonOf(const Vec3& v) { return {v[0], v[1], v[2]}; }

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
          {"frame", cut.frame},
          {"attribute", cut.attribute},
          {"shader", nameOf(cut.shader)},
          {"scale", cut.scale},
          {"offset", cut.offset},
          {"optical_depth", kFogOpticalDepth},
          {"camera", camera},
          {"field_of_view", view.fieldOfView},
          {"size", {view.width, view.height}},
          {"slab", {view.depth - half, view.depth + half}},
          {"plane", cut.plane ? nlohmann::json{{"point", jsonOf(cut.plane->point)},
                                               {"normal", jsonOf(cut.plane->normal)}}
                              : nlohmann::json()}};
}

/// Runs a script of this folder, whose only argument is a file with `json`.
BlenderOutcome runScript(const std::string& script, const fs::path& folder, const nlohmann::json& json) {
  const std::string file = (folder / "job.json").string(), log = (folder / "blender.log").string();
  std::ofstream(file) << json;
  // Add-ons are installed into the folder, not for whoever runs the tests.
  const std::string command =
      "BLENDER_USER_SCRIPTS='" + (folder / "scripts").string() +
      "' blender -b --factory-startup --python-exit-code 3 --python '" POLESTAR_INTEGRATION_FOLDER "/" +
      script + "' -- '" + file + "' > '" + log + "' 2>&1";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytesOf(log)};
}

}  // namespace

bool haveBlender() { return std::system("command -v blender > /dev/null 2>&1") == 0; }

BlenderOutcome runBlender(const BlenderJob& job) {
  nlohmann::json json = {
      {"file", job.vdb.string()},        {"grids", job.grids},
      {"cuts", nlohmann::json::array()}, {"sequence", job.sequence},
      {"addon", job.addon.string()},     {"bounds", (job.folder / "bounds.json").string()}};
  for (const BlenderCut& cut : job.cuts) json["cuts"].push_back(jsonOf(cut, job));
  BlenderOutcome outcome = runScript("blender_cut.py", job.folder, json);
  if (outcome.exitCode != 0) return outcome;
  for (const auto& [min, max] : nlohmann::json::parse(bytesOf(job.folder / "bounds.json"))
                                    .get<std::vector<std::array<std::array<double, 3>, 2>>>())
    outcome.bounds.push_back({Vec3(min[0], min[1], min[2]), Vec3(max[0], max[1], max[2])});
  return outcome;
}

fs::path packAddon(const fs::path& folder) {
  const fs::path zip = folder / "polestar_blender.zip";
  const testing::ToolRun run =
      testing::runProgram({"/bin/bash", POLESTAR_BLENDER_FOLDER "/package.sh", zip.string()});
  EXPECT_EQ(run.exitCode, 0) << run.err;
  return zip;
}

std::vector<std::string> addonReports(const fs::path& folder, const std::vector<AddonImport>& imports) {
  const fs::path out = folder / "reports.json";
  const nlohmann::json job{
      {"addon", packAddon(folder).string()}, {"imports", imports}, {"out", out.string()}};
  const BlenderOutcome outcome = runScript("blender_reports.py", folder, job);
  EXPECT_EQ(outcome.exitCode, 0) << outcome.log;
  if (outcome.exitCode != 0) return {};
  return nlohmann::json::parse(bytesOf(out)).get<std::vector<std::string>>();
}

BlenderOutcome runPanel(const fs::path& folder, const fs::path& full, const fs::path& bare) {
  return runScript("blender_panel.py", folder,
                   {{"addon", packAddon(folder).string()}, {"full", full.string()}, {"bare", bare.string()}});
}

}  // namespace polestar::test
