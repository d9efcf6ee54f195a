#include "certify/maps.h"

#include <algorithm>
#include <stdexcept>

#include "polestar/mesh/shapes.h"
#include "support/solids.h"

namespace polestar::testing {

const BallMap& star() {
  static const BallMap map = ballMap(starShape(smoothStar(3)));
  return map;
}

GreenChart::Data partsOf(const GreenChart& chart) {
  return {chart.green(),
          chart.foliation(),
          {chart.harmonic().begin(), chart.harmonic().end()},
          {chart.harmonicGradient().begin(), chart.harmonicGradient().end()},
          {chart.directions().begin(), chart.directions().end()},
          {chart.movedNodes().begin(), chart.movedNodes().end()},
          {chart.movedCanonical().begin(), chart.movedCanonical().end()},
          chart.report()};
}

BallMap mapOf(GreenChart::Data data, SphereMap sphere) {
  return {GreenChart(std::make_shared<const GreenChart::Data>(std::move(data))), std::move(sphere)};
}

SphereMap sphereMap(const GreenChart& chart, std::vector<Vec3> directions) {
  SphereMap map;
  map.flips = countFlips(directions, chart.foliation().triangles);
  map.directions = std::move(directions);
  return map;
}

const Check& checkOf(const Certificate& certificate, const std::string& name) {
  const auto found = std::find_if(certificate.checks.begin(), certificate.checks.end(),
                                  [&](const Check& c) { return c.name == name; });
  if (found == certificate.checks.end()) throw std::out_of_range("there is no check " + name);
  return *found;
}

std::vector<std::string> failuresOf(const Certificate& certificate) {
  std::vector<std::string> names;
  for (const Check& check : certificate.checks) {
    if (!check.passed && check.role != CheckRole::warning) names.push_back(check.name);
  }
  return names;
}

std::string failureOf(const Certificate& certificate) {
  const Check* failure = certificate.firstFailure();
  return failure ? failure->name : "";
}

}  // namespace polestar::testing
