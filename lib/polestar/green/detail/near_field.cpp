#include "polestar/green/detail/near_field.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {

using namespace near_layout;

struct NearField::NearTriangle {
  std::uint32_t triangle;
  double ratio;  // squared distance from the centroid over the squared near radius
};

struct NearField::Block {
  alignas(64) double field[kFieldEnd][kNearBlock];
  std::size_t paddedCount;
};

void NearCandidates::assign(const NearField& field, std::span<const std::uint32_t> triangles) {
  triangle_.assign(triangles.begin(), triangles.end());
  const std::size_t count = triangles.size();
  for (std::vector<double>* values : {&x_, &y_, &z_, &inverseSquaredRadius_}) values->resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const NearField::Sphere& sphere = field.spheres_[triangles[i]];
    x_[i] = sphere.center[0];
    y_[i] = sphere.center[1];
    z_[i] = sphere.center[2];
    inverseSquaredRadius_[i] = 1 / (sphere.radius * sphere.radius);
  }
}

NearField::NearField(const TriMesh& mesh, double squaredSoftening) : squaredSoftening_(squaredSoftening) {
  const std::size_t count = mesh.triangles.size();
  spheres_.resize(count);
  records_.resize(count);
  corners_.resize(count);
  rotation_.resize(count);
  constexpr std::size_t kChunk = 4096;
  parallelChunks(count, kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t t = begin; t < end; ++t) pack(mesh, t);
  });
}

void NearField::pack(const TriMesh& mesh, std::size_t t) {
  std::array<double, 3> lengths;
  for (int k = 0; k < 3; ++k) lengths[k] = (mesh.corner(t, (k + 1) % 3) - mesh.corner(t, k)).norm();
  const auto first = static_cast<int>(std::max_element(lengths.begin(), lengths.end()) - lengths.begin());
  std::array<Vec3, 3> corner;
  for (int k = 0; k < 3; ++k) {
    corners_[t][k] = mesh.triangles[t][(first + k) % 3];
    corner[k] = mesh.corner(t, (first + k) % 3);
  }
  rotation_[t] = static_cast<std::uint8_t>(first);
  const double length = lengths[first];
  const Vec3 areaVector = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  const Vec3 u = (corner[1] - corner[0]) / length, v = areaVector.cross(u).normalized();

  std::array<double, kNearRecord>& r = records_[t];
  for (int k = 0; k < 3; ++k) {
    for (int d = 0; d < 3; ++d) r[kCorner + 3 * k + d] = corner[k][d];
    r[kAxisV + k] = v[k];
  }
  r[kApex] = u.dot(corner[2] - corner[0]) / length;
  r[kHeight] = areaVector.norm() / (length * length);
  r[kLength1] = lengths[(first + 1) % 3] / length;
  r[kLength2] = lengths[(first + 2) % 3] / length;
  r[kInverse1] = 1 / r[kLength1];
  r[kInverse2] = 1 / r[kLength2];
  r[kLength] = length;
  r[kInverseLength] = 1 / length;
  spheres_[t] = {(mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3, kNear * length};
}

double NearField::area(std::size_t t) const {
  return 0.5 * records_[t][kLength] * records_[t][kLength] * records_[t][kHeight];
}

NearField::Density NearField::density(std::span<const double> atVertices) const {
  Density result;
  result.affine_.resize(triangleCount());
  for (std::size_t t = 0; t < triangleCount(); ++t) {
    const std::array<double, kNearRecord>& r = records_[t];
    const double value = atVertices[corners_[t][0]];
    const double slopeU = atVertices[corners_[t][1]] - value;
    const double slopeV = (atVertices[corners_[t][2]] - value - slopeU * r[kApex]) / r[kHeight];
    result.affine_[t] = {value, slopeU, slopeV, 0};
  }
  return result;
}

void NearField::fill(const NearTriangle* near, std::size_t count, const Density* density,
                     Block& block) const {
  block.paddedCount = (count + kNearLanes - 1) / kNearLanes * kNearLanes;
  std::array<const double*, kNearBlock> record{}, affine{};
  for (std::size_t i = 0; i < block.paddedCount; ++i) {
    const bool padding = i >= count;  // the last one again, with weight 0
    const NearTriangle& n = near[padding ? count - 1 : i];
    record[i] = records_[n.triangle].data();
    if (density != nullptr) affine[i] = density->affine_[n.triangle].data();
    block.field[kRatio][i] = padding ? 1 : n.ratio;
  }
  layOutNear(record.data(), density != nullptr ? affine.data() : nullptr, block.paddedCount, block.field[0]);
}

// Calls compute(near triangles, their number, block) for up to kNearBlock of them at a time. Blocks are
// filled in order whatever lies between, so that sums do not depend on the candidates that are not near.
template <class Compute>
void NearField::forNearBlocks(const Vec3& x, const NearCandidates& c, const Density* density,
                              Compute compute) const {
  constexpr std::size_t kChunk = 512;
  std::array<double, kChunk> ratio;
  std::array<NearTriangle, kChunk + kNearBlock> near;
  std::size_t count = 0;
  Block block;
  auto flush = [&](std::size_t first, std::size_t number) {
    fill(&near[first], number, density, block);
    compute(&near[first], number, block);
  };
  for (std::size_t begin = 0; begin < c.size(); begin += kChunk) {
    const std::size_t chunk = std::min(kChunk, c.size() - begin);
    squaredDistanceRatios(&c.x_[begin], &c.y_[begin], &c.z_[begin], &c.inverseSquaredRadius_[begin], chunk,
                          {x[0], x[1], x[2]}, ratio.data());
    for (std::size_t i = 0; i < chunk; ++i) {  // no branch: half of them would be mispredicted
      near[count] = {c.triangle_[begin + i], ratio[i]};
      count += ratio[i] < 1;
    }
    std::size_t done = 0;
    for (; count - done >= kNearBlock; done += kNearBlock) flush(done, kNearBlock);
    std::copy(near.begin() + done, near.begin() + count, near.begin());
    count -= done;
  }
  if (count > 0) flush(0, count);
}

void NearField::appendRows(const Vec3& x, const NearCandidates& candidates, std::vector<Row>& rows) const {
  forNearBlocks(x, candidates, nullptr, [&](const NearTriangle* near, std::size_t count, Block& block) {
    constexpr std::array<std::array<std::uint8_t, 3>, 3> kRotated{{{0, 1, 2}, {1, 2, 0}, {2, 0, 1}}};
    double coefficient[3 * kNearBlock];
    nearCoefficients(block.field[0], block.paddedCount, {x[0], x[1], x[2]}, squaredSoftening_, coefficient);
    const std::size_t begin = rows.size();
    rows.resize(begin + count);
    for (std::size_t i = 0; i < count; ++i) {
      Row& row = rows[begin + i];
      row.triangle = near[i].triangle;
      const std::array<std::uint8_t, 3>& corner = kRotated[rotation_[row.triangle]];
      for (int k = 0; k < 3; ++k) row.coefficient[corner[k]] = coefficient[k * kNearBlock + i];
    }
  });
}

double NearField::potential(const Vec3& x, const NearCandidates& candidates, const Density& density) const {
  double sum = 0;
  forNearBlocks(x, candidates, &density, [&](const NearTriangle*, std::size_t, Block& block) {
    sum += sumNearPotential(block.field[0], block.paddedCount, {x[0], x[1], x[2]}, squaredSoftening_);
  });
  return sum;
}

void NearField::addPotentialAndGradient(const Vec3& x, const NearCandidates& candidates,
                                        const Density& density, double& potential, Vec3& gradient) const {
  double result[4] = {potential, gradient[0], gradient[1], gradient[2]};
  forNearBlocks(x, candidates, &density, [&](const NearTriangle*, std::size_t, Block& block) {
    sumNearPotentialAndGradient(block.field[0], block.paddedCount, {x[0], x[1], x[2]}, squaredSoftening_,
                                result);
  });
  potential = result[0];
  gradient = Vec3(result[1], result[2], result[3]);
}

}  // namespace polestar::detail
