#include "polestar/certify/detail/falsifiers.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "polestar/certify/detail/check_parts.h"

namespace polestar::detail {
namespace {

constexpr double kLargestBoundaryError = 1e-2, kLargestChargeError = 1e-3;
constexpr std::size_t kBoundaryPoints = 10000, kPointsPerDepth = 2000;
// Shrunk surfaces on which lemma 2 is tried, from just below the surface to around the center: a pole that is
// elsewhere shows between it and the center alone.
constexpr std::array<double, 7> kShrunk{0.9, 0.7, 0.5, 0.3, 0.1, 0.03, 0.01};

Check falsifier(const char* name, double value, double limit, std::string what) {
  return check(CheckRole::falsifier, name, value, limit, std::move(what));
}

// Up to `limit` points of the surface, spread over its triangles, off corners, edges and centroids, where
// solvers look.
std::vector<Vec3> surfacePoints(const TriMesh& mesh, std::size_t limit) {
  const std::size_t all = 3 * mesh.triangles.size(), count = std::min(all, limit);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t sample = i * all / count, t = sample / 3;
    const Vec3 sum = mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2);
    points.push_back((sum + 3 * mesh.corner(t, static_cast<int>(sample % 3))) / 6);
  }
  return points;
}

// The largest rho |G| at the points; infinite where there is no number.
double largestGreen(const GreenFunction& green, std::span<const Vec3> points) {
  std::vector<double> value(points.size());
  std::vector<Vec3> gradient(points.size());
  green.evaluate(points, value, gradient);
  double largest = 0;
  for (const double g : value) {
    const double error = std::abs(green.harmonicRadius() * g);
    if (!(error <= largest)) largest = std::isnan(error) ? HUGE_VAL : error;
  }
  return largest;
}

struct Contradictions {
  std::size_t points = 0, found = 0;
  Vec3 first = Vec3::Zero();  // inner frame
};

// Lemma 2: x . grad G < 0 in all of the solid but the center. The computed G~ differs from G by a harmonic
// function, at most `error` / rho by the maximum principle, so its gradient by 3/2 of that over the distance
// to the surface; twice as much is allowed, for what the samples of `error` miss. What points outward beyond
// that cannot be explained by the error on the surface: G~ has another pole, or is not harmonic.
Contradictions contradictLemma2(const GreenFunction& green, double error) {
  const StarShape& shape = green.shape();
  const double margin = shape.report().centerMargin / shape.frame().unit;
  const std::vector<Vec3> surface = surfacePoints(shape.mesh(), kPointsPerDepth);
  std::vector<double> value(surface.size());
  std::vector<Vec3> points(surface.size()), gradient(surface.size());
  Contradictions result;
  for (const double shrunk : kShrunk) {
    for (std::size_t i = 0; i < points.size(); ++i) points[i] = shrunk * surface[i];
    green.evaluate(points, value, gradient);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double r = points[i].norm();
      // The ball of radius `margin` about the center sees the whole surface: the solid holds it, and its hull
      // with every point.
      const double distance = std::max((1 - shrunk) * margin, margin - r);
      const double allowed = 3 * error / (green.harmonicRadius() * distance);
      if (points[i].dot(gradient[i]) <= r * allowed) continue;
      if (result.found++ == 0) result.first = points[i];
    }
    result.points += points.size();
  }
  return result;
}

Check boundaryError(const GreenFunction& green, double seenAnew) {
  const BoundaryError& error = green.boundaryError();
  const double seen = std::max(error.bound ? error.sampled : error.max, seenAnew);
  std::string what = "rho |G| on the surface up to " + formatted("%.3g", seen) + ", sampled at " +
                     std::to_string(error.points) + " points";
  if (error.bound) what += "; at most " + formatted("%.3g", error.max) + " anywhere, proved";
  return falsifier("boundary_error", seen, kLargestBoundaryError, std::move(what));
}

}  // namespace

std::vector<Check> falsifyField(const GreenFunction& green) {
  std::vector<Check> checks;
  const double seen = largestGreen(green, surfacePoints(green.shape().mesh(), kBoundaryPoints));
  checks.push_back(boundaryError(green, seen));
  if (const auto* layer = std::get_if<SurfaceLayer>(&green.sources())) {
    const double charge = totalCharge(layer->mesh, layer->density);
    checks.push_back(
        falsifier("charge", std::abs(charge + 1), kLargestChargeError,
                  "total charge of the layer " + formatted("%.6f", charge) + ", where -1 is due"));
  }
  const Contradictions signs = contradictLemma2(green, checks[0].value);
  std::string what = counted(signs.found, signs.points,
                             "points of the solid where G rises outward by more than its error explains");
  if (signs.found > 0) {
    const Vec3 place = green.shape().frame().toWorld(signs.first);
    what += ", the first near (" + formatted("%.6g", place[0]) + ", " + formatted("%.6g", place[1]) + ", " +
            formatted("%.6g", place[2]) + ")";
  }
  checks.push_back(falsifier("field_signs", static_cast<double>(signs.found), 0, std::move(what)));
  return checks;
}

}  // namespace polestar::detail
