#include "polestar/map/shell_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <string>
#include <utility>

#include "polestar/core/covering_number.h"
#include "polestar/core/detail/edge_table.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/core/predicates.h"
#include "polestar/map/detail/core_isotopy.h"
#include "polestar/map/detail/unit_ball.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/sphere/dilatation.h"
#include "polestar/sphere/sphere_locator.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar {
namespace {

using detail::isInUnitBall;
using detail::nowhere;
using detail::parallelChunks;

constexpr std::size_t kChunk = 1024;
constexpr double kRoundOff = std::numeric_limits<double>::epsilon() / 2;
/// A triangle that 40 halvings of s do not decide touches zero as far as doubles can tell.
constexpr int kHalvings = 40;
/// A point may miss its triangle by this much, in barycentric weights, on the seam between two.
constexpr double kSeam = 1e-10;

using Cubic = std::array<double, 4>;  // Bernstein coefficients

/// det[a_0, a_1, a_2](s), whose factors are linear in s, and how far rounding can put its coefficients off.
struct Determinant {
  Cubic coefficients;
  double error;
};

/// `start`, `end`: the corners at s = 0 and s = 1. A coefficient is a mean of up to three triple products of
/// a corner and two edges; with differences, products and sums each is off by less than 16 round-offs of the
/// product of lengths.
Determinant determinantOver(const std::array<Vec3, 3>& start, const std::array<Vec3, 3>& end) {
  const Vec3 p[2] = {start[0], end[0]}, e[2] = {start[1] - start[0], end[1] - end[0]},
             f[2] = {start[2] - start[0], end[2] - end[0]};
  const auto product = [&](int i, int j, int k) { return p[i].dot(e[j].cross(f[k])); };
  Determinant d;
  d.coefficients = {product(0, 0, 0), (product(1, 0, 0) + product(0, 1, 0) + product(0, 0, 1)) / 3,
                    (product(0, 1, 1) + product(1, 0, 1) + product(1, 1, 0)) / 3, product(1, 1, 1)};
  const auto longer = [](const Vec3* v) {
    return std::sqrt(std::max(v[0].squaredNorm(), v[1].squaredNorm()));
  };
  // A halving forms six means, each off by a round-off of what it is of.
  d.error = (16 + 3 * kHalvings) * kRoundOff * longer(p) * longer(e) * longer(f);
  return d;
}

/// Where in [begin, end] the cubic is not shown to be positive; nothing where it is.
std::optional<double> notPositive(const Cubic& c, double error, double begin, double end, int halvings) {
  if (*std::min_element(c.begin(), c.end()) > error) return std::nullopt;
  const double middle = 0.5 * (begin + end);
  if (halvings == 0) return middle;
  const double ab = 0.5 * (c[0] + c[1]), bc = 0.5 * (c[1] + c[2]), cd = 0.5 * (c[2] + c[3]);
  const double abc = 0.5 * (ab + bc), bcd = 0.5 * (bc + cd), value = 0.5 * (abc + bcd);
  if (value <= -error) return middle;
  if (const auto found = notPositive({c[0], ab, abc, value}, error, begin, middle, halvings - 1))
    return found;
  return notPositive({value, bcd, cd, c[3]}, error, middle, end, halvings - 1);
}

std::optional<double> foldOf(const std::array<Vec3, 3>& start, const std::array<Vec3, 3>& end) {
  if (orientDirections(start[0], start[1], start[2]) <= 0) return 0;
  if (orientDirections(end[0], end[1], end[2]) <= 0) return 1;
  const Determinant d = determinantOver(start, end);
  return notPositive(d.coefficients, d.error, 0, 1, kHalvings);
}

std::array<Vec3, 3> cornersOf(const Triangle& t, std::span<const Vec3> at) {
  return {at[t[0]], at[t[1]], at[t[2]]};
}

std::vector<Vec3> turned(const std::vector<Vec3>& directions, const Mat3& rotation) {
  std::vector<Vec3> result;
  result.reserve(directions.size());
  for (const Vec3& d : directions) result.push_back(rotation * d);
  return result;
}

std::vector<FoldedTriangle> foldedBetween(std::span<const Vec3> start, std::span<const Vec3> end,
                                          const std::vector<Triangle>& triangles) {
  using Found = std::vector<FoldedTriangle>;
  return detail::reduceChunks(
      triangles.size(), kChunk, Found{},
      [&](std::size_t first, std::size_t last) {
        Found found;
        for (std::size_t t = first; t < last; ++t) {
          if (const auto share = foldOf(cornersOf(triangles[t], start), cornersOf(triangles[t], end)))
            found.push_back({static_cast<std::int32_t>(t), *share});
        }
        return found;
      },
      [](Found all, const Found& part) {
        all.insert(all.end(), part.begin(), part.end());
        return all;
      });
}

void normalizeAll(std::vector<Vec3>& directions, const char* which) {
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const double length = directions[i].norm();
    if (!(length > 0 && std::isfinite(length))) {
      throw Error(Errc::usage, "a table of the sphere: vertex " + std::to_string(i) +
                                   " has no direction in `" + which + "`");
    }
    directions[i] /= length;
  }
}

/// Sizes, indices and directions; what is left is whether it is one to one.
ShellTable checkedTable(ShellTable table, double coreRadius) {
  if (!(coreRadius > 0 && coreRadius < 1))
    throw Error(Errc::usage, "the core's radius of a table of the sphere must lie in (0, 1)");
  if (table.from.size() != table.to.size()) {
    throw Error(Errc::usage, "a table of the sphere has " + std::to_string(table.from.size()) +
                                 " vertices on one side and " + std::to_string(table.to.size()) +
                                 " on the other");
  }
  const auto count = static_cast<std::int32_t>(table.from.size());
  for (const Triangle& t : table.triangles) {
    if (*std::min_element(t.begin(), t.end()) < 0 || *std::max_element(t.begin(), t.end()) >= count)
      throw Error(Errc::usage, "a table of the sphere: a triangle has a vertex that does not exist");
  }
  normalizeAll(table.from, "from");
  normalizeAll(table.to, "to");
  return table;
}

std::string place(const Vec3& direction) {
  std::ostringstream text;
  text.precision(3);
  text << direction.x() << ' ' << direction.y() << ' ' << direction.z();
  return text.str();
}

/// `from` tiles the sphere once.
void requireTiling(const ShellTable& table) {
  const SurfaceReport report = inspectSurface({table.from, table.triangles});
  if (!report.valid) {
    throw Error(Errc::notConverged,
                "a table of the sphere: its triangles are no sphere in `from`: " + report.defect);
  }
  const int covered = coveringNumber(table.from, table.triangles);
  if (covered != 1) {
    throw Error(Errc::notConverged, "a table of the sphere: its triangles cover the sphere " +
                                        std::to_string(covered) + " times in `from`, not once");
  }
  for (std::size_t t = 0; t < table.triangles.size(); ++t) {
    const auto [a, b, c] = cornersOf(table.triangles[t], table.from);
    if (orientDirections(a, b, c) > 0) continue;
    throw Error(Errc::notConverged, "a table of the sphere: triangle " + std::to_string(t) +
                                        " is folded in `from`, at direction " + place(a));
  }
}

void requireNoFolds(const ShellTable& table, const std::vector<Vec3>& start) {
  const std::vector<FoldedTriangle> folded = foldedBetween(start, table.to, table.triangles);
  if (folded.empty()) return;
  const auto inTable =
      std::count_if(folded.begin(), folded.end(), [](const FoldedTriangle& f) { return f.share == 1; });
  const FoldedTriangle& first = folded.front();
  std::ostringstream message;
  message << "a table of the sphere is not one to one: " << folded.size() << " of " << table.triangles.size()
          << " triangles are folded, " << inTable
          << " in the table itself, the others on the way to a rotation"
          << " in the core; the first is triangle " << first.triangle << " at direction "
          << place(table.from[table.triangles[first.triangle][0]]) << " (share " << first.share << ")";
  throw Error(Errc::notConverged, message.str());
}

}  // namespace

Mat3 coreRotation(const ShellTable& table) {
  return bestRotation(table.from, table.to, vertexAreas({table.from, table.triangles}));
}

std::vector<FoldedTriangle> foldedTriangles(const ShellTable& table, const Mat3& rotation) {
  return foldedBetween(turned(table.from, rotation), table.to, table.triangles);
}

struct ShellMap::Data {
  ShellTable table;
  double coreRadius;
  Mat3 rotation;
  std::vector<Vec3> start;  ///< Q from_i
  SphereLocator source, target;
  std::vector<std::array<std::int32_t, 3>> across;  ///< the triangle beyond the side opposite to corner k

  Data(ShellTable given, double radius)
      : table(std::move(given)),
        coreRadius(radius),
        rotation(coreRotation(table)),
        start(turned(table.from, rotation)),
        source(table.from, table.triangles),
        target(table.to, table.triangles) {
    const detail::EdgeTable edges(table.triangles, table.from.size());
    across.resize(table.triangles.size());
    for (std::size_t side = 0; side < 3 * across.size(); ++side) {
      const auto sides = edges.sides(static_cast<std::size_t>(edges.edgeOf(side)));
      const std::int32_t other = sides[0] == static_cast<std::int32_t>(side) ? sides[1] : sides[0];
      // Side k runs from corner k to k + 1: opposite to corner k + 2.
      across[side / 3][(side + 2) % 3] = other / 3;
    }
  }

  double share(double radius) const { return detail::coreShare(radius, coreRadius); }

  Mat3 corners(std::size_t t, const std::vector<Vec3>& at) const {
    Mat3 columns;
    for (int k = 0; k < 3; ++k) columns.col(k) = at[table.triangles[t][k]];
    return columns;
  }
  Mat3 cornersAt(std::size_t t, double s) const {
    return (1 - s) * corners(t, start) + s * corners(t, table.to);
  }

  /// sum_k weights_k u_k is parallel to the direction that goes there; nothing where no triangle has it.
  std::optional<SphereLocator::Hit> locateImage(const Vec3& direction, double s) const;

 private:
  Vec3 weightsIn(std::size_t t, const Vec3& direction, double s) const;
};

// By differences of the corners, in which small triangles keep their digits.
Vec3 ShellMap::Data::weightsIn(std::size_t t, const Vec3& direction, double s) const {
  const Mat3 v = cornersAt(t, s);
  Vec3 w;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &next = v.col((k + 1) % 3), &last = v.col((k + 2) % 3);
    w[k] = direction.dot((next - direction).cross(last - direction));
  }
  return w / std::abs(w.sum());
}

// Over the side behind which the direction lies farthest. Such a walk may go round in circles where triangles
// are far from Delaunay's; then all are asked.
std::optional<SphereLocator::Hit> ShellMap::Data::locateImage(const Vec3& direction, double s) const {
  std::optional<SphereLocator::Hit> at =
      s < 0.5 ? source.locate(rotation.transpose() * direction) : target.locate(direction);
  if (!at) at = SphereLocator::Hit{0, Vec3::Zero()};
  const auto patience = 100 + 8 * static_cast<int>(std::sqrt(static_cast<double>(across.size())));
  for (int step = 0; step < patience; ++step) {
    at->weights = weightsIn(at->triangle, direction, s);
    int lowest;
    if (at->weights.minCoeff(&lowest) >= -kSeam) return at;
    at->triangle = static_cast<std::size_t>(across[at->triangle][lowest]);
  }
  std::optional<SphereLocator::Hit> best;
  for (std::size_t t = 0; t < across.size(); ++t) {
    const Vec3 w = weightsIn(t, direction, s);
    if (!best || w.minCoeff() > best->weights.minCoeff()) best = SphereLocator::Hit{t, w};
  }
  return best->weights.minCoeff() >= -kSeam ? best : std::nullopt;
}

ShellMap::ShellMap(ShellTable table, double coreRadius) {
  table = checkedTable(std::move(table), coreRadius);
  requireTiling(table);
  auto data = std::make_shared<Data>(std::move(table), coreRadius);
  requireNoFolds(data->table, data->start);
  data_ = std::move(data);
}

const ShellTable& ShellMap::table() const { return data_->table; }
const Mat3& ShellMap::rotation() const { return data_->rotation; }
double ShellMap::coreRadius() const { return data_->coreRadius; }

double ShellMap::largestDilatation() const {
  const Data& d = *data_;
  double largest = 1;
  for (const Triangle& t : d.table.triangles)
    largest = std::max(largest, dilatation(cornersOf(t, d.table.from), cornersOf(t, d.table.to)));
  return largest;
}

Vec3 ShellMap::ofDirection(const Vec3& direction) const {
  Vec3 image;
  const Vec3 unit = direction.normalized();
  forward({&unit, 1}, {&image, 1});
  return image.normalized();
}

void ShellMap::forward(std::span<const Vec3> from, std::span<Vec3> to) const {
  const Data& d = *data_;
  parallelChunks(from.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double r = from[i].norm(), s = d.share(r);
      if (!isInUnitBall(from[i])) {
        to[i] = nowhere();
      } else if (s == 0) {
        to[i] = d.rotation * from[i];
      } else {
        const auto hit = d.source.locate(from[i]);
        to[i] = hit ? Vec3(r * (d.cornersAt(hit->triangle, s) * hit->weights).normalized()) : nowhere();
      }
    }
  });
}

void ShellMap::inverse(std::span<const Vec3> to, std::span<Vec3> from) const {
  const Data& d = *data_;
  parallelChunks(to.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double r = to[i].norm(), s = d.share(r);
      if (!isInUnitBall(to[i])) {
        from[i] = nowhere();
      } else if (s == 0) {
        from[i] = d.rotation.transpose() * to[i];
      } else {
        const auto hit = s == 1 ? d.target.locate(to[i]) : d.locateImage(to[i] / r, s);
        from[i] =
            hit ? Vec3(r * (d.corners(hit->triangle, d.table.from) * hit->weights).normalized()) : nowhere();
      }
    }
  });
}

// y = |x| n, n = m / |m|, m = L_s x with L_s the linear map of the triangle's cone, affine in s.
void ShellMap::jacobian(std::span<const Vec3> from, std::span<Mat3> derivative) const {
  const Data& d = *data_;
  parallelChunks(from.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double r = from[i].norm(), s = d.share(r);
      derivative[i] = d.rotation;
      if (isInUnitBall(from[i]) && s == 0) continue;
      const auto hit = isInUnitBall(from[i]) ? d.source.locate(from[i]) : std::nullopt;
      if (!hit) {
        derivative[i].setConstant(std::numeric_limits<double>::quiet_NaN());
        continue;
      }
      const Vec3 u = from[i] / r;
      const Mat3 whole =
          d.corners(hit->triangle, d.table.to) * d.corners(hit->triangle, d.table.from).inverse();
      const Mat3 linear = (1 - s) * d.rotation + s * whole;
      const Vec3 m = linear * u;
      const Vec3 n = m.normalized();
      const double slope = detail::coreShareSlope(r, d.coreRadius);
      const Mat3 turn = linear + r * slope * ((whole - d.rotation) * u) * u.transpose();
      derivative[i] = n * u.transpose() + (Mat3::Identity() - n * n.transpose()) * turn / m.norm();
    }
  });
}

}  // namespace polestar
