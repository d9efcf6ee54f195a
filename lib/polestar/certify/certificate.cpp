#include "polestar/certify/certificate.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace polestar {
namespace {

std::string counted(std::size_t bad, std::size_t all, const std::string& what) {
  return std::to_string(bad) + " of " + std::to_string(all) + " " + what;
}

std::string formatted(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

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

}  // namespace

const char* toString(Verdict verdict) {
  switch (verdict) {
    case Verdict::proved:
      return "proved";
    case Verdict::sampled:
      return "sampled";
    default:
      return "failed";
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
    // Rounding may lift a point of the boundary over it.
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

std::string Certificate::failure() const {
  for (const Check& check : checks) {
    if (check.decides && !check.passed) return check.name + ": " + check.detail;
  }
  return "";
}

Certificate certify(const BallMap& map, const CellQuality& sampled, const RoundTrip& roundTrip,
                    double voxelSize, Context& context) {
  context.progress("certifying", 0);
  Certificate certificate;
  const GreenChart& chart = map.chart();
  const std::vector<SignProof>& proofs = chart.green().record().signs;
  if (proofs.empty()) certificate.signs = sampleSigns(chart.green());
  certificate.sampled = sampled;
  certificate.roundTrip = roundTrip;
  auto add = [&](const char* name, double value, double limit, bool decides, bool exact, std::string detail) {
    certificate.checks.push_back({name, value <= limit, decides, exact, value, limit, std::move(detail)});
  };
  const BoundaryError& error = chart.green().boundaryError();
  const CellCounts& cells = chart.report().cells;
  const SignReport& signs = certificate.signs;

  add("boundary_error", error.max, 1e-2, false, error.bound,
      "rho |G| on the surface, " +
          std::string(error.bound ? "bounded" : "sampled at " + std::to_string(error.points) + " points"));
  if (const std::optional<double> charge = chart.green().charge()) {
    add("charge", std::abs(*charge + 1), 1e-3, false, false, "total charge of the layer, which is -1");
  }
  if (proofs.empty()) {
    add("field_signs", static_cast<double>(signs.radialFailures + signs.normalFailures), 0, false, false,
        counted(signs.radialFailures + signs.normalFailures, 2 * signs.points,
                "signs just inside the surface point the wrong way"));
  } else {
    const std::size_t open = proofs.front().radial.failed + proofs.front().normal.failed;
    add("field_signs", static_cast<double>(open), 0, false, open == 0,
        describe(proofs, chart.green().shape().frame()));
  }
  add("sphere_flips", static_cast<double>(map.levelFlips()), 0, true, true,
      std::to_string(map.levelFlips()) + " flipped triangles on the sphere, over all levels");
  add("foliation_cells", static_cast<double>(cells.bad()), 0, true, true,
      counted(cells.bad(), cells.cells, "tetrahedra of the foliation inverted or flat"));
  add("image_cells", static_cast<double>(map.imageCells().bad()), 0, true, true,
      counted(map.imageCells().bad(), cells.cells,
              "tetrahedra inverted or flat at their images in the ball"));
  add("voxel_cells", static_cast<double>(sampled.invertedDeep), 0, true, true,
      counted(sampled.invertedDeep, sampled.cells,
              "voxel cells inverted more than a voxel below the surface (") +
          std::to_string(sampled.inverted) + " anywhere, " + std::to_string(sampled.collapsed) +
          " collapsed)");
  add("round_trip", roundTrip.lost > 0 ? HUGE_VAL : roundTrip.max, 0.5 * voxelSize, true, false,
      "largest distance " + std::to_string(roundTrip.max / voxelSize) + " voxels over " +
          std::to_string(roundTrip.points) + " points, " + std::to_string(roundTrip.lost) + " lost");

  const bool failed = std::any_of(certificate.checks.begin(), certificate.checks.end(),
                                  [](const Check& c) { return c.decides && !c.passed; });
  const bool exact = std::all_of(certificate.checks.begin(), certificate.checks.end(),
                                 [](const Check& c) { return !c.decides || c.exact; });
  certificate.verdict = failed ? Verdict::failed : exact ? Verdict::proved : Verdict::sampled;
  return certificate;
}

}  // namespace polestar
