#include "polestar/map/domain_curves.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "polestar/core/error.h"

namespace polestar {
namespace {

/// A point of a curve; `settled`: the piece from here to the next is short or straight enough.
struct Station {
  double t = 0;
  Vec3 domain = Vec3::Zero(), solid = Vec3::Zero();
  bool settled = false;
};

/// Of a point to the straight line between two.
double distanceToChord(const Vec3& p, const Vec3& a, const Vec3& b) {
  const Vec3 chord = b - a;
  const double squared = chord.squaredNorm();
  const double t = squared > 0 ? std::clamp(chord.dot(p - a) / squared, 0.0, 1.0) : 0;
  return (p - a - t * chord).norm();
}

std::vector<std::vector<Station>> evenStations(const VolumeMap& map, std::span<const DomainCurve> curves) {
  std::vector<Vec3> domain;
  for (const DomainCurve& curve : curves) {
    for (int i = 0; i <= curve.pieces; ++i)
      domain.push_back(curve.point(static_cast<double>(i) / curve.pieces));
  }
  const std::vector<Vec3> solid = pointsOfSolid(map, domain);
  std::vector<std::vector<Station>> stations;
  std::size_t at = 0;
  for (const DomainCurve& curve : curves) {
    stations.emplace_back();
    for (int i = 0; i <= curve.pieces; ++i, ++at)
      stations.back().push_back({static_cast<double>(i) / curve.pieces, domain[at], solid[at]});
    stations.back().back().settled = true;
  }
  return stations;
}

/// Looks at the middle of every piece that is not settled, and keeps it where the chord misses it by more
/// than the tolerance. Returns whether there was one.
bool halvePieces(const VolumeMap& map, std::span<const DomainCurve> curves, double tolerance,
                 std::vector<std::vector<Station>>& stations) {
  std::vector<double> middle;
  std::vector<Vec3> domain;
  for (std::size_t c = 0; c < curves.size(); ++c) {
    for (std::size_t i = 0; i + 1 < stations[c].size(); ++i) {
      if (stations[c][i].settled) continue;
      middle.push_back(0.5 * (stations[c][i].t + stations[c][i + 1].t));
      domain.push_back(curves[c].point(middle.back()));
    }
  }
  const std::vector<Vec3> solid = pointsOfSolid(map, domain);
  std::size_t at = 0;
  for (std::vector<Station>& curve : stations) {
    std::vector<Station> finer;
    for (std::size_t i = 0; i < curve.size(); ++i) {
      finer.push_back(curve[i]);
      if (curve[i].settled) continue;
      if (distanceToChord(solid[at], curve[i].solid, curve[i + 1].solid) > tolerance)
        finer.push_back({middle[at], domain[at], solid[at]});
      else
        finer.back().settled = true;
      ++at;
    }
    curve = std::move(finer);
  }
  return !domain.empty();
}

}  // namespace

void CurveOptions::validate() const {
  if (!(tolerance > 0)) throw Error(Errc::usage, "the tolerance of curves must be above 0");
  if (deepest < 0 || deepest > 20) throw Error(Errc::usage, "pieces of curves are halved 0 to 20 times");
}

DomainCurve domainPolyline(std::vector<Vec3> corners) {
  if (corners.size() < 2) throw Error(Errc::usage, "a polyline has two corners at least");
  const auto legs = static_cast<int>(corners.size() - 1);
  // Whole pieces to every leg, so that corners stay corners.
  return {[corners = std::move(corners), legs](double t) -> Vec3 {
            const int leg = std::clamp(static_cast<int>(t * legs), 0, legs - 1);
            const double share = t * legs - leg;
            return (1 - share) * corners[leg] + share * corners[leg + 1];
          },
          legs* std::max(1, 8 / legs)};
}

std::vector<Vec3> pointsOfSolid(const VolumeMap& map, std::span<const Vec3> domain) {
  std::vector<Vec3> solid(domain.size());
  map.inverse(domain, solid);
  for (std::size_t i = 0; i < solid.size(); ++i) {
    if (solid[i].allFinite()) continue;
    std::ostringstream where;
    where << domain[i].transpose();
    throw Error(Errc::io, "the map has no point of the solid for " + where.str() + " of its domain");
  }
  return solid;
}

std::vector<SolidCurve> traceCurves(const VolumeMap& map, std::span<const DomainCurve> curves,
                                    const CurveOptions& options, Context& context) {
  options.validate();
  std::vector<std::vector<Station>> stations = evenStations(map, curves);
  for (int round = 0; round < options.deepest; ++round) {
    context.throwIfCancelled();
    if (!halvePieces(map, curves, options.tolerance, stations)) break;
  }
  std::vector<SolidCurve> result(curves.size());
  for (std::size_t c = 0; c < curves.size(); ++c) {
    for (const Station& station : stations[c]) {
      result[c].domain.push_back(station.domain);
      result[c].solid.push_back(station.solid);
    }
  }
  return result;
}

SolidCurve traceGrid(const VolumeMap& map, const DomainGrid& grid) {
  SolidCurve result;
  for (int row = 0; row <= grid.rows; ++row) {
    for (int column = 0; column <= grid.columns; ++column)
      result.domain.push_back(
          grid.point(static_cast<double>(column) / grid.columns, static_cast<double>(row) / grid.rows));
  }
  result.solid = pointsOfSolid(map, result.domain);
  return result;
}

}  // namespace polestar
