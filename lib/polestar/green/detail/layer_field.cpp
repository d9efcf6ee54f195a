#include "polestar/green/detail/layer_field.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "polestar/core/detail/edge_table.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/green/detail/device_sums.h"
#include "polestar/green/detail/leaf_groups.h"
#include "polestar/green/detail/multipole.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

// Below this many pairs the direct sum is the faster one: sums of order 7 overtake it at 4 million pairs,
// those of order 13 at 30 million (tests/bench/multipole_bench.cpp, AVX-512).
constexpr double kDirectPairs = 1.5e7;
// Whoever asks for a device gets it up to this many pairs, those of 10,000 vertices. Beyond, the fast
// multipole method leaves it behind: without a GPU, PoCL on two cores takes half a second for them.
constexpr double kDevicePairs = 1e9;
// A field is asked for many points: its plan pays earlier.
constexpr std::size_t kDirectCharges = 1500;

// Only for sums that are corrected later, as those of inner iterations are.
PairPrecision precisionFor(double accuracy) {
  return accuracy > 2e-5 ? PairPrecision::single : PairPrecision::full;
}

// The sums pair by pair, if they are to be had that way; else null.
std::unique_ptr<PotentialSums> sumPairByPair(const PointCharges& places, std::span<const Vec3> targets,
                                             double accuracy, const std::shared_ptr<PairDevice>& device) {
  const double pairs = static_cast<double>(places.size()) * static_cast<double>(targets.size());
  const bool asked = device && device->accuracy() <= accuracy && pairs < kDevicePairs;
  if (!asked && pairs >= kDirectPairs) return nullptr;
  std::vector<Vec3> points(targets.begin(), targets.end());
  if (asked) return std::make_unique<DeviceSums>(device, places, std::move(points));
  return std::make_unique<DirectSums>(places, std::move(points));
}

}  // namespace

LayerQuadrature::LayerQuadrature(const TriMesh& mesh, const Context& context)
    : vertexCount_(mesh.vertices.size()), corners_(mesh.triangles) {
  const std::size_t count = corners_.size();
  const EdgeTable edges(corners_, vertexCount_);
  edgeWeight_.assign(edges.size(), 0);
  for (std::size_t e = 0; e < edges.size(); ++e) {
    edgeEnds_.push_back(edges.ends(e));
    const Vec3 middle = 0.5 * (mesh.vertices[edgeEnds_[e][0]] + mesh.vertices[edgeEnds_[e][1]]);
    places_.x.push_back(middle[0]);
    places_.y.push_back(middle[1]);
    places_.z.push_back(middle[2]);
  }
  std::vector<double> diameters(count);
  for (std::size_t t = 0; t < count; ++t) {
    const Vec3 &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
    const double area = 0.5 * (b - a).cross(c - a).norm();
    diameters[t] = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    for (int k = 0; k < 3; ++k) edgeWeight_[edges.edgeOf(3 * t + k)] += area / 3;
  }
  places_.charge.assign(edgeEnds_.size(), 0.0);
  std::nth_element(diameters.begin(), diameters.begin() + count / 2, diameters.end());
  places_.squaredSoftening = std::pow(1e-6 * diameters[count / 2], 2);
  near_ = std::make_unique<const NearField>(mesh, places_.squaredSoftening);
  nearIndex_ = std::make_unique<const NearIndex>(*near_, enclosingCube(mesh.vertices), context);
}

std::vector<double> LayerQuadrature::chargesFor(std::span<const double> density) const {
  std::vector<double> charge(edgeEnds_.size());
  for (std::size_t e = 0; e < charge.size(); ++e)
    charge[e] = 0.5 * edgeWeight_[e] * (density[edgeEnds_[e][0]] + density[edgeEnds_[e][1]]);
  return charge;
}

void LayerQuadrature::addNearPotential(std::span<const Vec3> points, const NearField::Density& density,
                                       std::span<double> far, const Context& context) const {
  // Sorted along a curve, so that points of a block share leaves.
  std::vector<std::pair<std::uint32_t, std::uint32_t>> sorted(points.size());
  parallelChunks(points.size(), 4096, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      sorted[i] = {nearIndex_->locate(points[i]), static_cast<std::uint32_t>(i)};
  });
  std::sort(sorted.begin(), sorted.end());
  parallelChunks(points.size(), kPointBlock, context, [&](std::size_t begin, std::size_t end) {
    NearCandidates candidates;
    for (std::size_t i = begin; i < end; ++i) {
      if (i == begin || sorted[i].first != sorted[i - 1].first)
        candidates.assign(*near_, nearIndex_->candidates(sorted[i].first));
      const std::uint32_t p = sorted[i].second;
      far[p] += near_->potential(points[p], candidates, density);
    }
  });
}

void LayerQuadrature::addNearGradient(std::span<const Vec3> points, const NearField::Density& density,
                                      std::span<double> far, std::span<Vec3> gradient,
                                      const Context& context) const {
  forPointBlocks(points.size(), context, [&](std::size_t begin, std::size_t end) {
    NearCandidates candidates;
    visitLeafGroups(
        points, begin, end, [&](const Vec3& p) { return nearIndex_->locate(p); },
        [&](std::uint32_t leaf, std::span<const std::uint32_t> indices, std::span<const Vec3> group) {
          if (nearIndex_->candidates(leaf).empty()) return;
          candidates.assign(*near_, nearIndex_->candidates(leaf));
          for (std::size_t i = 0; i < group.size(); ++i)
            near_->addPotentialAndGradient(group[i], candidates, density, far[indices[i]],
                                           gradient[indices[i]]);
        });
  });
}

std::unique_ptr<PotentialSums> makeSums(const PointCharges& places, std::span<const Vec3> targets,
                                        double accuracy, const std::shared_ptr<PairDevice>& device) {
  std::unique_ptr<PotentialSums> sums = sumPairByPair(places, targets, accuracy, device);
  return sums ? std::move(sums)
              : std::make_unique<MultipoleSums>(places, targets, orderFor(accuracy), precisionFor(accuracy));
}

SumsOfTwoAccuracies makeSums(const PointCharges& places, std::span<const Vec3> targets, double cheap,
                             double exact, const std::shared_ptr<PairDevice>& device) {
  SumsOfTwoAccuracies sums{sumPairByPair(places, targets, cheap, device),
                           sumPairByPair(places, targets, exact, device)};
  if (!sums.exact) {
    auto multipole = std::make_unique<MultipoleSums>(places, targets, orderFor(exact), precisionFor(exact));
    if (!sums.cheap) {
      sums.cheap =
          std::make_unique<MultipoleSums>(multipole->withOrder(orderFor(cheap), precisionFor(cheap)));
    }
    sums.exact = std::move(multipole);
  }
  return sums;
}

std::unique_ptr<ChargeField> makeField(PointCharges charges, double accuracy, double finest,
                                       double truncation, const Context& context) {
  if (charges.size() < kDirectCharges) return std::make_unique<DirectChargeField>(std::move(charges));
  return std::make_unique<MultipoleField>(charges, orderFor(accuracy), finest, context, truncation);
}

AlignedSurface::AlignedSurface(const TriMesh& original, const Mat3& along, const Context& context)
    : axes(along),
      mesh(transformed(original, [&](const Vec3& v) { return Vec3(along * v); })),
      quadrature(mesh, context) {}

LayerField::LayerField(std::shared_ptr<const AlignedSurface> surface, std::span<const double> density,
                       double accuracy, const Context& context, double truncation)
    : surface_(std::move(surface)),
      atVertices_(density.begin(), density.end()),
      density_(quadrature().near().density(density)) {
  PointCharges charges = quadrature().places();
  charges.charge = quadrature().chargesFor(density);
  double shortest = 1;  // no box needs to be smaller than the triangles
  for (std::size_t t = 0; t < quadrature().triangleCount(); ++t)
    shortest = std::min(shortest, quadrature().near().nearSphere(t).radius);
  far_ = makeField(std::move(charges), accuracy, 0.1 * shortest, truncation, context);
}

void LayerField::evaluate(std::span<const Vec3> points, std::span<double> h, std::span<Vec3> gradient) const {
  std::vector<Vec3> along(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) along[i] = axes() * points[i];
  far_->evaluate(along, h, gradient, Context::quiet());
  quadrature().addNearGradient(along, density_, h, gradient, Context::quiet());
  for (Vec3& g : gradient) g = axes().transpose() * g;
}

}  // namespace polestar::detail
