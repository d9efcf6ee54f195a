#include "polestar/io/usd_volume.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <fstream>
#include <map>
#include <set>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar {
namespace {

namespace fs = std::filesystem;

/// OpenVDB's types in the words of OpenVDBAsset; empty: there is none.
std::string dataTypeOf(const GridInfo& grid) {
  static const std::map<std::string, std::string> kTypes{
      {"float", "float"}, {"double", "double"}, {"int32", "int"},    {"int64", "int64"},
      {"bool", "bool"},   {"mask", "mask"},     {"vec3s", "float3"}, {"vec3d", "double3"},
      {"vec3i", "int3"},  {"string", "string"}};
  const auto found = kTypes.find(grid.valueType);
  return found == kTypes.end() ? "" : found->second;
}

bool isVector(const GridInfo& grid) { return grid.valueType.starts_with("vec3"); }

std::string classOf(const GridInfo& grid) {
  if (grid.gridClass == "level set") return "levelSet";
  if (grid.gridClass == "fog volume") return "fogVolume";
  return grid.gridClass == "staggered" ? "staggered" : "unknown";
}

std::string roleOf(const GridInfo& grid) {
  if (grid.name == "Cd" || grid.name == "color") return "Color";
  switch (grid.role) {
    case ValueRole::contravariant:
    case ValueRole::covariant:
      return "Vector";
    case ValueRole::covariantNormalized:
      return "Normal";
    case ValueRole::position:
      return "Point";
    case ValueRole::invariant:
      break;
  }
  return "None";
}

std::string number(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, value).ptr};
}

/// As extents are stored.
std::string single(double value) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, static_cast<float>(value)).ptr};
}

std::string quoted(const std::string& text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result + "\"";
}

/// A name that a prim can have.
std::string identifier(const std::string& text) {
  std::string result;
  for (const char c : text) result += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  if (result.empty() || std::isdigit(static_cast<unsigned char>(result[0]))) result.insert(0, "_");
  return result;
}

std::string assetPath(const fs::path& file, const fs::path& usda) {
  const fs::path folder = fs::absolute(usda).parent_path();
  std::string path = fs::absolute(file).lexically_normal().lexically_relative(folder.lexically_normal());
  if (path.empty()) path = fs::absolute(file).lexically_normal();
  if (!path.starts_with("../") && !path.starts_with("/")) path.insert(0, "./");
  return path.find('@') == std::string::npos ? "@" + path + "@" : "@@@" + path + "@@@";
}

std::string extentOf(const UsdVolume::Frame& frame) {
  Box box;
  for (const GridInfo& grid : frame.grids) {
    box.min = box.min.cwiseMin(grid.box.min);
    box.max = box.max.cwiseMax(grid.box.max);
  }
  if (!(box.extent().minCoeff() >= 0)) box = {Vec3::Zero(), Vec3::Zero()};
  const auto point = [](const Vec3& p) {
    return "(" + single(p.x()) + ", " + single(p.y()) + ", " + single(p.z()) + ")";
  };
  return "[" + point(box.min) + ", " + point(box.max) + "]";
}

class Writer {
 public:
  Writer(const fs::path& path, const UsdVolume& volume) : path_(path), volume_(volume) {}

  std::string text(const std::string& comment) {
    const std::vector<GridInfo> fields = usdFields(volume_.frames.front().grids);
    if (fields.empty())
      throw Error(Errc::usage, volume_.frames.front().file.string() + " has no grid that a .usda can name");
    const std::string root = identifier(path_.stem().string());
    header(root, comment);
    out_ += "def Volume " + quoted(root) + "\n{\n";
    attribute("    ", "float3[] extent", [](const UsdVolume::Frame& frame) { return extentOf(frame); });
    std::vector<std::string> names;
    for (const GridInfo& grid : fields) {
      names.push_back(uniqueName(identifier(grid.name)));
      out_ += "    rel field:" + names.back() + " = </" + root + "/" + names.back() + ">\n";
    }
    for (std::size_t i = 0; i < fields.size(); ++i) field(fields, i, names[i]);
    out_ += "}\n";
    return std::move(out_);
  }

 private:
  bool sequence() const { return volume_.frames.front().frame.has_value(); }

  void header(const std::string& root, const std::string& comment) {
    out_ = "#usda 1.0\n(\n    defaultPrim = " + quoted(root) + "\n";
    if (!comment.empty()) out_ += "    doc = " + quoted(comment) + "\n";
    if (sequence()) {
      out_ += "    endTimeCode = " + std::to_string(*volume_.frames.back().frame) + "\n";
      out_ += "    framesPerSecond = " + number(volume_.framesPerSecond) + "\n";
    }
    out_ += "    metersPerUnit = " + number(volume_.metersPerUnit) + "\n";
    if (sequence()) {
      out_ += "    startTimeCode = " + std::to_string(*volume_.frames.front().frame) + "\n";
      out_ += "    timeCodesPerSecond = " + number(volume_.framesPerSecond) + "\n";
    }
    out_ += "    upAxis = \"" + std::string(1, volume_.upAxis) + "\"\n)\n\n";
  }

  /// A value that may change from frame to frame.
  template <class Value>
  void attribute(const std::string& indent, const std::string& name, Value&& value) {
    if (!sequence()) {
      out_ += indent + name + " = " + value(volume_.frames.front()) + "\n";
      return;
    }
    out_ += indent + name + ".timeSamples = {\n";
    for (const UsdVolume::Frame& frame : volume_.frames)
      out_ += indent + "    " + std::to_string(*frame.frame) + ": " + value(frame) + ",\n";
    out_ += indent + "}\n";
  }

  void field(const std::vector<GridInfo>& fields, std::size_t i, const std::string& name) {
    const GridInfo& grid = fields[i];
    const auto index = std::count_if(fields.begin(), fields.begin() + static_cast<std::ptrdiff_t>(i),
                                     [&](const GridInfo& before) { return before.name == grid.name; });
    out_ += "\n    def OpenVDBAsset " + quoted(name) + "\n    {\n";
    out_ += "        token fieldClass = " + quoted(classOf(grid)) + "\n";
    out_ += "        token fieldDataType = " + quoted(dataTypeOf(grid)) + "\n";
    out_ += "        int fieldIndex = " + std::to_string(index) + "\n";
    out_ += "        token fieldName = " + quoted(grid.name) + "\n";
    attribute("        ", "asset filePath",
              [&](const UsdVolume::Frame& frame) { return assetPath(frame.file, path_); });
    if (isVector(grid)) out_ += "        token vectorDataRoleHint = " + quoted(roleOf(grid)) + "\n";
    out_ += "    }\n";
  }

  std::string uniqueName(const std::string& wanted) {
    std::string name = wanted;
    for (int k = 1; !used_.insert(name).second; ++k) name = wanted + "_" + std::to_string(k);
    return name;
  }

  const fs::path& path_;
  const UsdVolume& volume_;
  std::set<std::string> used_;
  std::string out_;
};

void requireSameGrids(const UsdVolume& volume) {
  const auto namesOf = [](const UsdVolume::Frame& frame) {
    std::set<std::pair<std::string, std::string>> names;
    for (const GridInfo& grid : frame.grids) names.emplace(grid.name, grid.valueType);
    return names;
  };
  const auto first = namesOf(volume.frames.front());
  for (const UsdVolume::Frame& frame : volume.frames) {
    if (namesOf(frame) == first) continue;
    throw Error(Errc::io, frame.file.string() + " has other grids than " +
                              volume.frames.front().file.string() +
                              ": a sequence needs the same in every frame");
  }
}

}  // namespace

std::vector<GridInfo> usdFields(const std::vector<GridInfo>& grids) {
  std::vector<GridInfo> fields = grids;
  std::erase_if(fields, [](const GridInfo& grid) { return dataTypeOf(grid).empty(); });
  return fields;
}

void writeUsdVolume(const fs::path& path, const UsdVolume& volume, const std::string& comment) {
  requireSameGrids(volume);
  const std::string text = Writer(path, volume).text(comment);
  writeAtomically(path, [&](const fs::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out << text << std::flush;
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + "; is the disk full?");
  });
}

}  // namespace polestar
