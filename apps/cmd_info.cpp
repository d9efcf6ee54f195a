// polestar info: what a file holds. Grids of a .vdb with their metadata, or counts and box of a mesh.

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "cli/dry_run.h"
#include "cli/outputs.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

/// By content, so that a .vdb under another name is still one; a damaged .vdb keeps its name.
bool isVdb(const fs::path& path) {
  constexpr std::array<char, 4> kMagic{' ', 'B', 'D', 'V'};
  std::ifstream in(path, std::ios::binary);
  if (!in || fs::is_directory(path)) {
    throw Error(Errc::io, "cannot read " + path.string() + ": " + std::strerror(in ? EISDIR : errno));
  }
  std::array<char, 4> start{};
  in.read(start.data(), start.size());
  return start == kMagic || path.extension() == ".vdb";
}

std::string indexBox(const GridInfo& grid) {
  std::string text;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    text += (axis ? " x " : "") + std::to_string(grid.indexMin[axis]) + ".." +
            std::to_string(grid.indexMax[axis]);
  }
  return text;
}

Json toJson(const GridInfo& grid) {
  Json metadata = Json::object();
  for (const auto& [key, value] : grid.metadata) metadata[key] = value;
  return {{"name", grid.name},
          {"type", grid.valueType},
          {"class", grid.gridClass},
          {"active_voxels", grid.activeVoxels},
          {"memory_bytes", grid.memoryBytes},
          {"index_min", grid.indexMin},
          {"index_max", grid.indexMax},
          {"voxel_size", grid.voxelSize},
          {"metadata", metadata}};
}

/// Metadata that every grid carries is shown once, what is left under its grid.
std::string metadataText(const std::vector<GridInfo>& grids) {
  using Entry = std::pair<std::string, std::string>;
  const auto shared = [&](const Entry& entry) {
    return std::all_of(grids.begin(), grids.end(), [&](const GridInfo& grid) {
      return std::find(grid.metadata.begin(), grid.metadata.end(), entry) != grid.metadata.end();
    });
  };
  const auto section = [](const std::string& title, const std::vector<Entry>& entries) {
    if (entries.empty()) return std::string();
    std::vector<std::vector<std::string>> rows;
    rows.reserve(entries.size());
    for (const auto& [key, value] : entries) rows.push_back({key, value});
    return "\n" + title + "\n" + table(rows, {}, "  ");
  };
  std::vector<Entry> common;
  if (!grids.empty()) {
    std::copy_if(grids[0].metadata.begin(), grids[0].metadata.end(), std::back_inserter(common), shared);
  }
  std::string text = section(grids.size() > 1 ? "metadata of all grids" : "metadata", common);
  for (const GridInfo& grid : grids) {
    std::vector<Entry> own;
    std::remove_copy_if(grid.metadata.begin(), grid.metadata.end(), std::back_inserter(own), shared);
    text += section("metadata of " + grid.name, own);
  }
  return text;
}

void describeGrids(const fs::path& path, Session& session) {
  const std::vector<GridInfo> grids = session.timed("load", [&] { return readGridInfo(path); });
  session.json()["file"] = {{"format", "vdb"}, {"bytes", fs::file_size(path)}};
  Json& list = session.json()["grids"] = Json::array();
  std::vector<std::vector<std::string>> rows{
      {"grid", "type", "class", "active voxels", "voxel", "memory", "index box"}};
  for (const GridInfo& grid : grids) {
    list.push_back(toJson(grid));
    rows.push_back({grid.name, grid.valueType, grid.gridClass, grouped(grid.activeVoxels),
                    shortNumber(grid.voxelSize), byteSize(grid.memoryBytes), indexBox(grid)});
  }
  session.text() = path.filename().string() + ": " + counted(grids.size(), "grid", "grids") + ", " +
                   byteSize(fs::file_size(path)) + "\n\n" + table(rows, {3, 4, 5}) + metadataText(grids);
}

void describeMesh(const fs::path& path, Session& session) {
  const MeshFile file = loadMesh(path, session);
  const Box box = boundingBox(file.mesh);
  const double area = surfaceArea(file.mesh);
  session.json()["file"] = {{"format", file.format}, {"bytes", fs::file_size(path)}};
  session.json()["mesh"] = {{"vertices", file.mesh.vertices.size()},
                            {"triangles", file.mesh.triangles.size()},
                            {"polygons", file.polygons},
                            {"box", {{"min", cli::toJson(box.min)}, {"max", cli::toJson(box.max)}}},
                            {"diagonal", box.diagonal()},
                            {"area", area}};
  std::string faces = counted(file.mesh.triangles.size(), "triangle", "triangles");
  if (file.polygons > 0)
    faces += " (from " + counted(file.polygons, "polygon", "polygons") + " and triangles)";
  session.text() = path.filename().string() + ": mesh, " + file.format + ", " +
                   byteSize(fs::file_size(path)) + "\n" +
                   table({{"counts", counted(file.mesh.vertices.size(), "vertex", "vertices") + ", " + faces},
                          {"box", shortPoint(box.min) + "  to  " + shortPoint(box.max)},
                          {"diagonal", shortNumber(box.diagonal())},
                          {"area", shortNumber(area)}},
                         {}, "  ");
}

class InfoCommand final : public Command {
 public:
  Description description() const override {
    return {"info", "What a file holds: grids and metadata of a .vdb, counts and box of a mesh",
            "Write the answer to FILE instead of standard output", "polestar info asteroid.vdb"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("FILE", file_, "A .vdb, or a mesh: .obj, .ply, .stl or .off")->required()->type_name("");
  }

  void run(Session& session) override {
    session.addInput(file_);
    session.sendAnswerToOutput();
    if (session.options().dryRun) {
      describePlan(session);
    } else if (isVdb(file_)) {
      describeGrids(file_, session);
    } else {
      describeMesh(file_, session);
    }
  }

 private:
  fs::path file_;
};

}  // namespace

std::unique_ptr<Command> makeInfoCommand() { return std::make_unique<InfoCommand>(); }

}  // namespace polestar::cli
