#include "polestar/green/detail/near_field.h"

#include <algorithm>
#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/detail/simd_math.h"

// Compiled with -fopenmp-simd -fno-math-errno -fno-trapping-math (see CMakeLists.txt of this folder): without
// them square roots and selections keep the loops scalar.

namespace polestar::detail {

struct NearField::NearTriangle {
  std::uint32_t triangle;
  double ratio;  // squared distance from the centroid over the squared near radius
  double inverseSquaredRadius;
};

namespace {

// A record: the corners, and the triangle in its own plane frame, where they are (0, 0), (length, 0) and
// (apex, height), length the longest edge, so that 0 <= apex <= length. u = (a1 - a0)/length, normal = u x v.
enum Field : std::size_t {
  kCorner = 0,  // 9
  kAxisV = 9,   // 3
  kLength = 12,
  kApex,
  kHeight,
  kInverse0,  // 1/length of edge k, from corner k to k + 1
  kInverse1,
  kInverse2,
  kRecordEnd,
  // Beside the record, in a block:
  kDensity = kRecordEnd,  // value at corner 0, slopes along u and v
  kSlopeU,
  kSlopeV,
  kRatio,  // squared distance from the centroid over the squared near radius
  kInverseSquaredRadius,
  kFieldEnd
};

// Near triangles of a point are laid out field by field, kBlock at most; whole lanes are computed.
constexpr std::size_t kLanes = 8, kBlock = 64;

POLESTAR_INTO_CLONES double larger(double a, double b) { return a > b ? a : b; }
POLESTAR_INTO_CLONES double absolute(double a) { return a < 0 ? -a : a; }

// log((r0 + r1 + length)/(r0 + r1 - length)): the integral of 1/|x - y| along an edge. When x sees the edge
// under an obtuse angle the denominator cancels and is had from the distance to the edge's line.
POLESTAR_INTO_CLONES double edgeLog(double r0, double r1, double dot, double length, double squaredDistance) {
  const double sum = r0 + r1 + length;
  const double floor = 1e-16 * length;  // on the edge the integral is infinite: keep it large and finite
  const bool obtuse = dot < 0;
  const double numerator = obtuse ? (r0 * r1 - dot) * sum * sum : sum;
  const double denominator =
      obtuse ? 2 * length * length * larger(squaredDistance, floor * floor) : larger(r0 + r1 - length, floor);
  return logOfRatio(numerator, denominator);
}

// What all integrals over one triangle share, in its frame.
struct Terms {
  double x, y, z;                       // of the point; z > 0 on the outer side
  double length, apex, height;          // of the triangle
  double inverse0, inverse1, inverse2;  // of the edges' lengths
  double r0, r1, r2;                    // distances of the corners
  double offset0, offset1, offset2;     // of the edges' lines from the foot of x, positive inside of them
  double log0, log1, log2;              // integrals of 1/|x - y| along the edges
  double solidAngle;                    // absolute
  double constant, linearU, linearV;    // integrals of 1/|x - y| and of (y - foot)/|x - y| over the triangle
};

POLESTAR_INTO_CLONES void integrate(Terms& t) {
  const double rest = t.length - t.apex;
  const double x1 = t.x - t.length, x2 = t.x - t.apex, y2 = t.y - t.height;
  const double zz = t.z * t.z, yz = t.y * t.y + zz, yyz = t.y * y2 + zz;
  t.r0 = __builtin_sqrt(t.x * t.x + yz);
  t.r1 = __builtin_sqrt(x1 * x1 + yz);
  t.r2 = __builtin_sqrt(x2 * x2 + (y2 * y2 + zz));
  const double dot0 = t.x * x1 + yz, dot1 = x1 * x2 + yyz, dot2 = t.x * x2 + yyz;

  t.offset0 = t.y;
  t.offset1 = -(t.height * x1 + rest * t.y) * t.inverse1;
  t.offset2 = (t.height * t.x - t.apex * t.y) * t.inverse2;
  const double line1 = t.offset1 * t.offset1 + zz, line2 = t.offset2 * t.offset2 + zz;
  const double length1 = (rest * rest + t.height * t.height) * t.inverse1;
  const double length2 = (t.apex * t.apex + t.height * t.height) * t.inverse2;
  t.log0 = edgeLog(t.r0, t.r1, dot0, t.length, yz);
  t.log1 = edgeLog(t.r1, t.r2, dot1, length1, line1);
  t.log2 = edgeLog(t.r2, t.r0, dot2, length2, line2);

  // Solid angle: tangent of its half = 2 area |z| / (g (r2 + mean r) - height (r0 + r1) y), g = r0 r1 + dot0,
  // the usual denominator [van Oosterom & Strackee 1983] rearranged about the longest edge: the digits of g,
  // which cancel when x sees that edge under an obtuse angle, come from the distance to its line as above.
  const bool obtuse = dot0 < 0;
  const double product = t.r0 * t.r1 + absolute(dot0);
  const double g = obtuse ? t.length * t.length * yz : product, scale = obtuse ? product : 1;
  const double meanR = (t.apex * t.r1 + rest * t.r0) * t.inverse0;
  t.solidAngle = 2 * upperHalfAngle(scale * t.length * t.height * absolute(t.z),
                                    g * (t.r2 + meanR) - scale * t.height * (t.r0 + t.r1) * t.y);

  // The moments by the divergence theorem, one term an edge. [Wilton et al. 1984; Graglia 1993]
  t.constant = t.offset0 * t.log0 + t.offset1 * t.log1 + t.offset2 * t.log2 - absolute(t.z) * t.solidAngle;
  const double start1 = (rest * x1 - t.height * t.y) * t.inverse1;  // along edge 1, from the foot to corner 1
  const double end2 = (t.apex * t.x + t.height * t.y) * t.inverse2;  // along edge 2, to corner 0
  const double edge0 = yz * t.log0 + t.x * t.r0 - x1 * t.r1;
  const double edge1 = (line1 * t.log1 + (start1 + length1) * t.r2 - start1 * t.r1) * t.inverse1;
  const double edge2 = (line2 * t.log2 + end2 * t.r0 - (end2 - length2) * t.r2) * t.inverse2;
  t.linearU = 0.5 * t.height * (edge1 - edge2);
  t.linearV = 0.5 * (rest * edge1 + t.apex * edge2 - edge0);
}

struct Vector {
  double x, y, z;
};
POLESTAR_INTO_CLONES double dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
POLESTAR_INTO_CLONES Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// A triangle of a block seen from the point: frame, midpoints of the edges minus x, inverse softened
// distances.
struct View {
  Terms terms;
  Vector u, v, normal;
  Vector middle0, middle1, middle2;
  double inverse0, inverse1, inverse2;
  double weight, weightSlope;  // gradient of the weight = weightSlope * (sum of the middles)
};

POLESTAR_INTO_CLONES Vector middle(const double* p, std::size_t a, std::size_t b, const Vector& x) {
  // As the point charges' positions are rounded, so that close to one of them both cancel.
  return {0.5 * (p[a * kBlock] + p[b * kBlock]) - x.x,
          0.5 * (p[(a + 1) * kBlock] + p[(b + 1) * kBlock]) - x.y,
          0.5 * (p[(a + 2) * kBlock] + p[(b + 2) * kBlock]) - x.z};
}

// p: the lane's first field, the others kBlock apart.
POLESTAR_INTO_CLONES View view(const double* p, const Vector& x, double squaredSoftening) {
  View s;
  Terms& t = s.terms;
  t.length = p[kLength * kBlock];
  t.apex = p[kApex * kBlock];
  t.height = p[kHeight * kBlock];
  t.inverse0 = p[kInverse0 * kBlock];
  t.inverse1 = p[kInverse1 * kBlock];
  t.inverse2 = p[kInverse2 * kBlock];
  const Vector corner{p[0], p[kBlock], p[2 * kBlock]};
  s.u = {(p[3 * kBlock] - corner.x) * t.inverse0, (p[4 * kBlock] - corner.y) * t.inverse0,
         (p[5 * kBlock] - corner.z) * t.inverse0};
  s.v = {p[kAxisV * kBlock], p[(kAxisV + 1) * kBlock], p[(kAxisV + 2) * kBlock]};
  s.normal = cross(s.u, s.v);
  const Vector offset{x.x - corner.x, x.y - corner.y, x.z - corner.z};
  t.x = dot(offset, s.u);
  t.y = dot(offset, s.v);
  t.z = dot(offset, s.normal);
  integrate(t);

  s.middle0 = middle(p, 0, 3, x);
  s.middle1 = middle(p, 3, 6, x);
  s.middle2 = middle(p, 6, 0, x);
  s.inverse0 = 1 / __builtin_sqrt(dot(s.middle0, s.middle0) + squaredSoftening);
  s.inverse1 = 1 / __builtin_sqrt(dot(s.middle1, s.middle1) + squaredSoftening);
  s.inverse2 = 1 / __builtin_sqrt(dot(s.middle2, s.middle2) + squaredSoftening);

  // Smooth step in the distance from the centroid, from 0 at the near radius to 1 at kBlendFrom of it.
  constexpr double kBlend = NearField::kBlendFrom, kSteep = 1 / (1 - kBlend);
  const double share = __builtin_sqrt(larger(p[kRatio * kBlock], kBlend * kBlend));
  const double step = (1 - share) * kSteep;
  s.weight = step * step * (3 - 2 * step);
  s.weightSlope = 2 * kSteep * step * (1 - step) * p[kInverseSquaredRadius * kBlock] / share;
  return s;
}

// The lanes' functions keep their structs to themselves: within the loops' own scope GCC 12 would spread each
// over an array and not vectorize.

POLESTAR_INTO_CLONES double lanePotential(const double* p, const Vector& x, double squaredSoftening) {
  const View s = view(p, x, squaredSoftening);
  const Terms& t = s.terms;
  const double value = p[kDensity * kBlock], slopeU = p[kSlopeU * kBlock], slopeV = p[kSlopeV * kBlock];
  const double exact =
      (value + slopeU * t.x + slopeV * t.y) * t.constant + slopeU * t.linearU + slopeV * t.linearV;
  const double charges = (value + 0.5 * slopeU * t.length) * s.inverse0 +
                         (value + 0.5 * (slopeU * (t.length + t.apex) + slopeV * t.height)) * s.inverse1 +
                         (value + 0.5 * (slopeU * t.apex + slopeV * t.height)) * s.inverse2;
  return s.weight * (exact - t.length * t.height / 6 * charges);
}

POLESTAR_SIMD_CLONES
double blockPotential(const double* fields, std::size_t count, double px, double py, double pz,
                      double squaredSoftening) {
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = 0; i < count; ++i) sum += lanePotential(fields + i, {px, py, pz}, squaredSoftening);
  return sum;
}

// result[k * kBlock]: coefficient of corner k.
POLESTAR_INTO_CLONES void laneRow(const double* p, const Vector& x, double squaredSoftening, double* result) {
  const View s = view(p, x, squaredSoftening);
  const Terms& t = s.terms;
  // The hat functions of the corners: hat 2 is y/height, hat 1 is (x - apex hat 2)/length, and all sum to 1.
  const double hat2 = (t.y * t.constant + t.linearV) / t.height;
  const double hat1 = (t.x * t.constant + t.linearU - t.apex * hat2) * t.inverse0;
  const double hat0 = t.constant - hat1 - hat2;
  const double charge = t.length * t.height / 12;
  result[0] = s.weight * (hat0 - charge * (s.inverse2 + s.inverse0));
  result[kBlock] = s.weight * (hat1 - charge * (s.inverse0 + s.inverse1));
  result[2 * kBlock] = s.weight * (hat2 - charge * (s.inverse1 + s.inverse2));
}

POLESTAR_SIMD_CLONES
void blockRows(const double* fields, std::size_t count, double px, double py, double pz,
               double squaredSoftening, double* result) {
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) laneRow(fields + i, {px, py, pz}, squaredSoftening, result + i);
}

// Gradient of the exact potential, in the triangle's frame.
POLESTAR_INTO_CLONES Vector exactGradient(const Terms& t, double valueAtFoot, double slopeU, double slopeV) {
  const double rest = t.length - t.apex;
  const double angled = absolute(t.z) * t.solidAngle;
  // Integral of the outward normals over |x - y| along the edges.
  const double normal1 = t.log1 * t.inverse1, normal2 = t.log2 * t.inverse2;
  const double edgeU = t.height * (normal1 - normal2), edgeV = rest * normal1 + t.apex * normal2 - t.log0;
  // Edge by edge, the slope along it times its share.
  const double along1 = (slopeV * t.height - slopeU * rest) * t.inverse1 * t.inverse1;
  const double along2 = -(slopeU * t.apex + slopeV * t.height) * t.inverse2 * t.inverse2;
  const double tangential1 = along1 * t.offset1 * t.log1, across1 = along1 * (t.r2 - t.r1);
  const double tangential2 = along2 * t.offset2 * t.log2, across2 = along2 * (t.r0 - t.r2);
  // On the plane, up to rounding, the point counts as inside the solid.
  const double signedAngle = t.z > 1e-13 * t.length ? -t.solidAngle : t.solidAngle;
  return {slopeU * (t.offset0 * t.log0 - angled) - valueAtFoot * edgeU - rest * tangential1 -
              t.apex * tangential2 - t.height * (across1 - across2),
          slopeU * (t.r1 - t.r0) - slopeV * angled - valueAtFoot * edgeV +
              t.height * (tangential1 - tangential2) - rest * across1 - t.apex * across2,
          valueAtFoot * signedAngle + t.z * (slopeU * edgeU + slopeV * edgeV)};
}

// result[k * kBlock]: potential and gradient.
POLESTAR_INTO_CLONES void lanePotentialAndGradient(const double* p, const Vector& x, double squaredSoftening,
                                                   double* result) {
  const View s = view(p, x, squaredSoftening);
  const Terms& t = s.terms;
  const double value = p[kDensity * kBlock], slopeU = p[kSlopeU * kBlock], slopeV = p[kSlopeV * kBlock];
  const double valueAtFoot = value + slopeU * t.x + slopeV * t.y;
  const double third = t.length * t.height / 6;
  const double charge0 = third * s.inverse0 * (value + 0.5 * slopeU * t.length);
  const double charge1 =
      third * s.inverse1 * (value + 0.5 * (slopeU * (t.length + t.apex) + slopeV * t.height));
  const double charge2 = third * s.inverse2 * (value + 0.5 * (slopeU * t.apex + slopeV * t.height));
  const double difference =
      valueAtFoot * t.constant + slopeU * t.linearU + slopeV * t.linearV - (charge0 + charge1 + charge2);

  const Vector g = exactGradient(t, valueAtFoot, slopeU, slopeV);
  // Of the weight and of the charges: both along the middles.
  const double blend = s.weightSlope * difference;
  const double m0 = blend - s.weight * charge0 * s.inverse0 * s.inverse0;
  const double m1 = blend - s.weight * charge1 * s.inverse1 * s.inverse1;
  const double m2 = blend - s.weight * charge2 * s.inverse2 * s.inverse2;
  result[0] = s.weight * difference;
  result[kBlock] = s.weight * (g.x * s.u.x + g.y * s.v.x + g.z * s.normal.x) + m0 * s.middle0.x +
                   m1 * s.middle1.x + m2 * s.middle2.x;
  result[2 * kBlock] = s.weight * (g.x * s.u.y + g.y * s.v.y + g.z * s.normal.y) + m0 * s.middle0.y +
                       m1 * s.middle1.y + m2 * s.middle2.y;
  result[3 * kBlock] = s.weight * (g.x * s.u.z + g.y * s.v.z + g.z * s.normal.z) + m0 * s.middle0.z +
                       m1 * s.middle1.z + m2 * s.middle2.z;
}

POLESTAR_SIMD_CLONES
void blockPotentialAndGradient(const double* fields, std::size_t count, double px, double py, double pz,
                               double squaredSoftening, double* result) {
  alignas(64) double lane[4 * kBlock];
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    lanePotentialAndGradient(fields + i, {px, py, pz}, squaredSoftening, lane + i);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (std::size_t i = 0; i < count; ++i) sum += lane[k * kBlock + i];
    result[k] += sum;
  }
}

// ratio[i]: squared distance of (px, py, pz) over the squared radius, below 1 in the sphere.
POLESTAR_SIMD_CLONES
void squaredRatios(const double* x, const double* y, const double* z, const double* inverseSquaredRadius,
                   std::size_t count, double px, double py, double pz, double* ratio) {
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = px - x[i], dy = py - y[i], dz = pz - z[i];
    ratio[i] = (dx * dx + dy * dy + dz * dz) * inverseSquaredRadius[i];
  }
}

}  // namespace

struct NearField::Block {
  alignas(64) double field[kFieldEnd][kBlock];
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

  std::array<double, kRecord>& r = records_[t];
  for (int k = 0; k < 3; ++k) {
    for (int d = 0; d < 3; ++d) r[kCorner + 3 * k + d] = corner[k][d];
    r[kAxisV + k] = v[k];
    r[kInverse0 + k] = 1 / lengths[(first + k) % 3];
  }
  r[kLength] = length;
  r[kApex] = u.dot(corner[2] - corner[0]);
  r[kHeight] = areaVector.norm() / length;
  spheres_[t] = {(mesh.corner(t, 0) + mesh.corner(t, 1) + mesh.corner(t, 2)) / 3, kNear * length};
}

double NearField::area(std::size_t t) const { return 0.5 * records_[t][kLength] * records_[t][kHeight]; }

NearField::Density NearField::density(std::span<const double> atVertices) const {
  Density result;
  result.affine_.resize(triangleCount());
  for (std::size_t t = 0; t < triangleCount(); ++t) {
    const std::array<double, kRecord>& r = records_[t];
    const double value = atVertices[corners_[t][0]];
    const double slopeU = (atVertices[corners_[t][1]] - value) * r[kInverse0];
    const double slopeV = (atVertices[corners_[t][2]] - value - slopeU * r[kApex]) / r[kHeight];
    result.affine_[t] = {value, slopeU, slopeV};
  }
  return result;
}

void NearField::fill(const NearTriangle* near, std::size_t count, const Density* density,
                     Block& block) const {
  block.paddedCount = (count + kLanes - 1) / kLanes * kLanes;
  for (std::size_t i = 0; i < block.paddedCount; ++i) {
    const bool padding = i >= count;  // the last one again, with weight 0
    const NearTriangle& n = near[padding ? count - 1 : i];
    const std::array<double, kRecord>& record = records_[n.triangle];
    for (std::size_t f = 0; f < kRecord; ++f) block.field[f][i] = record[f];
    if (density != nullptr) {
      for (std::size_t f = 0; f < 3; ++f) block.field[kDensity + f][i] = density->affine_[n.triangle][f];
    }
    block.field[kRatio][i] = padding ? 1 : n.ratio;
    block.field[kInverseSquaredRadius][i] = n.inverseSquaredRadius;
  }
}

// Calls compute(near triangles, their number, block) for up to kBlock of them at a time. Blocks are filled in
// order whatever lies between, so that sums do not depend on the candidates that are not near.
template <class Compute>
void NearField::forNearBlocks(const Vec3& x, const NearCandidates& c, const Density* density,
                              Compute compute) const {
  constexpr std::size_t kChunk = 512;
  std::array<double, kChunk> ratio;
  std::array<NearTriangle, kChunk + kBlock> near;
  std::size_t count = 0;
  Block block;
  auto flush = [&](std::size_t first, std::size_t number) {
    fill(&near[first], number, density, block);
    compute(&near[first], number, block);
  };
  for (std::size_t begin = 0; begin < c.size(); begin += kChunk) {
    const std::size_t chunk = std::min(kChunk, c.size() - begin);
    squaredRatios(&c.x_[begin], &c.y_[begin], &c.z_[begin], &c.inverseSquaredRadius_[begin], chunk, x[0],
                  x[1], x[2], ratio.data());
    for (std::size_t i = 0; i < chunk; ++i) {  // no branch: half of them would be mispredicted
      near[count] = {c.triangle_[begin + i], ratio[i], c.inverseSquaredRadius_[begin + i]};
      count += ratio[i] < 1;
    }
    std::size_t done = 0;
    for (; count - done >= kBlock; done += kBlock) flush(done, kBlock);
    std::copy(near.begin() + done, near.begin() + count, near.begin());
    count -= done;
  }
  if (count > 0) flush(0, count);
}

void NearField::appendRows(const Vec3& x, const NearCandidates& candidates, std::vector<Row>& rows) const {
  forNearBlocks(x, candidates, nullptr, [&](const NearTriangle* near, std::size_t count, const Block& block) {
    double coefficient[3 * kBlock];
    blockRows(block.field[0], block.paddedCount, x[0], x[1], x[2], squaredSoftening_, coefficient);
    for (std::size_t i = 0; i < count; ++i) {
      Row row{near[i].triangle, {}};
      for (int k = 0; k < 3; ++k)
        row.coefficient[(rotation_[row.triangle] + k) % 3] = coefficient[k * kBlock + i];
      rows.push_back(row);
    }
  });
}

double NearField::potential(const Vec3& x, const NearCandidates& candidates, const Density& density) const {
  double sum = 0;
  forNearBlocks(x, candidates, &density, [&](const NearTriangle*, std::size_t, const Block& block) {
    sum += blockPotential(block.field[0], block.paddedCount, x[0], x[1], x[2], squaredSoftening_);
  });
  return sum;
}

void NearField::addPotentialAndGradient(const Vec3& x, const NearCandidates& candidates,
                                        const Density& density, double& potential, Vec3& gradient) const {
  double result[4] = {potential, gradient[0], gradient[1], gradient[2]};
  forNearBlocks(x, candidates, &density, [&](const NearTriangle*, std::size_t, const Block& block) {
    blockPotentialAndGradient(block.field[0], block.paddedCount, x[0], x[1], x[2], squaredSoftening_, result);
  });
  potential = result[0];
  gradient = Vec3(result[1], result[2], result[3]);
}

}  // namespace polestar::detail
