// polestar info: what a file holds. Grids of a .vdb with their metadata, the facts of a .pmap, or counts and
// box of a mesh. And what --device can name.

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <string_view>

#include "cli/dry_run.h"
#include "cli/outputs.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/compute_device.h"
#include "polestar/core/error.h"
#include "polestar/map/map_file.h"
#include "polestar/vdb/solid_grids.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

enum class FileKind { grids, map, mesh };

/// By content, so that a .vdb under another name is still one; a damaged file is what its name says.
FileKind fileKind(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || fs::is_directory(path)) {
    throw Error(Errc::io, "cannot read " + path.string() + ": " + std::strerror(in ? EISDIR : errno));
  }
  std::array<char, 8> bytes{};
  in.read(bytes.data(), bytes.size());
  const std::string_view start(bytes.data(), bytes.size());
  if (start.starts_with(" BDV") || path.extension() == ".vdb") return FileKind::grids;
  if (start == "POLESTAR" || path.extension() == ".pmap") return FileKind::map;
  return FileKind::mesh;
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

/// The table has it already.
bool isShownAbove(const std::pair<std::string, std::string>& entry) {
  return entry.first == "name" || entry.first == "class" || entry.first.starts_with("file_");
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
    std::remove_copy_if(grid.metadata.begin(), grid.metadata.end(), std::back_inserter(own),
                        [&](const Entry& entry) { return shared(entry) || isShownAbove(entry); });
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

void describeMap(const fs::path& path, Session& session) {
  const MapFileInfo info = session.timed("load", [&] { return readMapFileInfo(path); });
  const Json header = Json::parse(info.headerJson);
  session.json()["file"] = {{"format", "pmap"}, {"bytes", info.bytes}};
  session.json()["map"] = header;

  std::vector<std::vector<std::string>> rows;
  for (const char* name : {"source", "arguments", "domain", "core"}) {
    rows.push_back({name, header.value(name, "")});
  }
  if (header.contains("sphere")) {
    rows.push_back({"boundary", header["sphere"].value("kind", "")});
    rows.push_back(
        {"flips",
         grouped(header["sphere"].value("flips", std::uint64_t{0})) + " of phi, " +
             grouped(header.value("chart", Json::object()).value("direction_flips", std::uint64_t{0})) +
             " of omega"});
  }
  if (header.contains("radius")) rows.push_back({"radius", header["radius"].value("kind", "")});
  if (const Json weight = header.value("balance_volume", Json()); weight.is_number())
    rows.push_back({"balance volume", shortNumber(weight.get<double>())});
  if (header.contains("domain_shape")) {
    const Json& shape = header["domain_shape"];
    rows.push_back({"domain cells", "of side " + shortNumber(shape.value("cell_side", 0.0)) +
                                        "; overlap with the solid " +
                                        shortNumber(shape.value("overlap", 0.0))});
  }
  for (const Json& array : header.value("arrays", Json::array())) {
    const std::string name = array.value("name", "");
    if (name != "vertices" && name != "triangles") continue;
    rows.push_back({name, grouped(array["shape"][0].get<std::uint64_t>())});
  }
  if (const Json green = header.value("green", Json::object()); green.contains("signs")) {
    const Json& last = green["signs"].back();
    const bool proved = last["radial"]["failed"] == 0;
    rows.push_back(
        {"critical", proved ? "no point but the center within " +
                                  shortNumber(1 - last["delta"].get<double>()) + " of the solid (proved)"
                            : "not excluded: " + grouped(last["radial"]["failed"].get<std::uint64_t>()) +
                                  " of " + grouped(last["faces"].get<std::uint64_t>()) + " faces open at " +
                                  shortNumber(1 - last["delta"].get<double>())});
  }
  rows.push_back({"hash", info.hash});
  session.text() = path.filename().string() + ": map, " + byteSize(info.bytes) + ", written by polestar " +
                   info.version + "\n" + table(rows, {}, "  ");
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

void describeDevices(Session& session) {
  const ComputeDevices found = listComputeDevices();
  Json& list = session.json()["devices"] = Json::array();
  std::vector<std::vector<std::string>> rows{
      {"--device", "name", "platform", "kind", "doubles", "units", "memory"}};
  for (const ComputeDevice& device : found.devices) {
    const std::string choice = "opencl:" + std::to_string(list.size());
    list.push_back({{"device", choice},
                    {"name", device.name},
                    {"platform", device.platform},
                    {"gpu", device.gpu},
                    {"double_precision", device.doublePrecision},
                    {"compute_units", device.computeUnits},
                    {"memory_bytes", device.memoryBytes}});
    rows.push_back({choice, device.name, device.platform, device.gpu ? "GPU" : "other",
                    device.doublePrecision ? "yes" : "no", grouped(device.computeUnits),
                    byteSize(device.memoryBytes)});
  }
  if (found.devices.empty()) session.json()["reason"] = found.reason;
  session.text() = found.devices.empty() ? "no OpenCL device: " + found.reason + "\n" : table(rows, {5, 6});
}

class InfoCommand final : public Command {
 public:
  Description description() const override {
    return {"info",
            "What a file holds: grids of a .vdb, facts of a .pmap, counts and box of a mesh; or --devices",
            "Write the answer to FILE instead of standard output", "polestar info asteroid.vdb"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("FILE", file_, "A .vdb, a .pmap, or a mesh: .obj, .ply, .stl or .off")->type_name("");
    app.add_flag("--devices", devices_, "List what --device of other commands can name, instead of a file");
  }

  void run(Session& session) override {
    if (file_.empty() != devices_) throw Error(Errc::usage, "name one FILE, or ask for --devices");
    if (!devices_) session.addInput(file_);
    session.sendAnswerToOutput();
    if (session.options().dryRun) return describePlan(session);
    if (devices_) return describeDevices(session);
    switch (fileKind(file_)) {
      case FileKind::grids:
        return describeGrids(file_, session);
      case FileKind::map:
        return describeMap(file_, session);
      case FileKind::mesh:
        return describeMesh(file_, session);
    }
  }

 private:
  fs::path file_;
  bool devices_ = false;
};

}  // namespace

std::unique_ptr<Command> makeInfoCommand() { return std::make_unique<InfoCommand>(); }

}  // namespace polestar::cli
