#include "polestar/map/distortion.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "polestar/core/detail/edge_table.h"
#include "polestar/core/detail/parallel.h"

namespace polestar {
namespace {

constexpr std::size_t kChunk = 256;

double quantile(std::vector<double>& values, double share) {
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

struct Segment {
  Vec3 from, to;

  double squaredDistance(const Vec3& x) const {
    const Vec3 along = to - from;
    const double share = std::clamp((x - from).dot(along) / along.squaredNorm(), 0.0, 1.0);
    return (x - from - share * along).squaredNorm();
  }
};

// Edges at which two triangles meet that do not lie in one plane.
std::vector<Segment> sharpEdges(const TriMesh& mesh) {
  constexpr double kFlat = 1 - 1e-6;
  const detail::EdgeTable table(mesh.triangles, mesh.vertices.size());
  std::vector<Segment> edges;
  for (std::size_t e = 0; e < table.size(); ++e) {
    const auto sides = table.sides(e);
    const Vec3 first = areaVector(mesh, static_cast<std::size_t>(sides[0] / 3)).normalized(),
               second = areaVector(mesh, static_cast<std::size_t>(sides[1] / 3)).normalized();
    const auto [a, b] = table.ends(e);
    if (first.dot(second) < kFlat) edges.push_back({mesh.vertices[a], mesh.vertices[b]});
  }
  return edges;
}

// A lattice's points inside the solid, some `count` of them; mesh units.
std::vector<Vec3> spreadPoints(const DomainMap& map, std::size_t count) {
  const TriMesh& surface = map.solid().chart().green().shape().surface().mesh();
  const Box box = boundingBox(surface);
  const double step = std::cbrt(volumeProperties(surface).volume / static_cast<double>(count));
  std::vector<Vec3> points;
  for (double x = box.min.x() + 0.5 * step; x < box.max.x(); x += step) {
    for (double y = box.min.y() + 0.5 * step; y < box.max.y(); y += step) {
      for (double z = box.min.z() + 0.5 * step; z < box.max.z(); z += step) points.emplace_back(x, y, z);
    }
  }
  std::vector<Vec3> ball(points.size());
  map.solid().forward(points, ball);
  std::vector<Vec3> inside;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (ball[i].allFinite()) inside.push_back(points[i]);
  }
  return inside;
}

}  // namespace

Distortion measureDistortion(std::span<const Mat3> derivatives, double medianDeterminant) {
  Distortion distortion;
  distortion.points = derivatives.size();
  std::vector<double> mips, volume;
  for (const Mat3& j : derivatives) {
    const double determinant = j.determinant();
    if (!(determinant > 0) || !std::isfinite(determinant)) {
      ++distortion.folded;
      continue;
    }
    mips.push_back(j.squaredNorm() / (3 * std::pow(determinant, 2.0 / 3)));
    volume.push_back(determinant);
  }
  if (mips.empty()) return distortion;
  const double median = medianDeterminant > 0 ? medianDeterminant : quantile(volume, 0.5);
  distortion.volumeP5 = quantile(volume, 0.05) / median;
  distortion.volumeP95 = quantile(volume, 0.95) / median;
  double sum = 0;
  for (const double m : mips) sum += m;
  distortion.mipsMean = sum / static_cast<double>(mips.size());
  distortion.mipsP99 = quantile(mips, 0.99);
  return distortion;
}

std::vector<DistortionBand> distortionByEdges(const DomainMap& map, std::size_t count) {
  constexpr std::array kEnds{0.05, 0.1, 0.2, 0.5, std::numeric_limits<double>::infinity()};
  const std::vector<Vec3> points = spreadPoints(map, count);
  std::vector<Vec3> images(points.size());
  std::vector<Mat3> derivatives(points.size());
  map.forward(points, images);
  map.jacobian(points, derivatives);
  const std::vector<Segment> edges = sharpEdges(map.domain().chart().green().shape().surface().mesh());
  std::vector<double> distance(points.size());  // in sides of a cell
  detail::parallelChunks(points.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double least = std::numeric_limits<double>::infinity();
      for (const Segment& edge : edges) least = std::min(least, edge.squaredDistance(images[i]));
      distance[i] = std::sqrt(least) / map.shape().cellSide;
    }
  });
  std::vector<double> determinants;
  for (const Mat3& j : derivatives) {
    if (const double d = j.determinant(); d > 0 && std::isfinite(d)) determinants.push_back(d);
  }
  const double median = determinants.empty() ? 0 : quantile(determinants, 0.5);
  std::vector<DistortionBand> bands;
  double from = 0;
  for (const double to : kEnds) {
    std::vector<Mat3> own;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (distance[i] >= from && distance[i] < to) own.push_back(derivatives[i]);
    }
    bands.push_back({from, to, measureDistortion(own, median)});
    from = to;
  }
  return bands;
}

}  // namespace polestar
