#pragma once
// The .pmap file: a map that lasts. It holds everything forward() and inverse() need, in doubles; the grids
// of a .vdb are a picture of it. Format 3 keeps how the table bends too (NodeBends), which files of format 2
// have found again whenever they are read, with the same result. Format 4 has a domain of its own, a cube or
// polycube: its map in `domain_map` and in arrays whose names begin with `domain_`, and the motion of the
// ball between the two.
//
// Layout (little endian): "POLESTAR", uint32 format (3 or 4), uint32 length of the header, the header as
// JSON, zeros up to a multiple of 64; then the arrays at the offsets that the header names. `hash` in the
// header is the 128-bit XXH3 of the header without its hash and of all arrays.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "polestar/map/ball_map.h"
#include "polestar/map/domain_map.h"

namespace polestar {

struct MapProvenance {
  std::string source;     ///< the mesh file, as the user named it
  std::string arguments;  ///< the command line that made the map
  /// BalanceOptions::volumeWeight of a balanced boundary or radius; nothing where neither is.
  std::optional<double> balanceVolume;
};

/// Writes atomically and returns the hash, 32 hexadecimal digits, which a .vdb made from the map carries.
/// @throws Error{Errc::io}
std::string writeMapFile(const std::filesystem::path& path, const BallMap& map,
                         const MapProvenance& provenance = {});
std::string writeMapFile(const std::filesystem::path& path, const DomainMap& map,
                         const MapProvenance& provenance = {});

/// Of the numbers that its file holds: NaN and infinite ones.
std::size_t countNotFinite(const BallMap& map);

struct MapFile {
  BallMap map;  ///< onto the ball, also where the domain is another
  MapProvenance provenance;
  std::string hash;
  std::string version;              ///< of polestar, when it was written
  std::optional<DomainMap> domain;  ///< nothing: the ball
};

/// Reads and verifies: hash, sizes, and the star test of the stored surface about the stored center.
/// @throws Error{Errc::io} for a file that is missing, truncated, damaged or of another format;
/// Error{Errc::invalidSurface / notStarShaped} when the stored surface is not what a map needs.
MapFile readMapFile(const std::filesystem::path& path);

/// What `polestar info` says of a .pmap, without rebuilding the map.
struct MapFileInfo {
  std::string version, hash, headerJson;
  std::uint64_t bytes = 0;
};
/// @throws Error{Errc::io}
MapFileInfo readMapFileInfo(const std::filesystem::path& path);

}  // namespace polestar
