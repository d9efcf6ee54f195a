#include "polestar/star/detail/half_spaces.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

// a b - c d with an error of 1.5 ulp of the result [Kahan; Jeannerod, Louvet, Muller 2013].
double differenceOfProducts(double a, double b, double c, double d) {
  const double cd = c * d;
  const double error = std::fma(-c, d, cd);
  return std::fma(a, b, -cd) + error;
}

Vec3 accurateCross(const Vec3& u, const Vec3& v) {
  return {differenceOfProducts(u[1], v[2], u[2], v[1]), differenceOfProducts(u[2], v[0], u[0], v[2]),
          differenceOfProducts(u[0], v[1], u[1], v[0])};
}

// What the rounded difference b - a lacks of the true one.
Vec3 differenceTail(const Vec3& a, const Vec3& b) {
  Vec3 tail;
  for (int k = 0; k < 3; ++k) {
    const double rounded = b[k] - a[k];
    const double aVirtual = b[k] - rounded;
    const double bVirtual = rounded + aVirtual;
    tail[k] = (b[k] - bVirtual) + (aVirtual - a[k]);
  }
  return tail;
}

// Twice the area times the normal, for coordinates of moderate size.
Vec3 carefulAreaVector(const Vec3& p0, const Vec3& p1, const Vec3& p2) {
  // Rounding of the cross product grows with the product of the two sides: take the corner between the
  // shortest.
  const double opposite0 = (p2 - p1).squaredNorm(), opposite1 = (p0 - p2).squaredNorm(),
               opposite2 = (p1 - p0).squaredNorm();
  const bool first = opposite0 >= opposite1 && opposite0 >= opposite2;
  const bool second = !first && opposite1 >= opposite2;
  const Vec3& a = first ? p0 : second ? p1 : p2;
  const Vec3& b = first ? p1 : second ? p2 : p0;
  const Vec3& c = first ? p2 : second ? p0 : p1;
  const Vec3 u = b - a, v = c - a;
  const Vec3 cross = u.cross(v);
  // Six digits lost are affordable; a thinner needle gets the differences' tails and unrounded products.
  constexpr double kNeedle = 1e-6;
  if (cross.squaredNorm() > kNeedle * kNeedle * u.squaredNorm() * v.squaredNorm()) return cross;
  const Vec3 uTail = differenceTail(a, b), vTail = differenceTail(a, c);
  return accurateCross(u, v) + (u.cross(vTail) + uTail.cross(v));
}

}  // namespace

Frame workingFrame(const TriMesh& mesh) {
  const Box box = boundingBox(mesh);
  const double diagonal = box.diagonal();
  Frame frame;
  frame.origin = box.min + 0.5 * box.extent();
  if (diagonal > 0) frame.unit = std::exp2(std::ceil(std::log2(diagonal)));
  return frame;
}

HalfSpaces::HalfSpaces(const TriMesh& mesh, const Frame& frame, std::size_t stride) {
  const std::size_t count = (mesh.triangles.size() + stride - 1) / stride;
  for (auto* component : {&x_, &y_, &z_, &offset_, &area_})
    component->resize(static_cast<Eigen::Index>(count));
  const double scale = 1 / frame.unit;  // exact: the unit is a power of two
  totalArea_ = reduceChunks(
      count, kChunk, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t i = begin; i < end; ++i) {
          const Triangle& t = mesh.triangles[i * stride];
          const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]];
          const Vec3 areaVector = carefulAreaVector(scale * a, scale * b, scale * c);
          double twiceArea = areaVector.norm();
          if (twiceArea < 1e-140) twiceArea = areaVector.stableNorm();
          const Vec3 normal = twiceArea > 0 ? Vec3(areaVector / twiceArea) : Vec3(Vec3::Zero());
          x_[i] = normal[0];
          y_[i] = normal[1];
          z_[i] = normal[2];
          offset_[i] =
              twiceArea > 0 ? normal.dot(scale * (a - frame.origin)) : std::numeric_limits<double>::max();
          area_[i] = 0.5 * twiceArea;
          sum += area_[i];
        }
        return sum;
      },
      std::plus<>());
}

FaceSlack HalfSpaces::tightestIn(std::size_t begin, std::size_t end, const Vec3& c) const {
  // The minimum vectorizes, its place does not: find the value in short blocks, then the place in the best
  // block.
  constexpr std::size_t kBlock = 256;
  const double cx = c[0], cy = c[1], cz = c[2];
  const double *x = x_.data(), *y = y_.data(), *z = z_.data(), *offset = offset_.data();
  double best = std::numeric_limits<double>::infinity();
  std::size_t bestBlock = begin;
  for (std::size_t block = begin; block < end; block += kBlock) {
    const std::size_t blockEnd = std::min(end, block + kBlock);
    double smallest = std::numeric_limits<double>::infinity();
#pragma omp simd reduction(min : smallest)
    for (std::size_t i = block; i < blockEnd; ++i) {
      const double slack = offset[i] - (x[i] * cx + y[i] * cy + z[i] * cz);
      smallest = slack < smallest ? slack : smallest;
    }
    if (smallest < best) {
      best = smallest;
      bestBlock = block;
    }
  }
  for (std::size_t i = bestBlock; i < std::min(end, bestBlock + kBlock); ++i) {
    if (offset[i] - (x[i] * cx + y[i] * cy + z[i] * cz) <= best) return {static_cast<std::int32_t>(i), best};
  }
  return {static_cast<std::int32_t>(bestBlock), best};
}

std::vector<FaceSlack> HalfSpaces::tightestPerChunk(const Vec3& c) const {
  std::vector<FaceSlack> tightest((size() + kChunk - 1) / kChunk);
  parallelChunks(size(), kChunk, [&](std::size_t begin, std::size_t end) {
    tightest[begin / kChunk] = tightestIn(begin, end, c);
  });
  return tightest;
}

FaceSlack HalfSpaces::tightest(const Vec3& c) const {
  FaceSlack best{-1, std::numeric_limits<double>::infinity()};
  for (const FaceSlack& candidate : tightestPerChunk(c)) {
    if (candidate.slack < best.slack) best = candidate;
  }
  return best;
}

double HalfSpaces::areaBehind(const Vec3& c) const {
  const double cx = c[0], cy = c[1], cz = c[2];
  const double *x = x_.data(), *y = y_.data(), *z = z_.data(), *offset = offset_.data(), *area = area_.data();
  const std::size_t count = size();
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = 0; i < count; ++i) {
    sum += offset[i] - (x[i] * cx + y[i] * cy + z[i] * cz) <= 0 ? area[i] : 0.0;
  }
  return sum;
}

}  // namespace polestar::detail
