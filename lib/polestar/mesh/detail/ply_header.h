#pragma once
// The header of a PLY file: which elements with which properties follow, and in which encoding.

#include <cstdint>
#include <string>
#include <vector>

#include "polestar/mesh/detail/mesh_source.h"

namespace polestar::detail {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };
std::size_t plyBytes(PlyType type);
bool plyIsInteger(PlyType type);

struct PlyProperty {
  std::string name;
  PlyType type;
  bool isList = false;
  PlyType countType = PlyType::uint8;  ///< of a list
};

struct PlyElement {
  std::string name;
  std::uint64_t count;  ///< as claimed
  std::vector<PlyProperty> properties;

  /// Position of the property of that name, or -1.
  int find(std::string_view propertyName) const;
};

enum class PlyEncoding { ascii, littleEndian, bigEndian };

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::ascii;
  std::vector<PlyElement> elements;
  std::size_t dataOffset = 0;  ///< first byte behind the header
  std::size_t lines = 0;       ///< of the header
};

/// @throws Error{Errc::io} naming the line.
PlyHeader parsePlyHeader(const MeshSource& source);

}  // namespace polestar::detail
