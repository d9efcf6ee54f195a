#pragma once
// What is compared, by the names that tables have.

#include <span>

#include "polestar/pipeline.h"

namespace polestar::bench {

/// A boundary and a radius. The first is the default of `polestar map`, the paper's.
struct Choice {
  const char* name;
  SphereMapKind boundary;
  RadiusKind radius;
  double volumeWeight = BalanceOptions{}.volumeWeight;
  bool compared = false;  ///< with other methods, too

  MapOptions options() const {
    MapOptions options;
    options.boundary = boundary;
    options.radius = radius;
    options.balance.volumeWeight = volumeWeight;
    return options;
  }
};

inline std::span<const Choice> choices() {
  static constexpr Choice kChoices[] = {
      {"conformal, green", SphereMapKind::conformal, RadiusKind::green, 0.03, true},
      {"conformal, mixed", SphereMapKind::conformal, RadiusKind::mixed},
      {"field-line, green", SphereMapKind::fieldLine, RadiusKind::green, 0.03, true},
      {"field-line, mixed", SphereMapKind::fieldLine, RadiusKind::mixed},
      {"field-line, volume", SphereMapKind::fieldLine, RadiusKind::volume},
      {"field-line, balanced", SphereMapKind::fieldLine, RadiusKind::balanced},
      {"radial, green", SphereMapKind::radial, RadiusKind::green},
      {"radial, mixed", SphereMapKind::radial, RadiusKind::mixed},
      {"balanced 0", SphereMapKind::balanced, RadiusKind::balanced, 0.0},
      {"balanced 0.03", SphereMapKind::balanced, RadiusKind::balanced, 0.03, true},
      {"balanced 0.05", SphereMapKind::balanced, RadiusKind::balanced, 0.05},
      {"balanced 0.1", SphereMapKind::balanced, RadiusKind::balanced, 0.1},
  };
  return kChoices;
}

inline constexpr const char* kRadialCone = "radial cone";
inline constexpr const char* kHarmonicMap = "harmonic map";
inline constexpr const char* kGalaxyMaps = "Galaxy Maps";

}  // namespace polestar::bench
