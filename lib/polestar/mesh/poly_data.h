#pragma once
// Surfaces and curves in named parts, with data at their points: what `iso` writes.

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "polestar/mesh/tet_mesh.h"

namespace polestar {

/// A surface, a curve or both; indices are those of PolyData::points, shared or not with other parts.
struct PolyPart {
  std::string name;  ///< without blanks
  std::vector<Triangle> triangles;
  std::vector<std::array<std::int32_t, 4>> quads;
  std::vector<std::vector<std::int32_t>> lines;  ///< along each curve; a closed one ends where it began
};

struct PolyData {
  std::vector<Vec3> points;
  std::vector<PolyPart> parts;
  std::vector<MeshData> pointData;

  /// Numbers of all parts together.
  std::size_t faceCount() const;
  std::size_t lineCount() const;
};

/// Whether writePolyData can write to that name: .obj, .vtp or .ply.
bool isPolyDataOutputName(const std::filesystem::path& path);

/// Writes it; the name's extension says how:
///   .obj  text; every part is an object `o` of `f` and `l`; point data stay out, which the format cannot
///   hold .vtp  VTK XML: point data by name, the cell data `part` counts the parts from 0, field data name
///   them .ply  binary: point data as properties, vectors as NAME_x and so on, curves as edges; faces and
///   edges have
///         a `part`
/// Coordinates and data keep all digits. `comment` goes into the header. Atomic: the file appears whole or
/// not at all.
/// @throws Error{Errc::usage} for another extension, Error{Errc::io} with the reason when it cannot be
/// written.
void writePolyData(const std::filesystem::path& path, const PolyData& data, const std::string& comment = {});

}  // namespace polestar
