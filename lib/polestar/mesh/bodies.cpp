#include "polestar/mesh/bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "polestar/core/detail/parallel.h"
#include "polestar/mesh/shapes.h"

namespace polestar {
namespace {

double smoothStep(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

// ---- Seeded noise
// -----------------------------------------------------------------------------------------------

std::uint32_t hash(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x85ebca6bu;
  x ^= x >> 13;
  x *= 0xc2b2ae35u;
  return x ^ (x >> 16);
}

/// Uniform in [0, 1).
double randomUnit(std::uint32_t seed, std::uint32_t index) {
  return hash(seed ^ hash(index + 0x9e3779b9u)) * 0x1p-32;
}

Vec3 randomDirection(std::uint32_t seed, std::uint32_t index) {
  const double z = 2 * randomUnit(seed, 2 * index) - 1,
               angle = 2 * std::numbers::pi * randomUnit(seed, 2 * index + 1);
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Smooth noise in about [-1, 1]: random gradients at integer points, blended with a quintic [Perlin 2002].
double gradientNoise(const Vec3& p, std::uint32_t seed) {
  const Vec3 base = p.array().floor();
  const Vec3 f = p - base;
  auto gradient = [&](int i, int j, int k) {
    const auto x = static_cast<std::uint32_t>(static_cast<int>(base[0]) + i);
    const auto y = static_cast<std::uint32_t>(static_cast<int>(base[1]) + j);
    const auto z = static_cast<std::uint32_t>(static_cast<int>(base[2]) + k);
    return randomDirection(seed, hash(x ^ hash(y ^ hash(z)))).dot(f - Vec3(i, j, k));
  };
  auto fade = [](double t) { return t * t * t * (t * (6 * t - 15) + 10); };
  auto along = [&](int j, int k) { return std::lerp(gradient(0, j, k), gradient(1, j, k), fade(f[0])); };
  const double low = std::lerp(along(0, 0), along(1, 0), fade(f[1]));
  const double high = std::lerp(along(0, 1), along(1, 1), fade(f[1]));
  return 1.5 * std::lerp(low, high, fade(f[2]));
}

// ---- Soft solids: signed distances, negative inside, exact enough to march along
// ----------------------------------

double ellipsoid(const Vec3& p, const Vec3& center, const Vec3& radii) {
  const Vec3 q = (p - center).cwiseQuotient(radii);
  const double scaled = q.norm(), gradient = q.cwiseQuotient(radii).norm();
  return gradient > 1e-12 ? scaled * (scaled - 1) / gradient : -radii.minCoeff();
}

/// Capsule whose radius runs from ra at a to rb at b.
double cone(const Vec3& p, const Vec3& a, const Vec3& b, double ra, double rb) {
  const Vec3 axis = b - a;
  const double t = std::clamp(axis.dot(p - a) / axis.squaredNorm(), 0.0, 1.0);
  return (p - a - t * axis).norm() - std::lerp(ra, rb, t);
}

/// Union with a blend of `width` (cubic, twice differentiable).
double blend(double a, double b, double width) {
  const double h = std::max(width - std::abs(a - b), 0.0) / width;
  return std::min(a, b) - h * h * h * width / 6;
}

/// Takes `b` away from `a`, blended.
double carve(double a, double b, double width) { return -blend(-a, b, width); }

/// Distance from the origin, along the unit vector `direction`, at which a soft solid that holds the origin
/// ends.
template <class Solid>
double exitDistance(const Solid& solid, const Vec3& direction) {
  double t = 0, value = solid(Vec3::Zero());
  double inside = 0, insideValue = value;
  for (int i = 0; i < 200 && value < 0; ++i) {
    inside = t;
    insideValue = value;
    t += std::max(0.7 * -value, 2e-3);
    value = solid(Vec3(t * direction));
  }
  // Regula falsi (Illinois) between the last two points.
  double outside = t, outsideValue = value;
  for (int i = 0; i < 60 && outside - inside > 1e-12; ++i) {
    t = (inside * outsideValue - outside * insideValue) / (outsideValue - insideValue);
    value = solid(Vec3(t * direction));
    if (std::abs(value) < 1e-13) break;
    if (value < 0) {
      inside = t;
      insideValue = value;
      outsideValue *= 0.5;
    } else {
      outside = t;
      outsideValue = value;
      insideValue *= 0.5;
    }
  }
  return t;
}

// ---- The head
// -----------------------------------------------------------------------------------------------------

/// Right half and, by |x|, left half. Forward is -y; written with f = -y so that the face reads forward.
double headSolid(const Vec3& point) {
  const Vec3 p(std::abs(point[0]), -point[1], point[2]);
  double d = ellipsoid(p, {0, -0.11, 0.40}, {0.575, 0.71, 0.58});                 // cranium
  d = blend(d, ellipsoid(p, {0, 0.18, -0.14}, {0.47, 0.46, 0.74}), 0.35);         // face
  d = blend(d, cone(p, {0, -0.21, -0.40}, {0, -0.19, -1.50}, 0.34, 0.43), 0.30);  // neck
  d = blend(d, ellipsoid(p, {0.15, 0.28, -0.60}, {0.21, 0.30, 0.20}), 0.22);      // jaw
  d = blend(d, ellipsoid(p, {0.29, 0.40, -0.10}, {0.14, 0.16, 0.13}), 0.22);      // cheekbone
  d = carve(d, ellipsoid(p, {0.23, 0.72, 0.07}, {0.17, 0.17, 0.10}), 0.16);       // eye socket
  d = blend(d, cone(p, {0, 0.575, 0.21}, {0.37, 0.43, 0.20}, 0.07, 0.05), 0.12);  // brow
  d = blend(d, ellipsoid(p, {0.215, 0.465, 0.05}, {0.13, 0.115, 0.075}), 0.035);  // eyelid
  d = blend(d, cone(p, {0, 0.57, 0.24}, {0, 0.735, -0.20}, 0.05, 0.08), 0.17);    // nose
  d = blend(d, ellipsoid(p, {0.06, 0.63, -0.235}, {0.06, 0.085, 0.055}), 0.12);   // wing of the nose
  d = blend(d, cone(p, {0, 0.69, -0.24}, {0, 0.57, -0.38}, 0.05, 0.05), 0.10);    // below the nose
  d = blend(d, ellipsoid(p, {0, 0.575, -0.452}, {0.20, 0.085, 0.05}), 0.045);     // upper lip
  d = blend(d, ellipsoid(p, {0, 0.565, -0.545}, {0.165, 0.09, 0.05}), 0.03);      // lower lip
  d = blend(d, ellipsoid(p, {0, 0.52, -0.78}, {0.16, 0.14, 0.11}), 0.20);         // chin
  d = blend(d, ellipsoid(p, {0.47, -0.06, 0.04}, {0.085, 0.13, 0.23}), 0.14);     // ear
  d = carve(d, ellipsoid(p, {0.62, -0.03, 0.07}, {0.085, 0.075, 0.14}), 0.08);    // its shell
  return carve(d, p[2] + 1.28, 0.2);                                              // foot
}

/// Where the head has its fine features.
double headDensity(const Vec3& point) {
  const Vec3 p(std::abs(point[0]), -point[1], point[2]);
  const double face = smoothStep(0.2, 0.5, p[1]) * smoothStep(0.5, 0.25, p[0]) * smoothStep(0.45, 0.25, p[2]);
  const double ear = smoothStep(0.2, 0.1, ellipsoid(p, {0.47, -0.06, 0.04}, {0.085, 0.13, 0.23}));
  const double foot = smoothStep(-1.0, -1.15, p[2]);
  return 1 + 5 * face + 2 * ear + foot;
}

// ---- The pig
// ------------------------------------------------------------------------------------------------------

/// A flap that tapers from the origin to `tip`: half-width `wide` along `across` and `thick` across the flap,
/// both at the origin, and ends a third as far behind it. Convex.
double flap(const Vec3& p, const Vec3& tip, const Vec3& across, double wide, double thick) {
  constexpr double kRound = 0.20;  // of the tip and the rim, shares of the flap's length and width
  const Vec3 axis = tip.normalized(), side = (across - across.dot(axis) * axis).normalized();
  const Vec3 q(p.dot(side) / wide, p.dot(axis.cross(side)) / thick, kRound);
  const double along = p.dot(axis) / tip.norm();
  return thick * (q.norm() + std::max(along, -3 * along) - 1);
}

/// Right half and, by |x|, left half; f = -y reads forward, as of the head. Every part but the eyes, dents
/// and slots holds the origin and is convex, so that from there all of the pig is seen.
double pigSolid(const Vec3& point) {
  const Vec3 p(std::abs(point[0]), -point[1], point[2]), o(0, 0, 0);
  double d = ellipsoid(p, {0, -0.08, 0.02}, {0.68, 0.82, 0.65});                  // belly
  d = blend(d, cone(p, {0, 0.05, 0.05}, {0, 0.70, 0.20}, 0.42, 0.39), 0.22);      // head
  d = blend(d, cone(p, o, {0, 1.10, 0.10}, 0.10, 0.23), 0.12);                    // snout
  d = carve(d, 1.15 - p[1], 0.10);                                                // its disk
  d = carve(d, ellipsoid(p, {0.09, 1.18, 0.105}, {0.06, 0.06, 0.08}), 0.05);      // nostril
  d = blend(d, flap(p, {0.53, 0.65, 0.88}, {1, -0.2, -0.45}, 0.56, 0.27), 0.10);  // ear
  d = blend(d, cone(p, o, {0.33, 0.36, -0.74}, 0.20, 0.17), 0.10);                // front leg
  d = blend(d, cone(p, o, {0.33, -0.42, -0.74}, 0.20, 0.17), 0.10);               // hind leg
  d = carve(d, p[2] + 0.78, 0.10);                                                // soles
  d = blend(d, ellipsoid(p, {0.185, 0.965, 0.365}, {0.07, 0.07, 0.08}), 0.04);    // eye
  return carve(d, ellipsoid(p, {0, -0.12, 0.72}, {0.07, 0.27, 0.09}), 0.05);      // slot for coins
}

/// A spiral of a little over one turn on the rump, in the plane x, z: how near `p` is to its middle, 1 on it.
double pigTail(const Vec3& p) {
  constexpr int kSteps = 60;
  constexpr double kTurns = 1.3, kInner = 0.03, kOuter = 0.19, kWidth = 0.055;
  if (p[1] < 0.4) return 0;
  const Eigen::Vector2d q(p[0], p[2] - 0.2);
  double nearest = kWidth;
  for (int i = 0; i <= kSteps; ++i) {
    const double t = static_cast<double>(i) / kSteps, angle = 2 * std::numbers::pi * kTurns * t;
    const double r = std::lerp(kInner, kOuter, t);
    nearest = std::min(nearest, (q - Eigen::Vector2d(r * std::cos(angle), r * std::sin(angle))).norm());
  }
  const double x = 1 - (nearest / kWidth) * (nearest / kWidth);
  return x * std::sqrt(x);
}

double pigRadius(const Vec3& direction) {
  const double r = exitDistance(pigSolid, direction);
  return r + 0.035 * pigTail(r * direction);
}

/// Where the pig has its fine features.
double pigDensity(const Vec3& point) {
  const Vec3 p(std::abs(point[0]), -point[1], point[2]);
  const double face = smoothStep(0.8, 1.0, p[1]);
  const double ear = smoothStep(0.55, 0.75, p[2]) * smoothStep(0.1, 0.3, p[1]);
  const double foot = smoothStep(-0.5, -0.7, p[2]);
  const double slot =
      smoothStep(0.5, 0.6, p[2]) * smoothStep(0.15, 0.05, p[0]) * smoothStep(0.4, 0.25, p[1] + 0.1);
  const double tail = smoothStep(0.35, 0.2, (p - Vec3(0, -0.9, 0.2)).norm());
  return 1 + 4 * face + 2 * ear + 2 * foot + 6 * slot + 7 * tail;
}

/// Decimals that survive the last bits of any compiler's arithmetic.
TriMesh rounded(TriMesh mesh) {
  for (Vec3& v : mesh.vertices) v = (1e6 * v).array().round() / 1e6 + 0.0;
  return mesh;
}

}  // namespace

TriMesh subdivided(const TriMesh& mesh, int frequency) {
  // A point of the grid on a triangle is a sum of corners with whole weights; zero weights are left out of
  // its name, so both triangles at an edge give its points the same names.
  using Term = std::pair<std::int32_t, int>;
  std::map<std::vector<Term>, std::int32_t> names;
  TriMesh result;
  auto vertex = [&](const Triangle& t, int a, int b, int c) {
    std::vector<Term> name;
    for (const Term& term : {Term{t[0], a}, Term{t[1], b}, Term{t[2], c}}) {
      if (term.second > 0) name.push_back(term);
    }
    std::sort(name.begin(), name.end());
    const auto [entry, isNew] = names.try_emplace(name, static_cast<std::int32_t>(result.vertices.size()));
    if (isNew) {
      Vec3 sum = Vec3::Zero();
      for (const auto& [corner, weight] : name) sum += weight * mesh.vertices[corner];
      result.vertices.push_back(sum / frequency);
    }
    return entry->second;
  };
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < frequency; ++i) {
      for (int j = 0; i + j < frequency; ++j) {
        const int k = frequency - i - j;
        const std::int32_t a = vertex(t, k, i, j), b = vertex(t, k - 1, i + 1, j),
                           c = vertex(t, k - 1, i, j + 1);
        result.triangles.push_back({a, b, c});
        if (k > 1) result.triangles.push_back({b, vertex(t, k - 2, i + 1, j + 1), c});
      }
    }
  }
  return result;
}

TriMesh geodesicSphere(int frequency) {
  return transformed(subdivided(icosphere(0), frequency), [](const Vec3& v) { return Vec3(v.normalized()); });
}

TriMesh relaxedRadialShape(int frequency, const std::function<double(const Vec3&)>& radius,
                           const std::function<double(const Vec3&)>& density, int iterations) {
  TriMesh mesh = geodesicSphere(frequency);
  const std::size_t count = mesh.vertices.size();
  auto project = [&](const std::vector<Vec3>& points) {
    detail::parallelChunks(count, 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        const Vec3 direction = points[v].normalized();
        mesh.vertices[v] = radius(direction) * direction;
      }
    });
  };
  project(mesh.vertices);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    std::vector<Vec3> moment(count, Vec3::Zero());
    std::vector<double> area(count, 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Vec3 centroid = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
      const double weight = areaVector(mesh, t).norm() * (density ? density(centroid) : 1);
      for (const std::int32_t v : mesh.triangles[t]) {
        moment[v] += weight * centroid;
        area[v] += weight;
      }
    }
    for (std::size_t v = 0; v < count; ++v) moment[v] /= area[v];
    project(moment);
  }
  return mesh;
}

TriMesh starPolyhedron(int frequency) {
  // Spikes stand over the vertices of an icosahedron; their bases are the faces of the dual dodecahedron, at
  // the distance that makes the flanks of neighbouring spikes continue its faces.
  const TriMesh spikes = icosphere(0);
  const double base = std::sqrt(3.0) / std::tan(0.4 * std::numbers::pi);
  TriMesh mesh;
  mesh.vertices = spikes.vertices;
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t>
      leftOf;  // base corner left of a directed edge
  for (std::size_t t = 0; t < spikes.triangles.size(); ++t) {
    const auto corner = static_cast<std::int32_t>(mesh.vertices.size());
    mesh.vertices.push_back(base *
                            (spikes.corner(t, 0) + spikes.corner(t, 1) + spikes.corner(t, 2)).normalized());
    for (int k = 0; k < 3; ++k) leftOf[{spikes.triangles[t][k], spikes.triangles[t][(k + 1) % 3]}] = corner;
  }
  for (const auto& [edge, left] : leftOf) {
    mesh.triangles.push_back({edge.first, leftOf.at({edge.second, edge.first}), left});
  }
  return rounded(subdivided(mesh, frequency));
}

TriMesh twelveLobes(int frequency) {
  const std::vector<Vec3> centers = icosphere(0).vertices;
  return rounded(relaxedRadialShape(frequency, [&](const Vec3& w) {
    double radius = 1;
    for (const Vec3& center : centers) radius += 0.6 * std::exp(-(1 - w.dot(center)) / 0.035);
    return radius / 1.6;
  }));
}

TriMesh asteroid(int frequency, std::uint32_t seed) {
  struct Crater {
    Vec3 center;
    double size;  // angular radius of the rim
  };
  std::vector<Crater> craters;
  for (std::uint32_t i = 0; i < 26; ++i) {
    const double u = randomUnit(seed ^ 0x51ed27u, i);
    craters.push_back({randomDirection(seed ^ 0xc7a7e5u, i), 0.11 + 0.40 * std::pow(u, 3.0)});
  }
  auto radius = [&](const Vec3& w) {
    // A stretched, lumpy body ...
    double r = 1 / Vec3(w[0] / 0.9, w[1] / 0.64, w[2] / 0.56).norm();
    r *= 1 + 0.13 * gradientNoise(1.3 * w, seed) + 0.05 * gradientNoise(2.9 * w, seed + 1);
    // ... with ridges where noise passes zero ...
    const double ridge = 1 - std::abs(gradientNoise(2.1 * w + Vec3(7, 3, 5), seed + 2));
    r *= 1 + 0.05 * std::pow(std::max(ridge, 0.0), 4.0) + 0.010 * gradientNoise(8 * w, seed + 3);
    // ... and craters: a bowl, a rim, a blanket that thins out.
    for (const Crater& crater : craters) {
      const double x = std::acos(std::clamp(w.dot(crater.center), -1.0, 1.0)) / crater.size;
      if (x > 2) continue;
      const double bowl = x < 1 ? -(1 - x * x) : 0;
      const double rim = std::exp(-22 * (x - 1) * (x - 1)) * smoothStep(2, 1.4, x);
      r *= 1 + crater.size * (0.34 * bowl + 0.10 * rim);
    }
    return r;
  };
  return rounded(relaxedRadialShape(frequency, radius));
}

TriMesh stylizedHead(int frequency) {
  return rounded(relaxedRadialShape(
      frequency, [](const Vec3& w) { return exitDistance(headSolid, w); }, headDensity));
}

TriMesh coinPig(int frequency) {
  // More would draw triangles out in the creases around the legs.
  constexpr int kIterations = 24;
  return rounded(relaxedRadialShape(frequency, pigRadius, pigDensity, kIterations));
}

}  // namespace polestar
