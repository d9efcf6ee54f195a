#include "polestar/mesh/write_mesh.h"

#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>

#include "polestar/core/error.h"
#include "polestar/mesh/detail/mesh_bytes_out.h"

namespace polestar {
namespace {

using detail::appendBytes;
using detail::appendText;
using detail::commentLines;

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

static_assert(sizeof(Vec3) == 24 && sizeof(Triangle) == 12 && std::endian::native == std::endian::little);

std::string plyBytes(const TriMesh& mesh, const std::string& comment) {
  std::string out =
      "ply\nformat binary_little_endian 1.0\n" + commentLines(comment, "comment ") + "element vertex ";
  appendText(out, mesh.vertices.size());
  out += "\nproperty double x\nproperty double y\nproperty double z\nelement face ";
  appendText(out, mesh.triangles.size());
  out += "\nproperty list uchar int vertex_indices\nend_header\n";
  std::size_t at = out.size();
  out.resize(at + sizeof(Vec3) * mesh.vertices.size() + (1 + sizeof(Triangle)) * mesh.triangles.size());
  // As they lie in memory: little-endian, as the machines that OpenVDB runs on.
  std::memcpy(&out[at], mesh.vertices.data(), sizeof(Vec3) * mesh.vertices.size());
  at += sizeof(Vec3) * mesh.vertices.size();
  for (const Triangle& t : mesh.triangles) {
    out[at] = '\3';
    std::memcpy(&out[at + 1], t.data(), sizeof t);
    at += 1 + sizeof t;
  }
  return out;
}

// Without a comment: TetGen, for one, stumbles over them.
std::string offBytes(const TriMesh& mesh) {
  std::string out = "OFF\n";
  appendText(out, mesh.vertices.size());
  out += ' ';
  appendText(out, mesh.triangles.size());
  out += " 0\n";
  for (const Vec3& v : mesh.vertices) {
    for (int k = 0; k < 3; ++k) {
      if (k > 0) out += ' ';
      appendText(out, v[k]);
    }
    out += '\n';
  }
  for (const Triangle& t : mesh.triangles) {
    out += '3';
    for (const std::int32_t index : t) {
      out += ' ';
      appendText(out, index);
    }
    out += '\n';
  }
  return out;
}

std::string stlBytes(const TriMesh& mesh, const std::string& comment) {
  // A header that begins with "solid" makes some programs take the file for text.
  std::string out = comment.substr(0, comment.find('\n')).substr(0, 80);
  if (out.starts_with("solid")) out[0] = 'S';
  out.resize(80, ' ');
  appendBytes(out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = areaVector(mesh, t).normalized();
    for (int k = 0; k < 3; ++k) appendBytes(out, static_cast<float>(normal[k]));
    for (int corner = 0; corner < 3; ++corner) {
      for (int k = 0; k < 3; ++k) appendBytes(out, static_cast<float>(mesh.corner(t, corner)[k]));
    }
    appendBytes(out, std::uint16_t{0});
  }
  return out;
}

}  // namespace

bool isMeshOutputName(const std::filesystem::path& path) {
  const std::string extension = detail::lowerExtension(path);
  return extension == ".obj" || extension == ".ply" || extension == ".off" || extension == ".stl";
}

std::string meshBytes(const std::string& extension, const TriMesh& mesh, const std::string& comment) {
  if (mesh.triangles.size() > std::numeric_limits<std::uint32_t>::max())
    throw Error(Errc::usage, "too many triangles for a mesh file");
  if (extension == ".obj") return objBytes(mesh, comment);
  if (extension == ".ply") return plyBytes(mesh, comment);
  if (extension == ".off") return offBytes(mesh);
  if (extension == ".stl") return stlBytes(mesh, comment);
  throw Error(Errc::usage, "meshes are written as .obj, .ply, .off or .stl");
}

void writeMesh(const std::filesystem::path& path, const TriMesh& mesh, const std::string& comment) {
  if (!isMeshOutputName(path)) {
    throw Error(Errc::usage,
                "cannot write " + path.string() + ": meshes are written as .obj, .ply, .off or .stl");
  }
  detail::writeWhole(path, meshBytes(detail::lowerExtension(path), mesh, comment));
}

}  // namespace polestar
