#pragma once
// One model, measured: its map as `polestar map` makes it, what the choices of boundary and radius do to it,
// and other methods on the same tetrahedra. Green's function and its field lines are found once for all.

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "results.h"

namespace polestar::bench {

/// The rows of a model.
enum class Part {
  map,        ///< the default options' map, its certificate, time and memory
  choices,    ///< distortion by boundary and radius
  comparison  ///< ours and others on one mesh of tetrahedra
};
inline constexpr std::array kParts{Part::map, Part::choices, Part::comparison};
const char* toString(Part part);

struct MeasureOptions {
  int dim = 128;  ///< voxels along the longest side of the grids that the certificate judges
  /// Vertices of the surface up to which tetrahedra are compared: TetGen and its harmonic functions take
  /// minutes beyond.
  std::size_t mostVertices = 10000;
  int galaxySeconds = 120;  ///< after which Galaxy Maps is stopped
};

/// The rows of `parts`, each with `model`, `part` and `status`: "ok", or "left out: ..." or "failed: ...".
/// @throws std::exception when a stage before them fails.
std::vector<Json> measureModel(const std::filesystem::path& file, const std::vector<Part>& parts,
                               const MeasureOptions& options);

/// What a row of that model and part says when measureModel() threw.
Json failedRow(const std::string& model, Part part, const std::string& status);

}  // namespace polestar::bench
