#include "polestar/mesh/write_mesh.h"

#include <algorithm>
#include <bit>
#include <cctype>
#include <charconv>
#include <cstring>
#include <fstream>
#include <sstream>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"

namespace polestar {
namespace {

static_assert(std::endian::native == std::endian::little, "binary PLY is written in native byte order");

template <class Number>
void appendText(std::string& out, Number value) {
  char buffer[32];
  const auto result = std::to_chars(buffer, buffer + sizeof buffer, value);
  out.append(buffer, result.ptr);
}

template <class Value>
void appendBytes(std::string& out, const Value& value) {
  char bytes[sizeof value];
  std::memcpy(bytes, &value, sizeof value);
  out.append(bytes, sizeof value);
}

std::string commentLines(const std::string& comment, const std::string& prefix) {
  std::string out;
  std::istringstream lines(comment);
  for (std::string line; std::getline(lines, line);) out += prefix + line + "\n";
  return out;
}

std::string objBytes(const TriMesh& mesh, const std::string& comment) {
  std::string out = commentLines(comment, "# ");
  for (const Vec3& v : mesh.vertices) {
    out += 'v';
    for (int k = 0; k < 3; ++k) {
      out += ' ';
      appendText(out, v[k]);
    }
    out += '\n';
  }
  for (const Triangle& t : mesh.triangles) {
    out += 'f';
    for (const std::int32_t index : t) {
      out += ' ';
      appendText(out, index + 1);
    }
    out += '\n';
  }
  return out;
}

std::string plyBytes(const TriMesh& mesh, const std::string& comment) {
  std::string out =
      "ply\nformat binary_little_endian 1.0\n" + commentLines(comment, "comment ") + "element vertex ";
  appendText(out, mesh.vertices.size());
  out += "\nproperty double x\nproperty double y\nproperty double z\nelement face ";
  appendText(out, mesh.triangles.size());
  out += "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vec3& v : mesh.vertices) {
    for (int k = 0; k < 3; ++k) appendBytes(out, v[k]);
  }
  for (const Triangle& t : mesh.triangles) {
    out += '\3';
    for (const std::int32_t index : t) appendBytes(out, index);
  }
  return out;
}

}  // namespace

void writeMesh(const std::filesystem::path& path, const TriMesh& mesh, const std::string& comment) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".obj" && extension != ".ply") {
    throw Error(Errc::usage, "cannot write " + path.string() + ": meshes are written as .obj or .ply");
  }
  const std::string bytes = extension == ".obj" ? objBytes(mesh, comment) : plyBytes(mesh, comment);
  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + ": the disk may be full");
  });
}

}  // namespace polestar
