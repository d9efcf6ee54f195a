#pragma once
// Meshes as files of every format, written by the tests themselves: what the readers are held against.

#include <bit>
#include <cstdint>
#include <cstdio>
#include <string>

#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

inline std::string text(double value) {
  char digits[40];
  std::snprintf(digits, sizeof digits, "%.17g", value);
  return digits;
}

inline std::string text(const Vec3& v) { return text(v[0]) + " " + text(v[1]) + " " + text(v[2]); }

template <class T>
std::string raw(T value, std::endian order = std::endian::little) {
  std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
  return order == std::endian::native ? bytes : std::string(bytes.rbegin(), bytes.rend());
}

inline std::string objText(const TriMesh& mesh) {
  std::string out = "# a comment\no body\n";
  for (const Vec3& v : mesh.vertices) out += "v " + text(v) + "\n";
  for (const Triangle& t : mesh.triangles) {
    out += "f " + std::to_string(t[0] + 1) + " " + std::to_string(t[1] + 1) + " " + std::to_string(t[2] + 1) +
           "\n";
  }
  return out;
}

inline std::string offText(const TriMesh& mesh) {
  std::string out =
      "OFF\n" + std::to_string(mesh.vertices.size()) + " " + std::to_string(mesh.triangles.size()) + " 0\n";
  for (const Vec3& v : mesh.vertices) out += text(v) + "\n";
  for (const Triangle& t : mesh.triangles) {
    out += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
  }
  return out;
}

inline std::string plyHeader(const TriMesh& mesh, const std::string& format, const std::string& type) {
  return "ply\nformat " + format + " 1.0\nelement vertex " + std::to_string(mesh.vertices.size()) +
         "\nproperty " + type + " x\nproperty " + type + " y\nproperty " + type + " z\nelement face " +
         std::to_string(mesh.triangles.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

inline std::string plyText(const TriMesh& mesh) {
  std::string out = plyHeader(mesh, "ascii", "double");
  for (const Vec3& v : mesh.vertices) out += text(v) + "\n";
  for (const Triangle& t : mesh.triangles) {
    out += "3 " + std::to_string(t[0]) + " " + std::to_string(t[1]) + " " + std::to_string(t[2]) + "\n";
  }
  return out;
}

/// Coordinates of type T.
template <class T>
std::string plyBinary(const TriMesh& mesh, std::endian order) {
  std::string out =
      plyHeader(mesh, order == std::endian::little ? "binary_little_endian" : "binary_big_endian",
                sizeof(T) == 8 ? "double" : "float");
  for (const Vec3& v : mesh.vertices) {
    for (int k = 0; k < 3; ++k) out += raw(static_cast<T>(v[k]), order);
  }
  for (const Triangle& t : mesh.triangles) {
    out += '\3';
    for (const std::int32_t v : t) out += raw(v, order);
  }
  return out;
}

inline std::string stlText(const TriMesh& mesh) {
  std::string out = "solid body\n";
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    out += " facet normal nan 0 0\n  outer loop\n";
    for (int k = 0; k < 3; ++k) out += "   vertex " + text(mesh.corner(t, k)) + "\n";
    out += "  endloop\n endfacet\n";
  }
  return out + "endsolid body\n";
}

inline std::string stlBinary(const TriMesh& mesh, std::string header = "binary") {
  header.resize(80, ' ');
  std::string out = header + raw(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    out += std::string(12, '\0');
    for (int k = 0; k < 3; ++k) {
      for (int c = 0; c < 3; ++c) out += raw(static_cast<float>(mesh.corner(t, k)[c]));
    }
    out += std::string(2, '\0');
  }
  return out;
}

/// Reads `bytes` as if they were the content of file `name`.
inline MeshFile parse(const std::string& name, std::string bytes) {
  return detail::parseMesh(detail::MeshSource{name, std::move(bytes)});
}

/// The message with which reading fails; empty when it does not fail or not with Errc::io.
inline std::string parseError(const std::string& name, std::string bytes) {
  try {
    parse(name, std::move(bytes));
  } catch (const Error& error) {
    if (error.code() == Errc::io) return error.what();
  }
  return {};
}

}  // namespace polestar::testing
