#include "polestar/certify/certificate.h"

#include <algorithm>
#include <cmath>

#include "polestar/certify/detail/check_parts.h"
#include "polestar/certify/detail/falsifiers.h"
#include "polestar/certify/detail/table_proof.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/shell_map.h"

namespace polestar {

using detail::check;
using detail::counted;
using detail::formatted;

namespace {

// What enclosures say of critical points: how deep below the surface there are none, and where that fails.
std::string describe(const std::vector<SignProof>& proofs, const Frame& frame) {
  const SignProof &first = proofs.front(), &last = proofs.back();
  std::string text = last.proved()
                         ? "no critical point but the center within " + formatted("%.4g", 1 - last.delta) +
                               " of the solid: proved on all " + std::to_string(last.faces) + " faces"
                         : "that there is no critical point but the center is not proved";
  const auto addOpen = [&](const SignProof& proof) {
    const SignProof::Face& weakest = proof.weakest.front();
    const Vec3 place = frame.toWorld(weakest.place);
    text += "; shrunk to " + formatted("%.4g", 1 - proof.delta) + " it stays open on " +
            counted(proof.radial.failed, proof.faces, "faces (") + std::to_string(proof.radial.refuted) +
            " with the wrong sign), cosine at most " + formatted("%.2g", weakest.radial) + ", seen " +
            formatted("%.2g", weakest.seen) + " near (" + formatted("%.6g", place[0]) + ", " +
            formatted("%.6g", place[1]) + ", " + formatted("%.6g", place[2]) + ")";
  };
  if (!first.proved()) addOpen(first);
  if (!last.proved() && proofs.size() > 1) addOpen(last);
  if (first.normal.failed > 0) {
    text += "; field lines may enter through " + counted(first.normal.failed, first.faces, "faces at ") +
            formatted("%.4g", 1 - first.delta);
  }
  return text;
}

Check surfaceSigns(const SignReport& sampled, const std::vector<SignProof>& proofs, const Frame& frame) {
  const std::size_t wrong = proofs.empty() ? sampled.radialFailures + sampled.normalFailures
                                           : proofs.front().radial.failed + proofs.front().normal.failed;
  return check(CheckRole::warning, "surface_signs", static_cast<double>(wrong), 0,
               proofs.empty()
                   ? counted(wrong, 2 * sampled.points, "signs just inside the surface point the wrong way")
                   : describe(proofs, frame));
}

Check voxelCells(const CellQuality& sampled) {
  const std::size_t bad = sampled.invertedDeep + sampled.collapsedDeep;
  return check(
      CheckRole::proof, "voxel_cells", static_cast<double>(bad), 0,
      counted(bad, sampled.cells, "voxel cells inverted or collapsed more than a voxel below the surface (") +
          std::to_string(sampled.inverted) + " inverted anywhere, " + std::to_string(sampled.undecided) +
          " of them undecided; " + std::to_string(sampled.collapsed) + " collapsed)");
}

Check returns(const RoundTrip& trip, double voxelSize) {
  return check(CheckRole::falsifier, "round_trip", trip.lost > 0 ? HUGE_VAL : trip.max, 0.5 * voxelSize,
               "largest distance " + std::to_string(trip.max / voxelSize) + " voxels over " +
                   std::to_string(trip.points) + " points, " + std::to_string(trip.lost) + " lost");
}

bool refutes(const Check& made) { return !made.passed && made.role != CheckRole::warning; }

}  // namespace

const char* toString(Verdict verdict) { return verdict == Verdict::proved ? "proved" : "failed"; }

const char* toString(CheckRole role) {
  switch (role) {
    case CheckRole::proof:
      return "proof";
    case CheckRole::falsifier:
      return "falsifier";
    default:
      return "warning";
  }
}

SignReport sampleSigns(const GreenFunction& green, double delta, std::size_t limit) {
  const TriMesh& mesh = green.shape().mesh();
  std::vector<Vec3> points, normals;
  const std::size_t all = 4 * mesh.triangles.size(), count = std::min(all, limit);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t sample = i * all / count, t = sample / 4;
    const Vec3 sum = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
    const Vec3 p = sample % 4 == 3 ? Vec3(sum / 3) : Vec3((sum + 3 * mesh.corner(t, sample % 4)) / 6);
    points.push_back((1 - delta) * p);
    normals.push_back(areaVector(mesh, t));
  }
  std::vector<double> value(count);
  std::vector<Vec3> gradient(count);
  green.evaluate(points, value, gradient);
  SignReport report;
  report.points = count;
  for (std::size_t i = 0; i < count; ++i) {
    const double radial = points[i].dot(gradient[i]) / (points[i].norm() * gradient[i].norm());
    report.radialFailures += !(radial < 0);
    report.normalFailures += !(normals[i].dot(gradient[i]) < 0);
    report.worstRadial = std::max(report.worstRadial, radial);
  }
  return report;
}

RoundTrip measureRoundTrip(const VolumeMap& map, std::span<const Vec3> solidPoints) {
  std::vector<Vec3> domain(solidPoints.size()), back(solidPoints.size());
  map.forward(solidPoints, domain);
  for (Vec3& y : domain) {
    y = y.cast<float>().cast<double>();
    // Rounding may lift a point of the sphere over it. (In other domains nobody notices 1e-6.)
    if (y.norm() > 1 && y.norm() < 1 + 1e-6) y.normalize();
  }
  map.inverse(domain, back);
  RoundTrip trip;
  trip.points = solidPoints.size();
  double sum = 0;
  for (std::size_t i = 0; i < back.size(); ++i) {
    const double distance = (back[i] - solidPoints[i]).norm();
    if (!std::isfinite(distance)) {
      ++trip.lost;
      continue;
    }
    sum += distance * distance;
    if (distance > trip.max) {
      trip.max = distance;
      trip.worst = solidPoints[i];
    }
  }
  trip.rms = trip.points > trip.lost ? std::sqrt(sum / static_cast<double>(trip.points - trip.lost)) : 0;
  return trip;
}

const Check* Certificate::firstFailure() const {
  const auto first = std::find_if(checks.begin(), checks.end(), refutes);
  return first == checks.end() ? nullptr : &*first;
}

namespace {

// What can be said of a ball map by itself, whatever grids are made of it.
std::vector<Check> checksOf(const BallMap& map, const SignReport& signs) {
  const GreenFunction& green = map.chart().green();
  std::vector<Check> checks = detail::falsifyField(green);
  checks.push_back(surfaceSigns(signs, green.record().signs, green.shape().frame()));
  for (Check& proof : detail::proveTable(map)) checks.push_back(std::move(proof));
  return checks;
}

// Nothing where the signs were enclosed.
SignReport signsOf(const BallMap& map) {
  const GreenFunction& green = map.chart().green();
  return green.record().signs.empty() ? sampleSigns(green) : SignReport{};
}

// What lies between a solid's ball and its domain's.
Check proveMotion(const VolumeMap& motion) {
  if (const auto* shells = dynamic_cast<const ShellMap*>(&motion)) {
    const std::size_t folded = foldedTriangles(shells->table(), shells->rotation()).size();
    return check(
        CheckRole::proof, "motion", static_cast<double>(folded), 0,
        counted(folded, shells->table().triangles.size(),
                "triangles of the motion between the balls turn over on the way from rotation to table"));
  }
  const double pull = dynamic_cast<const BallMotion&>(motion).pull().norm();
  return check(
      CheckRole::proof, "motion", pull, 1 - 1e-9,
      "between the balls: a rotation and a Moebius transformation with a pull of " + formatted("%.3g", pull));
}

void conclude(Certificate& certificate, double voxelSize) {
  certificate.checks.push_back(voxelCells(certificate.sampled));
  certificate.checks.push_back(returns(certificate.roundTrip, voxelSize));
  certificate.verdict = certificate.firstFailure() ? Verdict::failed : Verdict::proved;
}

}  // namespace

Certificate certify(const BallMap& map, const CellQuality& sampled, const RoundTrip& roundTrip,
                    double voxelSize, Context& context) {
  context.progress("certifying", 0);
  Certificate certificate;
  certificate.sampled = sampled;
  certificate.roundTrip = roundTrip;
  certificate.signs = signsOf(map);
  certificate.checks = checksOf(map, certificate.signs);
  conclude(certificate, voxelSize);
  return certificate;
}

Certificate certify(const DomainMap& map, const CellQuality& sampled, const RoundTrip& roundTrip,
                    double voxelSize, Context& context) {
  context.progress("certifying", 0);
  Certificate certificate;
  certificate.sampled = sampled;
  certificate.roundTrip = roundTrip;
  certificate.signs = signsOf(map.solid());
  certificate.checks = checksOf(map.solid(), certificate.signs);
  for (Check& check : checksOf(map.domain(), signsOf(map.domain()))) {
    check.name.insert(0, "domain_");
    certificate.checks.push_back(std::move(check));
  }
  certificate.checks.push_back(proveMotion(map.motion()));
  conclude(certificate, voxelSize);
  return certificate;
}

}  // namespace polestar
