#include "polestar/green/detail/layer_field.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

// Points per block of a parallel sum: enough to reuse a tile of charges, few enough to balance threads.
constexpr std::size_t kPointBlock = 32;

std::uint64_t edgeKey(std::int32_t a, std::int32_t b) {
  const auto [low, high] = std::minmax(a, b);
  return (static_cast<std::uint64_t>(static_cast<std::uint32_t>(low)) << 32) |
         static_cast<std::uint32_t>(high);
}

}  // namespace

LayerQuadrature::LayerQuadrature(const TriMesh& mesh)
    : vertexCount_(mesh.vertices.size()), corners_(mesh.triangles) {
  const std::size_t count = corners_.size();
  triangles_.reserve(count);
  centroids_.resize(count);
  nearRadius_.resize(count);
  edgeOf_.resize(count);
  std::unordered_map<std::uint64_t, std::int32_t> edgeIndex;
  edgeIndex.reserve(2 * count);
  std::vector<double> diameters(count);
  for (std::size_t t = 0; t < count; ++t) {
    triangles_.emplace_back(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
    centroids_[t] = (mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3;
    const LayerTriangle& triangle = triangles_.back();
    diameters[t] = std::max({triangle.length[0], triangle.length[1], triangle.length[2]});
    nearRadius_[t] = kNear * diameters[t];
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = corners_[t][k], b = corners_[t][(k + 1) % 3];
      const auto [entry, isNew] =
          edgeIndex.try_emplace(edgeKey(a, b), static_cast<std::int32_t>(midpoints_.size()));
      if (isNew) {
        midpoints_.push_back(0.5 * (mesh.vertices[a] + mesh.vertices[b]));
        edgeEnds_.push_back({a, b});
        edgeWeight_.push_back(0);
      }
      edgeOf_[t][k] = entry->second;
      edgeWeight_[entry->second] += area(t) / 3;
    }
  }
  std::nth_element(diameters.begin(), diameters.begin() + count / 2, diameters.end());
  squaredSoftening_ = std::pow(1e-6 * diameters[count / 2], 2);

  std::vector<Bounds> spheres(count);
  for (std::size_t t = 0; t < count; ++t) {
    spheres[t].include(centroids_[t] - Vec3::Constant(nearRadius_[t]));
    spheres[t].include(centroids_[t] + Vec3::Constant(nearRadius_[t]));
  }
  nearTree_ = AabbTree(spheres);
}

PointCharges LayerQuadrature::emptyCharges() const {
  PointCharges charges;
  for (const Vec3& m : midpoints_) {
    charges.x.push_back(m[0]);
    charges.y.push_back(m[1]);
    charges.z.push_back(m[2]);
  }
  charges.charge.assign(midpoints_.size(), 0.0);
  charges.squaredSoftening = squaredSoftening_;
  return charges;
}

void LayerQuadrature::chargesFor(std::span<const double> density, PointCharges& charges) const {
  for (std::size_t e = 0; e < midpoints_.size(); ++e) {
    charges.charge[e] = 0.5 * edgeWeight_[e] * (density[edgeEnds_[e][0]] + density[edgeEnds_[e][1]]);
  }
}

bool LayerQuadrature::nearWeight(std::size_t t, const Vec3& x, NearWeight& weight) const {
  const Vec3 offset = x - centroids_[t];
  const double squared = offset.squaredNorm(), radius = nearRadius_[t];
  if (squared >= radius * radius) return false;
  weight = {1, Vec3::Zero()};
  if (squared > kBlendFrom * kBlendFrom * radius * radius) {
    const double distance = std::sqrt(squared);
    const double s = (radius - distance) / ((1 - kBlendFrom) * radius);  // 1 at the inner rim, 0 at the outer
    weight.value = s * s * (3 - 2 * s);
    weight.gradient = -6 * s * (1 - s) / ((1 - kBlendFrom) * radius * distance) * offset;
  }
  return true;
}

void LayerQuadrature::nearRow(const Vec3& x, std::vector<Entry>& row) const {
  const std::size_t begin = row.size();
  nearTree_.visitContaining(x, [&](std::size_t t) {
    NearWeight weight;
    if (!nearWeight(t, x, weight)) return false;
    std::array<double, 3> hat = hatPotentials(triangles_[t], x);
    for (int k = 0; k < 3; ++k) {
      const double charge =
          area(t) / 6 / std::sqrt((x - midpoints_[edgeOf_[t][k]]).squaredNorm() + squaredSoftening_);
      hat[k] -= charge;
      hat[(k + 1) % 3] -= charge;
    }
    for (int k = 0; k < 3; ++k) row.push_back({corners_[t][k], weight.value * hat[k]});
    return false;
  });
  // Sum the triangles' shares of each vertex, in the tree's fixed order.
  std::stable_sort(row.begin() + begin, row.end(),
                   [](const Entry& a, const Entry& b) { return a.vertex < b.vertex; });
  std::size_t kept = begin;
  for (std::size_t i = begin; i < row.size(); ++i) {
    if (kept > begin && row[kept - 1].vertex == row[i].vertex) {
      row[kept - 1].coefficient += row[i].coefficient;
    } else {
      row[kept++] = row[i];
    }
  }
  row.resize(kept);
}

double LayerQuadrature::nearPotential(const Vec3& x, std::span<const double> density) const {
  double sum = 0;
  nearTree_.visitContaining(x, [&](std::size_t t) {
    NearWeight weight;
    if (!nearWeight(t, x, weight)) return false;
    const std::array<double, 3> hat = hatPotentials(triangles_[t], x);
    double exact = 0;
    for (int k = 0; k < 3; ++k) {
      const double sigma = density[corners_[t][k]], next = density[corners_[t][(k + 1) % 3]];
      exact +=
          sigma * hat[k] - area(t) / 6 * (sigma + next) /
                               std::sqrt((x - midpoints_[edgeOf_[t][k]]).squaredNorm() + squaredSoftening_);
    }
    sum += weight.value * exact;
    return false;
  });
  return sum;
}

void LayerQuadrature::addNear(const Vec3& x, std::span<const double> density, double& potential,
                              Vec3& gradient) const {
  nearTree_.visitContaining(x, [&](std::size_t t) {
    NearWeight weight;
    if (!nearWeight(t, x, weight)) return false;
    const Triangle& c = corners_[t];
    const std::array<double, 3> sigma{density[c[0]], density[c[1]], density[c[2]]};
    PotentialAndGradient exact = linearLayer(triangles_[t], sigma, x);
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = x - midpoints_[edgeOf_[t][k]];
      const double inverse = 1 / std::sqrt(offset.squaredNorm() + squaredSoftening_);
      const double term = area(t) / 6 * (sigma[k] + sigma[(k + 1) % 3]) * inverse;
      exact.potential -= term;
      exact.gradient += term * inverse * inverse * offset;
    }
    potential += weight.value * exact.potential;
    gradient += weight.value * exact.gradient + exact.potential * weight.gradient;
    return false;
  });
}

LayerField::LayerField(std::shared_ptr<const LayerQuadrature> quadrature, std::vector<double> density)
    : quadrature_(std::move(quadrature)),
      density_(std::move(density)),
      charges_(quadrature_->emptyCharges()) {
  quadrature_->chargesFor(density_, charges_);
}

void LayerField::evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const {
  auto block = [&](std::size_t begin, std::size_t end) {
    sumPotentialAndGradient(charges_, points.subspan(begin, end - begin), h.subspan(begin, end - begin),
                            gradient.subspan(begin, end - begin));
    for (std::size_t i = begin; i < end; ++i) quadrature_->addNear(points[i], density_, h[i], gradient[i]);
  };
  if (points.size() <= kPointBlock) {
    block(0, points.size());
  } else {
    parallelChunks(points.size(), kPointBlock, block);
  }
}

void LayerField::evaluatePotential(std::span<const Vec3> points, std::span<double> h,
                                   const Context& context) const {
  parallelChunks(points.size(), kPointBlock, context, [&](std::size_t begin, std::size_t end) {
    sumPotential(charges_, points.subspan(begin, end - begin), h.subspan(begin, end - begin));
    for (std::size_t i = begin; i < end; ++i) h[i] += quadrature_->nearPotential(points[i], density_);
  });
}

}  // namespace polestar::detail
