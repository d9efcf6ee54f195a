#pragma once
// What is proved of a map, what was tried to refute it, and what remains to be told. [docs/method.md, "One to
// one, and the certificate"]

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "polestar/certify/voxel_cells.h"
#include "polestar/core/context.h"
#include "polestar/map/ball_map.h"
#include "polestar/map/domain_map.h"

namespace polestar {

/// A verdict is about the map as it is stored, not about how near it comes to the true Green's function.
enum class Verdict {
  /// Every proof holds and nothing refutes: the piecewise linear map of the table is a homeomorphism of the
  /// solid onto a star-shaped polyhedron with its vertices on the unit sphere, and the trilinear
  /// interpolants of the voxel cells that are deeper than a voxel preserve orientation.
  proved,
  failed
};
const char* toString(Verdict verdict);

enum class CheckRole {
  proof,      ///< made of everything, by exact signs or to rounding; a part of what `proved` says
  falsifier,  ///< made at samples: a failure refutes the map, passing proves nothing
  warning     ///< decides nothing
};
const char* toString(CheckRole role);

struct Check {
  std::string name;  ///< "foliation_cells", as in the JSON
  CheckRole role = CheckRole::warning;
  bool passed = false;
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
  std::vector<Check> checks;  ///< in the order of causes
  SignReport signs;           ///< empty where the signs were enclosed: GreenRecord::signs
  CellQuality sampled;
  RoundTrip roundTrip;

  /// The first check that decided against the map, or null.
  const Check* firstFailure() const;
};

/// Puts the certificate together. `sampled` and `roundTrip` are measured on the grids as written; voxelSize
/// in mesh units. What the map says of itself is not taken for granted: cells are counted, and the field is
/// evaluated, anew. Cost: 0.1 us a cell of the foliation and some 40,000 evaluations of the field.
Certificate certify(const BallMap& map, const CellQuality& sampled, const RoundTrip& roundTrip,
                    double voxelSize, Context& context = Context::quiet());
/// A map into another domain than the ball is one to one when both its halves are: the checks of the domain's
/// own map follow those of the solid's, under names that begin with `domain_`, and `motion` is about what
/// joins them.
Certificate certify(const DomainMap& map, const CellQuality& sampled, const RoundTrip& roundTrip,
                    double voxelSize, Context& context = Context::quiet());

}  // namespace polestar
