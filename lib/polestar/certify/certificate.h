#pragma once
// What is known of a map, and what was only sampled. The verdict says `failed` when a user would see it: a
// flipped triangle on the sphere, an inverted cell of the foliation, an inverted voxel cell below the
// surface, a round trip that misses its voxel.

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "polestar/certify/voxel_cells.h"
#include "polestar/core/context.h"
#include "polestar/map/ball_map.h"

namespace polestar {

enum class Verdict {
  proved,   ///< every check that decides was made by exact arithmetic
  sampled,  ///< nothing failed, some checks were made at samples only
  failed
};
const char* toString(Verdict verdict);

struct Check {
  std::string name;  ///< "foliation_cells", as in the JSON
  bool passed = false;
  bool decides = false;         ///< a failure fails the certificate; otherwise it is a warning
  bool exact = false;           ///< by exact arithmetic over everything, not at samples
  double value = 0, limit = 0;  ///< passed when value <= limit
  std::string detail;           ///< one line for people: what was looked at, what was found
};

/// Signs that lemma 2 promises for the computed field, on the surface shrunk by a share delta towards the
/// center.
struct SignReport {
  std::size_t points = 0;
  std::size_t radialFailures = 0;  ///< (x - c) . grad G >= 0
  std::size_t normalFailures = 0;  ///< n . grad G >= 0, n the normal of the triangle above
  double worstRadial = -1e300;     ///< largest (x - c) . grad G / (|x - c| |grad G|)
};
SignReport sampleSigns(const GreenFunction& green, double delta = 1e-3, std::size_t limit = 20000);

/// forward, rounding to float as grids store it, inverse.
struct RoundTrip {
  std::size_t points = 0;
  std::size_t lost = 0;     ///< the inverse gave no point
  double rms = 0, max = 0;  ///< distance between the ends, mesh units
  Vec3 worst = Vec3::Zero();
};
RoundTrip measureRoundTrip(const VolumeMap& map, std::span<const Vec3> solidPoints);

struct Certificate {
  Verdict verdict = Verdict::failed;
  std::vector<Check> checks;
  SignReport signs;  ///< empty where the signs were enclosed: GreenRecord::signs
  CellQuality sampled;
  RoundTrip roundTrip;

  /// The first check that decided against the map, or empty.
  std::string failure() const;
};

/// Puts the certificate together. `sampled` and `roundTrip` are measured on the grids as written; voxelSize
/// in mesh units. [docs/method.md, "Certificate, first form"]
Certificate certify(const BallMap& map, const CellQuality& sampled, const RoundTrip& roundTrip,
                    double voxelSize, Context& context = Context::quiet());

}  // namespace polestar
