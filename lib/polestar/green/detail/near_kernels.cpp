#include "polestar/green/detail/near_kernels.h"

#include "polestar/core/detail/simd_math.h"
#include "polestar/green/detail/near_field.h"

// Compiled with -fopenmp-simd -fno-math-errno -fno-trapping-math (see CMakeLists.txt of this folder): without
// them square roots and selections keep the loops scalar.

namespace polestar::detail {
namespace {

// Every lane's function takes the first field of its triangle; the others are kBlock apart.
using namespace near_layout;
constexpr std::size_t kBlock = kNearBlock;
using Vector = NearPoint;

POLESTAR_INTO_CLONES double larger(double a, double b) { return a > b ? a : b; }
POLESTAR_INTO_CLONES double absolute(double a) { return a < 0 ? -a : a; }

POLESTAR_INTO_CLONES double dot(const Vector& a, const Vector& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
POLESTAR_INTO_CLONES Vector cross(const Vector& a, const Vector& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Three stages: what the integrals need, up to logarithms and an angle; these; the results. Stages are loops
// of their own, because one long body would wait for its own latencies. Structs stay within the lanes'
// functions: in the loops' own scope GCC 12 spreads each over an array and does not vectorize.

// Prepares log((r0 + r1 + length)/(r0 + r1 - length)), the integral of 1/|x - y| along an edge. When x sees
// the edge under an obtuse angle the denominator cancels and is had from the distance to the edge's line.
POLESTAR_INTO_CLONES void prepareLog(double r0, double r1, double dot, double length, double squaredDistance,
                                     double& numerator, double& denominator) {
  const double sum = r0 + r1 + length;
  const double floor = 1e-16 * length;  // on the edge the integral is infinite: keep it large and finite
  const bool obtuse = dot < 0;
  numerator = obtuse ? (r0 * r1 - dot) * sum * sum : sum;
  denominator =
      obtuse ? 2 * length * length * larger(squaredDistance, floor * floor) : larger(r0 + r1 - length, floor);
}

POLESTAR_INTO_CLONES double squared(double a) { return a * a; }

// Signed distances of the lines of edges 1 and 2 from the foot of the point, positive inside of them.
POLESTAR_INTO_CLONES double offset1(double x, double y, double apex, double height, double inverse1) {
  return (height * (1 - x) - (1 - apex) * y) * inverse1;
}
POLESTAR_INTO_CLONES double offset2(double x, double y, double apex, double height, double inverse2) {
  return (height * x - apex * y) * inverse2;
}

POLESTAR_INTO_CLONES Vector axisU(const double* p) {
  const double scale = p[kInverseLength * kBlock];
  return {(p[3 * kBlock] - p[0]) * scale, (p[4 * kBlock] - p[kBlock]) * scale,
          (p[5 * kBlock] - p[2 * kBlock]) * scale};
}
POLESTAR_INTO_CLONES Vector axisV(const double* p) {
  return {p[kAxisV * kBlock], p[(kAxisV + 1) * kBlock], p[(kAxisV + 2) * kBlock]};
}

POLESTAR_INTO_CLONES void prepareLane(double* p, const Vector& point) {
  const Vector u = axisU(p), v = axisV(p);
  const double scale = p[kInverseLength * kBlock];
  const Vector offset{(point.x - p[0]) * scale, (point.y - p[kBlock]) * scale,
                      (point.z - p[2 * kBlock]) * scale};
  const double x = dot(offset, u), y = dot(offset, v), z = dot(offset, cross(u, v));
  const double apex = p[kApex * kBlock], height = p[kHeight * kBlock];
  const double x1 = x - 1, x2 = x - apex, y2 = y - height;
  const double zz = z * z, line0 = y * y + zz, mixed = y * y2 + zz;
  const double r0 = __builtin_sqrt(x * x + line0), r1 = __builtin_sqrt(x1 * x1 + line0);
  const double r2 = __builtin_sqrt(x2 * x2 + (y2 * y2 + zz));
  const double dot0 = x * x1 + line0, dot1 = x1 * x2 + mixed, dot2 = x * x2 + mixed;
  const double line1 = squared(offset1(x, y, apex, height, p[kInverse1 * kBlock])) + zz;
  const double line2 = squared(offset2(x, y, apex, height, p[kInverse2 * kBlock])) + zz;
  prepareLog(r0, r1, dot0, 1, line0, p[kLog0 * kBlock], p[kDenominator0 * kBlock]);
  prepareLog(r1, r2, dot1, p[kLength1 * kBlock], line1, p[kLog1 * kBlock], p[kDenominator1 * kBlock]);
  prepareLog(r2, r0, dot2, p[kLength2 * kBlock], line2, p[kLog2 * kBlock], p[kDenominator2 * kBlock]);

  // The tangent of half the solid angle is height |z| / (g (r2 + mean r) - height (r0 + r1) y), g = r0 r1 +
  // dot0: the usual denominator [van Oosterom & Strackee 1983] rearranged about the longest edge, so that the
  // digits of g, which cancel when x sees that edge under an obtuse angle, come from the distance to its line
  // as above.
  const bool obtuse = dot0 < 0;
  const double product = r0 * r1 + absolute(dot0);
  const double g = obtuse ? line0 : product, factor = height * (obtuse ? product : 1);
  p[kHalfAngle * kBlock] = factor * absolute(z);
  p[kCosine * kBlock] = g * (r2 + r0 + apex * (r1 - r0)) - factor * (r0 + r1) * y;
  p[kX * kBlock] = x;
  p[kY * kBlock] = y;
  p[kZ * kBlock] = z;
  p[kR0 * kBlock] = r0;
  p[kR1 * kBlock] = r1;
  p[kR2 * kBlock] = r2;
}

POLESTAR_INTO_CLONES void prepare(double* fields, std::size_t count, const Vector& point) {
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) prepareLane(fields + i, point);
  for (std::size_t k = 0; k < 3; ++k) {
    double* ratio = fields + (kLog0 + k) * kBlock;
    const double* denominator = fields + (kDenominator0 + k) * kBlock;
#pragma omp simd
    for (std::size_t i = 0; i < count; ++i) ratio[i] = logOfRatio(ratio[i], denominator[i]);
  }
  double* sine = fields + kHalfAngle * kBlock;
  const double* cosine = fields + kCosine * kBlock;
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) sine[i] = upperHalfAngle(sine[i], cosine[i]);
}

// The integrals over one triangle, in its scaled frame.
struct Terms {
  double x, y, z;       // of the point; z > 0 on the outer side
  double apex, height;  // of the triangle
  double inverse1, inverse2;
  double r0, r1, r2;        // distances of the corners
  double offset1, offset2;  // of the lines of edges 1 and 2 from the foot of the point, positive inside
  double log0, log1, log2;  // integrals of 1/|x - y| along the edges
  double angled;            // |z| times the solid angle
  double constant, linearU, linearV;  // integrals of 1/|x - y| and of (y - foot)/|x - y| over the triangle
};

POLESTAR_INTO_CLONES Terms integrals(const double* p) {
  Terms t{.x = p[kX * kBlock],
          .y = p[kY * kBlock],
          .z = p[kZ * kBlock],
          .apex = p[kApex * kBlock],
          .height = p[kHeight * kBlock],
          .inverse1 = p[kInverse1 * kBlock],
          .inverse2 = p[kInverse2 * kBlock],
          .r0 = p[kR0 * kBlock],
          .r1 = p[kR1 * kBlock],
          .r2 = p[kR2 * kBlock],
          .offset1 = 0,
          .offset2 = 0,
          .log0 = p[kLog0 * kBlock],
          .log1 = p[kLog1 * kBlock],
          .log2 = p[kLog2 * kBlock],
          .angled = 2 * absolute(p[kZ * kBlock]) * p[kHalfAngle * kBlock],
          .constant = 0,
          .linearU = 0,
          .linearV = 0};
  t.offset1 = offset1(t.x, t.y, t.apex, t.height, t.inverse1);
  t.offset2 = offset2(t.x, t.y, t.apex, t.height, t.inverse2);
  // The moments by the divergence theorem, one term an edge. [Wilton et al. 1984; Graglia 1993]
  t.constant = t.y * t.log0 + t.offset1 * t.log1 + t.offset2 * t.log2 - t.angled;
  const double rest = 1 - t.apex, x1 = t.x - 1, zz = t.z * t.z;
  const double start1 = (rest * x1 - t.height * t.y) * t.inverse1;  // along edge 1, from the foot to corner 1
  const double end2 = (t.apex * t.x + t.height * t.y) * t.inverse2;  // along edge 2, to corner 0
  const double edge0 = (t.y * t.y + zz) * t.log0 + t.x * t.r0 - x1 * t.r1;
  const double edge1 = ((t.offset1 * t.offset1 + zz) * t.log1 + start1 * (t.r2 - t.r1)) * t.inverse1 + t.r2;
  const double edge2 = ((t.offset2 * t.offset2 + zz) * t.log2 + end2 * (t.r0 - t.r2)) * t.inverse2 + t.r2;
  t.linearU = 0.5 * t.height * (edge1 - edge2);
  t.linearV = 0.5 * (rest * edge1 + t.apex * edge2 - edge0);
  return t;
}

// The rest of what the point sees of a triangle.
struct View {
  Vector middle0, middle1, middle2;     // of the edges, minus the point
  double inverse0, inverse1, inverse2;  // of their softened distances
  double weight, weightSlope;           // gradient of the weight = weightSlope * (sum of the middles)
};

POLESTAR_INTO_CLONES Vector middle(const double* p, std::size_t a, std::size_t b, const Vector& x) {
  // As the point charges' positions are rounded, so that close to one of them both cancel.
  return {0.5 * (p[a * kBlock] + p[b * kBlock]) - x.x,
          0.5 * (p[(a + 1) * kBlock] + p[(b + 1) * kBlock]) - x.y,
          0.5 * (p[(a + 2) * kBlock] + p[(b + 2) * kBlock]) - x.z};
}

POLESTAR_INTO_CLONES double inverseDistance(const Vector& offset, double squaredSoftening) {
  return 1 / __builtin_sqrt(dot(offset, offset) + squaredSoftening);
}

POLESTAR_INTO_CLONES View view(const double* p, const Vector& point, double squaredSoftening) {
  View s;
  s.middle0 = middle(p, 0, 3, point);
  s.middle1 = middle(p, 3, 6, point);
  s.middle2 = middle(p, 6, 0, point);
  s.inverse0 = inverseDistance(s.middle0, squaredSoftening);
  s.inverse1 = inverseDistance(s.middle1, squaredSoftening);
  s.inverse2 = inverseDistance(s.middle2, squaredSoftening);
  // Smooth step in the distance from the centroid, from 0 at the near radius to 1 at kBlendFrom of it.
  constexpr double kBlend = NearField::kBlendFrom, kSteep = 1 / (1 - kBlend);
  constexpr double kSlope = 2 * kSteep / (NearField::kNear * NearField::kNear);
  const double share = __builtin_sqrt(larger(p[kRatio * kBlock], kBlend * kBlend));
  const double step = (1 - share) * kSteep, scale = p[kInverseLength * kBlock];
  s.weight = step * step * (3 - 2 * step);
  s.weightSlope = kSlope * step * (1 - step) * scale * scale / share;
  return s;
}

POLESTAR_INTO_CLONES double lanePotential(const double* p, const Vector& point, double squaredSoftening) {
  const View s = view(p, point, squaredSoftening);
  const Terms t = integrals(p);
  const double length = p[kLength * kBlock];
  const double value = p[kValue * kBlock], slopeU = p[kSlopeU * kBlock], slopeV = p[kSlopeV * kBlock];
  const double exact =
      (value + slopeU * t.x + slopeV * t.y) * t.constant + slopeU * t.linearU + slopeV * t.linearV;
  const double atApex = slopeU * t.apex + slopeV * t.height;  // minus value
  const double charges = (value + 0.5 * slopeU) * s.inverse0 +
                         (value + 0.5 * (slopeU + atApex)) * s.inverse1 + (value + 0.5 * atApex) * s.inverse2;
  return s.weight * length * (exact - length * t.height / 6 * charges);
}

// result[k * kBlock]: coefficient of corner k.
POLESTAR_INTO_CLONES void laneRow(const double* p, const Vector& point, double squaredSoftening,
                                  double* result) {
  const View s = view(p, point, squaredSoftening);
  const Terms t = integrals(p);
  const double length = p[kLength * kBlock];
  // The hat functions of the corners: hat 2 is y/height, hat 1 is x - apex hat 2, and all sum to 1.
  const double hat2 = (t.y * t.constant + t.linearV) / t.height;
  const double hat1 = t.x * t.constant + t.linearU - t.apex * hat2;
  const double hat0 = t.constant - hat1 - hat2;
  const double charge = length * t.height / 12, scale = s.weight * length;
  result[0] = scale * (hat0 - charge * (s.inverse2 + s.inverse0));
  result[kBlock] = scale * (hat1 - charge * (s.inverse0 + s.inverse1));
  result[2 * kBlock] = scale * (hat2 - charge * (s.inverse1 + s.inverse2));
}

// Gradient of the exact potential, in the triangle's frame.
POLESTAR_INTO_CLONES Vector exactGradient(const Terms& t, double solidAngle, double valueAtFoot,
                                          double slopeU, double slopeV) {
  const double rest = 1 - t.apex;
  // Integral of the outward normals over |x - y| along the edges.
  const double normal1 = t.log1 * t.inverse1, normal2 = t.log2 * t.inverse2;
  const double edgeU = t.height * (normal1 - normal2), edgeV = rest * normal1 + t.apex * normal2 - t.log0;
  // Edge by edge, the slope along it times its share.
  const double along1 = (slopeV * t.height - slopeU * rest) * (t.inverse1 * t.inverse1);
  const double along2 = (slopeU * t.apex + slopeV * t.height) * (t.inverse2 * t.inverse2);
  const double tangential1 = along1 * t.offset1 * t.log1, across1 = along1 * (t.r2 - t.r1);
  const double tangential2 = along2 * t.offset2 * t.log2, across2 = along2 * (t.r2 - t.r0);
  // On the plane, up to rounding, the point counts as inside the solid.
  const double signedAngle = t.z > 1e-13 ? -solidAngle : solidAngle;
  return {slopeU * (t.y * t.log0 - t.angled) - valueAtFoot * edgeU - rest * tangential1 +
              t.apex * tangential2 - t.height * (across1 - across2),
          slopeU * (t.r1 - t.r0) - slopeV * t.angled - valueAtFoot * edgeV +
              t.height * (tangential1 + tangential2) - rest * across1 - t.apex * across2,
          valueAtFoot * signedAngle + t.z * (slopeU * edgeU + slopeV * edgeV)};
}

// result[k * kBlock]: potential and gradient.
POLESTAR_INTO_CLONES void lanePotentialAndGradient(const double* p, const Vector& point,
                                                   double squaredSoftening, double* result) {
  const View s = view(p, point, squaredSoftening);
  const Terms t = integrals(p);
  const double length = p[kLength * kBlock];
  const double value = p[kValue * kBlock], slopeU = p[kSlopeU * kBlock], slopeV = p[kSlopeV * kBlock];
  const double valueAtFoot = value + slopeU * t.x + slopeV * t.y;
  const double atApex = slopeU * t.apex + slopeV * t.height;  // minus value
  const double third = length * length * t.height / 6;
  const double charge0 = third * s.inverse0 * (value + 0.5 * slopeU);
  const double charge1 = third * s.inverse1 * (value + 0.5 * (slopeU + atApex));
  const double charge2 = third * s.inverse2 * (value + 0.5 * atApex);
  const double exact = valueAtFoot * t.constant + slopeU * t.linearU + slopeV * t.linearV;
  const double difference = length * exact - (charge0 + charge1 + charge2);

  const Vector u = axisU(p), v = axisV(p), normal = cross(u, v);
  const Vector g = exactGradient(t, 2 * p[kHalfAngle * kBlock], valueAtFoot, slopeU, slopeV);
  // Of the weight and of the charges: both along the middles.
  const double blend = s.weightSlope * difference;
  const double m0 = blend - s.weight * charge0 * s.inverse0 * s.inverse0;
  const double m1 = blend - s.weight * charge1 * s.inverse1 * s.inverse1;
  const double m2 = blend - s.weight * charge2 * s.inverse2 * s.inverse2;
  result[0] = s.weight * difference;
  result[kBlock] = s.weight * (g.x * u.x + g.y * v.x + g.z * normal.x) + m0 * s.middle0.x + m1 * s.middle1.x +
                   m2 * s.middle2.x;
  result[2 * kBlock] = s.weight * (g.x * u.y + g.y * v.y + g.z * normal.y) + m0 * s.middle0.y +
                       m1 * s.middle1.y + m2 * s.middle2.y;
  result[3 * kBlock] = s.weight * (g.x * u.z + g.y * v.z + g.z * normal.z) + m0 * s.middle0.z +
                       m1 * s.middle1.z + m2 * s.middle2.z;
}

// field[f * kBlock + i] = row[i][f] for f < width; width and count multiples of 4.
template <std::size_t width>
POLESTAR_INTO_CLONES void transpose(const double* const* row, std::size_t count, double* field) {
  using Quad __attribute__((vector_size(32), aligned(8), may_alias)) = double;
  for (std::size_t i = 0; i < count; i += 4) {
    for (std::size_t f = 0; f < width; f += 4) {
      const Quad a = *reinterpret_cast<const Quad*>(row[i] + f);
      const Quad b = *reinterpret_cast<const Quad*>(row[i + 1] + f);
      const Quad c = *reinterpret_cast<const Quad*>(row[i + 2] + f);
      const Quad d = *reinterpret_cast<const Quad*>(row[i + 3] + f);
      const Quad ab02 = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                 ab13 = __builtin_shufflevector(a, b, 1, 5, 3, 7);
      const Quad cd02 = __builtin_shufflevector(c, d, 0, 4, 2, 6),
                 cd13 = __builtin_shufflevector(c, d, 1, 5, 3, 7);
      double* to = field + f * kBlock + i;
      *reinterpret_cast<Quad*>(to) = __builtin_shufflevector(ab02, cd02, 0, 1, 4, 5);
      *reinterpret_cast<Quad*>(to + kBlock) = __builtin_shufflevector(ab13, cd13, 0, 1, 4, 5);
      *reinterpret_cast<Quad*>(to + 2 * kBlock) = __builtin_shufflevector(ab02, cd02, 2, 3, 6, 7);
      *reinterpret_cast<Quad*>(to + 3 * kBlock) = __builtin_shufflevector(ab13, cd13, 2, 3, 6, 7);
    }
  }
}

}  // namespace

POLESTAR_SIMD_CLONES
void layOutNear(const double* const* record, const double* const* density, std::size_t count,
                double* fields) {
  transpose<kNearRecord>(record, count, fields);
  if (density != nullptr) transpose<kNearDensity>(density, count, fields + kValue * kBlock);
}

POLESTAR_SIMD_CLONES
double sumNearPotential(double* fields, std::size_t count, const NearPoint& point, double squaredSoftening) {
  prepare(fields, count, point);
  double sum = 0;
#pragma omp simd reduction(+ : sum)
  for (std::size_t i = 0; i < count; ++i) sum += lanePotential(fields + i, point, squaredSoftening);
  return sum;
}

POLESTAR_SIMD_CLONES
void nearCoefficients(double* fields, std::size_t count, const NearPoint& point, double squaredSoftening,
                      double* coefficient) {
  prepare(fields, count, point);
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) laneRow(fields + i, point, squaredSoftening, coefficient + i);
}

POLESTAR_SIMD_CLONES
void sumNearPotentialAndGradient(double* fields, std::size_t count, const NearPoint& point,
                                 double squaredSoftening, double* result) {
  prepare(fields, count, point);
  alignas(64) double lane[4 * kBlock];
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    lanePotentialAndGradient(fields + i, point, squaredSoftening, lane + i);
  }
  for (std::size_t k = 0; k < 4; ++k) {
    double sum = 0;
#pragma omp simd reduction(+ : sum)
    for (std::size_t i = 0; i < count; ++i) sum += lane[k * kBlock + i];
    result[k] += sum;
  }
}

POLESTAR_SIMD_CLONES
void squaredDistanceRatios(const double* x, const double* y, const double* z,
                           const double* inverseSquaredRadius, std::size_t count, const NearPoint& point,
                           double* ratio) {
  const double px = point.x, py = point.y, pz = point.z;
#pragma omp simd
  for (std::size_t i = 0; i < count; ++i) {
    const double dx = px - x[i], dy = py - y[i], dz = pz - z[i];
    ratio[i] = (dx * dx + dy * dy + dz * dz) * inverseSquaredRadius[i];
  }
}

}  // namespace polestar::detail
