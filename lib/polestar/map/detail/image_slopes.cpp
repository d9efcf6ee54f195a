#include "polestar/map/detail/image_slopes.h"

#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/map/detail/tangent_fit.h"

namespace polestar::detail {
namespace {

class Fitter {
 public:
  Fitter(const GreenChart& chart, std::span<const Vec3> images, const RadiusProfile& profile)
      : chart_(chart),
        foliation_(chart.foliation()),
        images_(images),
        profile_(profile),
        ring_(foliation_.vertexCount) {
    for (const Triangle& t : foliation_.triangles) {
      for (int k = 0; k < 3; ++k) ring_[t[k]].push_back(t[(k + 1) % 3]);
    }
  }

  /// Returns how far the slope is to be trusted.
  float fit(std::size_t level, std::size_t vertex, Eigen::Matrix3f& slope) const {
    const Foliation& f = foliation_;
    const std::size_t id = f.nodeId(level, vertex);
    const Vec3& x = f.nodes[id];
    const double radius = images_[id].norm(), r = x.norm();
    if (!(radius > 0 && r > 0)) return 0;
    const Vec3 u = images_[id] / radius;
    const Vec3 gradient = chart_.harmonicGradient()[id] - x / (r * r * r);
    const double steepness = gradient.norm();
    if (!(steepness > 0 && std::isfinite(steepness))) return 0;
    const Vec3 along = gradient / steepness;  // inward
    const Vec3 turning = turnAlong(level, vertex, u);

    TangentFit ring(along);
    for (const std::int32_t neighbour : ring_[vertex]) {
      const std::size_t other = f.nodeId(level, neighbour);
      const Vec3 offset = f.nodes[other] - x;
      ring.add(offset, images_[other].normalized() - u - along.dot(offset) * turning);
    }
    const std::optional<TangentFit::Slope> across = ring.slope();
    if (!across) return 0;
    Mat3 turn = across->slope + turning * along.transpose();
    turn -= u * (u.transpose() * turn);
    const double rho = chart_.green().harmonicRadius();
    const double greenRadius = std::min(1.0, 1 / (1 + rho * std::max(0.0, 1 / r + chart_.harmonic()[id])));
    const Mat3 result = radius * turn - profile_.derivative(greenRadius) * rho * greenRadius * greenRadius *
                                            u * gradient.transpose();
    slope = result.cast<float>();
    return slope.allFinite() ? static_cast<float>(across->trust) : 0;
  }

 private:
  /// du / d length along the inward field line: 0 outside the core.
  Vec3 turnAlong(std::size_t level, std::size_t vertex, const Vec3& u) const {
    const Foliation& f = foliation_;
    Vec3 sum = Vec3::Zero();
    double weights = 0;
    const Vec3& x = f.node(level, vertex);
    // Of the two differences the one over the shorter way counts more: exact for quadratic change.
    for (const std::ptrdiff_t step : {-1, 1}) {
      const std::ptrdiff_t other = static_cast<std::ptrdiff_t>(level) + step;
      if (other < 0 || other >= static_cast<std::ptrdiff_t>(f.levels.size())) continue;
      const std::size_t id = f.nodeId(static_cast<std::size_t>(other), vertex);
      const double length = (f.nodes[id] - x).norm();
      if (!(length > 0)) continue;
      sum += static_cast<double>(step) / (length * length) * (images_[id].normalized() - u);
      weights += 1 / length;
    }
    return weights > 0 ? Vec3(sum / weights) : Vec3(Vec3::Zero());
  }

  const GreenChart& chart_;
  const Foliation& foliation_;
  std::span<const Vec3> images_;
  const RadiusProfile& profile_;
  std::vector<std::vector<std::int32_t>> ring_;
};

}  // namespace

ImageSlopes slopesOfImages(const GreenChart& chart, std::span<const Vec3> images,
                           const RadiusProfile& profile) {
  const Foliation& f = chart.foliation();
  ImageSlopes result;
  result.slope.assign(f.nodes.size(), Eigen::Matrix3f::Zero());
  result.trust.assign(f.nodes.size(), 0);
  const Fitter fitter(chart, images, profile);
  parallelChunks(f.centerNode(), 1024, [&](std::size_t begin, std::size_t end) {
    for (std::size_t id = begin; id < end; ++id) {
      result.trust[id] = fitter.fit(id / f.vertexCount, id % f.vertexCount, result.slope[id]);
    }
  });
  return result;
}

}  // namespace polestar::detail
