#pragma once
// Maps for the judge of .pmap files: cones made here, and one of the library.

#include <filesystem>

#include "polestar/map/ball_map.h"
#include "verify/pmap_file.h"

namespace polestar::testing {

/// A small body of the library, mapped; made once.
const BallMap& smallMap();

/// Through a file, as the judge gets it.
verify::PmapContents contentsOf(const BallMap& map);

/// Nodes on straight rays from the vertices to the origin, their images on the same rays, at `levels` equal
/// steps.
void fillLevels(verify::PmapContents& map, std::size_t levels);
verify::PmapContents coneMap(const TriMesh& mesh, std::size_t levels);

/// A .pmap as bytes, taken apart so that numbers can be changed and the hash made to fit again.
class PmapBytes {
 public:
  explicit PmapBytes(const std::filesystem::path& path);
  struct Array {
    std::string name, type;
    std::size_t count = 0;   ///< of numbers
    std::size_t offset = 0;  ///< in `data`
  };
  std::vector<Array> arrays;
  std::string data;    ///< all arrays
  std::string header;  ///< JSON without the hash
  std::uint32_t format = 0;
  void write(const std::filesystem::path& path) const;
};

}  // namespace polestar::testing
