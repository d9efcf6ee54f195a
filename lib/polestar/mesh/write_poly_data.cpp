#include <algorithm>
#include <span>

#include "polestar/core/error.h"
#include "polestar/mesh/detail/mesh_bytes_out.h"
#include "polestar/mesh/poly_data.h"

namespace polestar {
namespace {

using detail::appendBytes;
using detail::appendText;
using detail::commentLines;

// --- OBJ -------------------------------------------------------------------------------------------------

void appendElement(std::string& out, char kind, std::span<const std::int32_t> points) {
  out += kind;
  for (const std::int32_t p : points) {
    out += ' ';
    appendText(out, p + 1);
  }
  out += '\n';
}

std::string objBytes(const PolyData& data, const std::string& comment) {
  std::string out = commentLines(comment, "# ");
  for (const Vec3& p : data.points) {
    out += 'v';
    for (int k = 0; k < 3; ++k) {
      out += ' ';
      appendText(out, p[k]);
    }
    out += '\n';
  }
  for (const PolyPart& part : data.parts) {
    out += "o " + part.name + "\n";
    for (const Triangle& t : part.triangles) appendElement(out, 'f', t);
    for (const auto& q : part.quads) appendElement(out, 'f', q);
    for (const auto& line : part.lines) appendElement(out, 'l', line);
  }
  return out;
}

// --- PLY -------------------------------------------------------------------------------------------------

const char* const kAxes[] = {"x", "y", "z"};

void appendPlyProperties(std::string& out, const MeshData& values) {
  for (int c = 0; c < values.components; ++c) {
    out += "property double " + values.name;
    if (values.components > 1) out += std::string("_") + kAxes[c];
    out += '\n';
  }
}

std::string plyBytes(const PolyData& data, const std::string& comment) {
  std::size_t edges = 0;
  for (const PolyPart& part : data.parts) {
    for (const auto& line : part.lines) edges += line.size() - 1;
  }
  std::string out = "ply\nformat binary_little_endian 1.0\n" + commentLines(comment, "comment ");
  for (std::size_t p = 0; p < data.parts.size(); ++p)
    out += "comment part " + std::to_string(p) + " " + data.parts[p].name + "\n";
  out += "element vertex " + std::to_string(data.points.size()) + "\n";
  for (const char* axis : kAxes) out += std::string("property double ") + axis + "\n";
  for (const MeshData& values : data.pointData) appendPlyProperties(out, values);
  out += "element face " + std::to_string(data.faceCount()) +
         "\nproperty list uchar int vertex_indices\nproperty int part\nelement edge " +
         std::to_string(edges) +
         "\nproperty int vertex1\nproperty int vertex2\nproperty int part\nend_header\n";
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    for (int k = 0; k < 3; ++k) appendBytes(out, data.points[i][k]);
    for (const MeshData& values : data.pointData) {
      const auto width = static_cast<std::size_t>(values.components);
      for (std::size_t c = 0; c < width; ++c) appendBytes(out, values.values[width * i + c]);
    }
  }
  const auto appendFace = [&](std::span<const std::int32_t> corners, std::int32_t part) {
    out += static_cast<char>(corners.size());
    for (const std::int32_t corner : corners) appendBytes(out, corner);
    appendBytes(out, part);
  };
  for (std::size_t p = 0; p < data.parts.size(); ++p) {
    for (const Triangle& t : data.parts[p].triangles) appendFace(t, static_cast<std::int32_t>(p));
    for (const auto& q : data.parts[p].quads) appendFace(q, static_cast<std::int32_t>(p));
  }
  for (std::size_t p = 0; p < data.parts.size(); ++p) {
    for (const auto& line : data.parts[p].lines) {
      for (std::size_t i = 0; i + 1 < line.size(); ++i) {
        for (const std::int32_t end : {line[i], line[i + 1], static_cast<std::int32_t>(p)})
          appendBytes(out, end);
      }
    }
  }
  return out;
}

// --- VTP -------------------------------------------------------------------------------------------------

std::string base64(const std::string& bytes) {
  static constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t have = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (k < have ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) out += k <= have ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

/// Binary in the place where text would stand: the bytes behind their number.
std::string arrayElement(const std::string& attributes, const std::string& bytes) {
  std::string counted;
  appendBytes(counted, static_cast<std::uint64_t>(bytes.size()));
  return "<DataArray " + attributes + " format=\"binary\">" + base64(counted + bytes) + "</DataArray>\n";
}

template <class Number>
std::string bytesOf(const std::vector<Number>& numbers) {
  std::string out;
  for (const Number number : numbers) appendBytes(out, number);
  return out;
}

/// VTK keeps strings in files as the codes of their characters, each string with a 0 behind it.
std::string stringsElement(const std::string& name, const std::vector<std::string>& strings) {
  std::string out = "<Array type=\"String\" Name=\"" + name + "\" NumberOfTuples=\"" +
                    std::to_string(strings.size()) + "\" format=\"ascii\">";
  for (const std::string& text : strings) {
    for (const char c : text) out += std::to_string(static_cast<unsigned char>(c)) + " ";
    out += "0 ";
  }
  return out + "</Array>\n";
}

/// Cells of one kind: their points one after the other, and where each ends.
struct CellArray {
  std::vector<std::int64_t> connectivity, offsets;
  void add(std::span<const std::int32_t> points) {
    connectivity.insert(connectivity.end(), points.begin(), points.end());
    offsets.push_back(static_cast<std::int64_t>(connectivity.size()));
  }
  std::string element(const std::string& kind) const {
    return "<" + kind + ">\n" + arrayElement("type=\"Int64\" Name=\"connectivity\"", bytesOf(connectivity)) +
           arrayElement("type=\"Int64\" Name=\"offsets\"", bytesOf(offsets)) + "</" + kind + ">\n";
  }
};

std::string pointDataElement(const PolyData& data) {
  std::string out = "<PointData>\n";
  for (const MeshData& values : data.pointData) {
    out += arrayElement("type=\"Float64\" Name=\"" + values.name + "\" NumberOfComponents=\"" +
                            std::to_string(values.components) + "\"",
                        bytesOf(values.values));
  }
  return out + "</PointData>\n";
}

std::string vtpBytes(const PolyData& data, const std::string& comment) {
  // Lines come before faces, as VTK counts cells.
  CellArray lines, faces;
  std::vector<std::int32_t> partOfLine, partOfFace;
  std::vector<std::string> names;
  for (std::size_t p = 0; p < data.parts.size(); ++p) {
    const PolyPart& part = data.parts[p];
    names.push_back(part.name);
    for (const auto& line : part.lines) lines.add(line);
    for (const Triangle& t : part.triangles) faces.add(t);
    for (const auto& q : part.quads) faces.add(q);
    partOfLine.resize(lines.offsets.size(), static_cast<std::int32_t>(p));
    partOfFace.resize(faces.offsets.size(), static_cast<std::int32_t>(p));
  }
  partOfLine.insert(partOfLine.end(), partOfFace.begin(), partOfFace.end());
  std::string points;
  for (const Vec3& point : data.points) {
    for (int k = 0; k < 3; ++k) appendBytes(points, point[k]);
  }
  return "<?xml version=\"1.0\"?>\n"
         "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">\n"
         "<PolyData>\n<FieldData>\n" +
         stringsElement("made_by", {comment}) + stringsElement("part_names", names) +
         "</FieldData>\n<Piece NumberOfPoints=\"" + std::to_string(data.points.size()) +
         "\" NumberOfVerts=\"0\" NumberOfLines=\"" + std::to_string(lines.offsets.size()) +
         "\" NumberOfStrips=\"0\" NumberOfPolys=\"" + std::to_string(faces.offsets.size()) + "\">\n" +
         pointDataElement(data) + "<CellData>\n" +
         arrayElement("type=\"Int32\" Name=\"part\"", bytesOf(partOfLine)) + "</CellData>\n<Points>\n" +
         arrayElement("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", points) + "</Points>\n" +
         lines.element("Lines") + faces.element("Polys") + "</Piece>\n</PolyData>\n</VTKFile>\n";
}

}  // namespace

std::size_t PolyData::faceCount() const {
  std::size_t count = 0;
  for (const PolyPart& part : parts) count += part.triangles.size() + part.quads.size();
  return count;
}

std::size_t PolyData::lineCount() const {
  std::size_t count = 0;
  for (const PolyPart& part : parts) count += part.lines.size();
  return count;
}

bool isPolyDataOutputName(const std::filesystem::path& path) {
  const std::string extension = detail::lowerExtension(path);
  return extension == ".obj" || extension == ".vtp" || extension == ".ply";
}

void writePolyData(const std::filesystem::path& path, const PolyData& data, const std::string& comment) {
  if (!isPolyDataOutputName(path)) {
    throw Error(Errc::usage,
                "cannot write " + path.string() + ": surfaces and curves are written as .obj, .vtp or .ply");
  }
  const std::string extension = detail::lowerExtension(path);
  detail::writeWhole(path, extension == ".obj"   ? objBytes(data, comment)
                           : extension == ".ply" ? plyBytes(data, comment)
                                                 : vtpBytes(data, comment));
}

}  // namespace polestar
