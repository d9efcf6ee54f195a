#pragma once
// How much a map of a solid distorts: angles by the volumetric MIPS measure, volumes by their spread.

#include <span>
#include <vector>

#include "polestar/map/domain_map.h"

namespace polestar {

/// Over the derivatives J of a map at points that stand for equal volumes of the solid. MIPS: |J|^2 / (3 det
/// J^(2/3)), 1 where the map is a similarity. Volumes: det J over its median.
struct Distortion {
  std::size_t points = 0;
  std::size_t folded = 0;  ///< det J <= 0, or no derivative; left out of the rest
  double mipsMean = 1, mipsP99 = 1;
  double volumeP5 = 1, volumeP95 = 1;
};
/// `medianDeterminant`: of the whole map, where the derivatives are those of a part; 0: their own.
Distortion measureDistortion(std::span<const Mat3> derivatives, double medianDeterminant = 0);

/// Of points whose images lie at such distances from the domain's edges.
struct DistortionBand {
  double from = 0, to = 0;  ///< in sides of a cell
  Distortion distortion;
};

/// At some `points` points spread evenly through the solid, by how far their images lie from the nearest edge
/// of the domain, where its surface turns: up to 0.05, 0.1, 0.2, 0.5 sides of a cell and beyond. About 20 us
/// a point.
std::vector<DistortionBand> distortionByEdges(const DomainMap& map, std::size_t points = 20000);

}  // namespace polestar
