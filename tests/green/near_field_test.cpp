#include "polestar/green/detail/near_field.h"

#include <gtest/gtest.h>

#include <numbers>
#include <numeric>
#include <ostream>
#include <random>

#include "polestar/green/detail/point_charges.h"

namespace polestar::detail {
namespace {

using Corners = std::array<Vec3, 3>;
constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// The oracle: the triangle cut towards x until every piece is further away than its diameter, and a product
// Gauss rule of 2 x 14 points on the pieces, in long double. All terms of a potential are positive: nothing
// cancels.
using Real = long double;
using RealVec = Eigen::Matrix<Real, 3, 1>;
struct Reference {
  std::array<Real, 3> hat{};          // integrals of the hat functions over |x - y|
  std::array<RealVec, 3> gradient{};  // of those
  Real potential = 0;                 // of density 1
  Real field = 0;                     // integral of 1/|x - y|^2: the scale of a gradient
};

struct GaussRule {
  static constexpr int kPoints = 14;
  std::array<Real, kPoints> x, weight;  // on [0, 1]
  GaussRule() {
    for (int i = 0; i < kPoints; ++i) {
      Real z = std::cos(std::numbers::pi_v<Real> * (i + 0.75L) / (kPoints + 0.5L)), slope = 1;
      for (int step = 0; step < 30; ++step) {  // Newton's method on the Legendre polynomial
        Real value = 1, before = 0;
        for (int j = 0; j < kPoints; ++j) {
          before = std::exchange(value, ((2 * j + 1) * z * value - j * before) / (j + 1));
        }
        slope = kPoints * (z * value - before) / (z * z - 1);
        z -= value / slope;
      }
      x[i] = (1 - z) / 2;
      weight[i] = 1 / ((1 - z * z) * slope * slope);
    }
  }
};

Real distanceToTriangle(const RealVec& x, const std::array<RealVec, 3>& c) {
  const RealVec normal = (c[1] - c[0]).cross(c[2] - c[0]);
  Real toEdges = std::numeric_limits<Real>::max();
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    const RealVec edge = c[(k + 1) % 3] - c[k], offset = x - c[k];
    if (normal.dot(edge.cross(offset)) < 0) inside = false;
    const Real along = std::clamp<Real>(edge.dot(offset) / edge.squaredNorm(), 0, 1);
    toEdges = std::min(toEdges, (offset - along * edge).norm());
  }
  return inside ? std::abs(normal.dot(x - c[0])) / normal.norm() : toEdges;
}

// `hats`: the hat functions at the corners. A piece that is still too close after `cuts` is too small to
// count.
void addPiece(const std::array<RealVec, 3>& c, const std::array<RealVec, 3>& hats, const RealVec& x,
              Real twiceArea, int cuts, Reference& sum) {
  static const GaussRule rule;
  int longest = 0;
  std::array<Real, 3> length;
  for (int k = 0; k < 3; ++k) {
    length[k] = (c[(k + 1) % 3] - c[k]).norm();
    if (length[k] > length[longest]) longest = k;
  }
  if (distanceToTriangle(x, c) < length[longest]) {
    if (cuts == 0) return;
    const int a = longest, b = (a + 1) % 3, apex = (a + 2) % 3;
    const RealVec middle = (c[a] + c[b]) / 2, hatsThere = (hats[a] + hats[b]) / 2;
    addPiece({c[a], middle, c[apex]}, {hats[a], hatsThere, hats[apex]}, x, twiceArea / 2, cuts - 1, sum);
    addPiece({middle, c[b], c[apex]}, {hatsThere, hats[b], hats[apex]}, x, twiceArea / 2, cuts - 1, sum);
    return;
  }
  for (int i = 0; i < GaussRule::kPoints; ++i) {
    for (int j = 0; j < GaussRule::kPoints; ++j) {
      const Real s = rule.x[i], t = rule.x[j] * (1 - s);
      const Real weight = rule.weight[i] * rule.weight[j] * (1 - s) * twiceArea;
      const RealVec offset = c[0] + s * (c[1] - c[0]) + t * (c[2] - c[0]) - x;
      const RealVec hat = hats[0] + s * (hats[1] - hats[0]) + t * (hats[2] - hats[0]);
      const Real r = offset.norm();
      for (int k = 0; k < 3; ++k) {
        sum.hat[k] += weight * hat[k] / r;
        sum.gradient[k] += weight * hat[k] / (r * r * r) * offset;
      }
      sum.potential += weight / r;
      sum.field += weight / (r * r);
    }
  }
}

Reference byQuadrature(const Corners& corner, const Vec3& x) {
  constexpr int kCuts = 120;
  const std::array<RealVec, 3> c{corner[0].cast<Real>(), corner[1].cast<Real>(), corner[2].cast<Real>()};
  Reference sum;
  for (RealVec& g : sum.gradient) g.setZero();
  addPiece(c, {RealVec::Unit(0), RealVec::Unit(1), RealVec::Unit(2)}, x.cast<Real>(),
           (c[1] - c[0]).cross(c[2] - c[0]).norm(), kCuts, sum);
  return sum;
}

// One triangle and what NearField says of it, with the charges that it takes away added again. The softening
// is so large that they are smooth.
class Single {
 public:
  explicit Single(const Corners& corner)
      : corner_(corner), field_({{corner[0], corner[1], corner[2]}, {{0, 1, 2}}}, kSquaredSoftening) {}

  struct Value {
    double potential;
    Vec3 gradient;
  };
  /// The exact potential, where its weight is 1.
  Value exact(const std::array<double, 3>& sigma, const Vec3& x) const {
    EXPECT_LE((x - field_.nearSphere(0).center).norm(), NearField::kBlendFrom * field_.nearSphere(0).radius);
    Value result = correction(sigma, x);
    const Value ofCharges = charges(sigma, x);
    return {result.potential + ofCharges.potential, result.gradient + ofCharges.gradient};
  }
  Value correction(const std::array<double, 3>& sigma, const Vec3& x) const {
    Value result{0, Vec3::Zero()};
    field_.addPotentialAndGradient(x, candidates(), field_.density(sigma), result.potential, result.gradient);
    return result;
  }
  Value charges(const std::array<double, 3>& sigma, const Vec3& x) const {
    Value result{0, Vec3::Zero()};
    for (int k = 0; k < 3; ++k) {
      const int next = (k + 1) % 3;
      const Vec3 offset = x - 0.5 * (corner_[k] + corner_[next]);
      const double inverse = 1 / std::sqrt(offset.squaredNorm() + kSquaredSoftening);
      const double term = field_.area(0) / 6 * (sigma[k] + sigma[next]) * inverse;
      result.potential += term;
      result.gradient -= term * inverse * inverse * offset;
    }
    return result;
  }
  /// Potentials of the hat functions.
  std::array<double, 3> hats(const Vec3& x) const {
    std::vector<NearField::Row> rows;
    field_.appendRows(x, candidates(), rows);
    std::array<double, 3> result = rows.at(0).coefficient;
    for (int k = 0; k < 3; ++k) {
      std::array<double, 3> sigma{};
      sigma[k] = 1;
      result[k] += charges(sigma, x).potential;
    }
    return result;
  }
  double potential(const std::array<double, 3>& sigma, const Vec3& x) const {
    return field_.potential(x, candidates(), field_.density(sigma)) + charges(sigma, x).potential;
  }
  Vec3 normal() const { return (corner_[1] - corner_[0]).cross(corner_[2] - corner_[0]).normalized(); }
  const NearField& field() const { return field_; }
  NearCandidates candidates() const {
    constexpr std::uint32_t kOnly = 0;
    return {field_, {&kOnly, 1}};
  }

 private:
  static constexpr double kSquaredSoftening = 9;
  Corners corner_;
  NearField field_;
};

// Corner 0 and 1 a unit apart, corner 2 at (apex, height), moved and turned, any corner first.
Corners triangle(double apex, double height, std::mt19937& random) {
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  const Vec3 u = vector().normalized(), v = u.cross(vector()).normalized(), origin = 0.3 * vector();
  Corners corner{origin, origin + u, origin + apex * u + height * v};
  std::rotate(corner.begin(), corner.begin() + random() % 3, corner.end());
  return corner;
}

struct Shape {
  const char* name;
  double apex, height;
};
struct Place {
  const char* name;
  double along, across;  // of the point below or above: barycentric-like, from corner 0 along the edges
  double distance;       // from there
  bool alongNormal;      // or in a random direction
};
std::ostream& operator<<(std::ostream& stream, const Shape& shape) { return stream << shape.name; }
std::ostream& operator<<(std::ostream& stream, const Place& place) { return stream << place.name; }

constexpr Shape kShapes[] = {
    {"regular", 0.4, 0.7}, {"sliver", 0.9, 0.03}, {"needle", 0.9999, 1e-3}, {"cap", 0.45, 1e-3}};
constexpr Place kPlaces[] = {{"far", 0.3, 0.3, 1.3, false},
                             {"near", 0.3, 0.3, 0.4, false},
                             {"nearer", 0.2, 0.5, 1e-2, false},
                             {"close", 0.2, 0.5, 1e-3, false},
                             {"sheet above", 0.4, 0.3, 1e-6, true},
                             {"sheet below", 0.2, 0.3, -1e-6, true},
                             {"on the triangle", 0.3, 0.45, 0, false},
                             {"on an edge", 0.3, 0, 0, false},
                             {"on the longest line, beyond", 1.3, 0, 0, false},
                             {"in the plane, outside", -0.3, 0.4, 0, false},
                             {"close to an edge", 0.4, 0, 1e-6, false},
                             {"close to a corner", 0, 0, 1e-6, false},
                             {"on a corner", 1, 0, 0, false}};

class ClosedForms : public ::testing::TestWithParam<std::tuple<Shape, Place>> {};

TEST_P(ClosedForms, AgreeWithQuadrature) {
  const auto& [shape, place] = GetParam();
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 3; ++i) {
    const Corners c = triangle(shape.apex, shape.height, random);
    const Single single(c);
    const Vec3 direction = place.alongNormal
                               ? single.normal()
                               : Vec3(normal(random), normal(random), normal(random)).normalized();
    const Vec3 x =
        c[0] + place.along * (c[1] - c[0]) + place.across * (c[2] - c[0]) + place.distance * direction;
    const Reference truth = byQuadrature(c, x);

    // One hat function alone loses the square of the aspect (see NearField), their sum only the aspect.
    // Rounding the point moves the potential by epsilon times its gradient, which is 2 log(1/epsilon) on an
    // edge.
    const double aspect = 1 / shape.height, scale = static_cast<double>(truth.potential);
    const double rounding = 72 * kEpsilon, tolerance = rounding + 40 * kEpsilon * aspect * scale;
    const std::array<double, 3> hats = single.hats(x);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(hats[k], static_cast<double>(truth.hat[k]),
                  rounding + 40 * kEpsilon * aspect * aspect * scale);
    }
    EXPECT_NEAR(hats[0] + hats[1] + hats[2], scale, tolerance);
    EXPECT_NEAR(single.potential({1, 1, 1}, x), scale, tolerance);

    // Gradients: likewise, with second derivatives of 1/distance at edges.
    const double toTriangle = static_cast<double>(
        distanceToTriangle(x.cast<Real>(), {c[0].cast<Real>(), c[1].cast<Real>(), c[2].cast<Real>()}));
    if (toTriangle < 1e-12) continue;
    const double field = static_cast<double>(truth.field);
    RealVec sum = RealVec::Zero();
    for (int k = 0; k < 3; ++k) {
      std::array<double, 3> sigma{};
      sigma[k] = 1;
      EXPECT_LT((single.exact(sigma, x).gradient.cast<Real>() - truth.gradient[k]).norm(),
                40 * kEpsilon * (aspect * aspect * field + 1 / toTriangle));
      sum += truth.gradient[k];
    }
    EXPECT_LT((single.exact({1, 1, 1}, x).gradient.cast<Real>() - sum).norm(),
              40 * kEpsilon * (aspect * field + 1 / toTriangle));
  }
}

std::string nameOf(const ::testing::TestParamInfo<std::tuple<Shape, Place>>& info) {
  std::string name = std::string(std::get<0>(info.param).name) + "_" + std::get<1>(info.param).name;
  std::erase(name, ',');
  std::replace(name.begin(), name.end(), ' ', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(All, ClosedForms,
                         ::testing::Combine(::testing::ValuesIn(kShapes), ::testing::ValuesIn(kPlaces)),
                         nameOf);

class NearFieldOfOne : public ::testing::Test {
 protected:
  const Corners corner_{Vec3(0.1, -0.2, 0.3), Vec3(1.2, 0.1, 0.2), Vec3(0.3, 0.9, -0.1)};
  const std::array<double, 3> sigma_{-0.7, 0.4, 1.3};
  const Single single_{corner_};
};

TEST_F(NearFieldOfOne, ThreeMethodsAgree) {
  for (const Vec3& x : {Vec3(0.5, 0.3, 1.0), Vec3(0.5, 0.3, 0.12), Vec3(1.5, 1.2, 1)}) {
    const std::array<double, 3> hats = single_.hats(x);
    const double potential = single_.potential(sigma_, x);
    EXPECT_NEAR(hats[0] * sigma_[0] + hats[1] * sigma_[1] + hats[2] * sigma_[2], potential, 1e-14);
    EXPECT_NEAR(single_.exact(sigma_, x).potential, potential, 1e-14);
  }
}

TEST_F(NearFieldOfOne, NormalDerivativeJumpsByFourPiSigma) {
  const Vec3 q = 0.3 * corner_[0] + 0.3 * corner_[1] + 0.4 * corner_[2], normal = single_.normal();
  const double sigma = 0.3 * sigma_[0] + 0.3 * sigma_[1] + 0.4 * sigma_[2];
  const Vec3 inside = single_.exact(sigma_, q - 1e-9 * normal).gradient;
  const Vec3 outside = single_.exact(sigma_, q + 1e-9 * normal).gradient;
  EXPECT_NEAR((inside - outside).dot(normal), 4 * std::numbers::pi * sigma, 1e-7);
  EXPECT_LT((inside - outside).cross(normal).norm(), 1e-7);
  // On the triangle the limit from inside is meant.
  EXPECT_LT((single_.exact(sigma_, q).gradient - inside).norm(), 1e-7);
}

TEST_F(NearFieldOfOne, FiniteAndContinuousAtEdgesAndCorners) {
  for (const Vec3& x : {corner_[0], corner_[1], corner_[2], Vec3(0.5 * (corner_[0] + corner_[1])),
                        Vec3(0.25 * corner_[1] + 0.75 * corner_[2])}) {
    const Single::Value at = single_.exact(sigma_, x);
    EXPECT_TRUE(std::isfinite(at.potential) && at.gradient.allFinite());
    EXPECT_LT(at.gradient.norm(), 1e3);
    EXPECT_NEAR(at.potential, single_.exact(sigma_, x + Vec3(1e-9, 2e-9, -1e-9)).potential, 1e-6);
  }
}

TEST_F(NearFieldOfOne, GradientIsTheDerivativeInTheBlendToo) {
  constexpr double kStep = 1e-5;
  const NearField::Sphere sphere = single_.field().nearSphere(0);
  const Vec3 direction = Vec3(2, -1, 3).normalized();
  for (const double share : {0.2, 0.6, 0.745, 0.755, 0.8, 0.9, 0.99, 0.9999}) {
    const Vec3 x = sphere.center + share * sphere.radius * direction;
    const Vec3 gradient = single_.correction(sigma_, x).gradient;
    for (int k = 0; k < 3; ++k) {
      const Vec3 offset = kStep * Vec3::Unit(k);
      const double difference = (single_.correction(sigma_, x + offset).potential -
                                 single_.correction(sigma_, x - offset).potential) /
                                (2 * kStep);
      EXPECT_NEAR(gradient[k], difference, 1e-9) << "at " << share;
    }
  }
}

TEST_F(NearFieldOfOne, WeightFallsSmoothlyToZero) {
  const NearField::Sphere sphere = single_.field().nearSphere(0);
  for (const double share : {0.8, 0.875, 0.95}) {
    const Vec3 x = sphere.center + share * sphere.radius * Vec3(1, 2, -2) / 3;
    const Reference truth = byQuadrature(corner_, x);
    const double exact =
        static_cast<double>(truth.hat[0] * sigma_[0] + truth.hat[1] * sigma_[1] + truth.hat[2] * sigma_[2]);
    const double s = (1 - share) / (1 - NearField::kBlendFrom);
    EXPECT_NEAR(single_.correction(sigma_, x).potential,
                s * s * (3 - 2 * s) * (exact - single_.charges(sigma_, x).potential), 1e-14);
  }
  for (const double share : {1.0001, 1.5, 40.0}) {
    const Vec3 x = sphere.center + share * sphere.radius * Vec3(1, 2, -2) / 3;
    EXPECT_EQ(single_.correction(sigma_, x).potential, 0);
    EXPECT_EQ(single_.correction(sigma_, x).gradient, Vec3::Zero());
  }
}

TEST_F(NearFieldOfOne, EverythingScalesWithTheTriangle) {
  constexpr double kScale = 1e-7;
  const Single small({kScale * corner_[0], kScale * corner_[1], kScale * corner_[2]});
  for (const Vec3& x :
       {Vec3(0.5, 0.3, 1.0), Vec3(0.5, 0.3, 0.12), Vec3(corner_[0]), Vec3(0.5 * (corner_[1] + corner_[2]))}) {
    EXPECT_NEAR(small.potential(sigma_, kScale * x) / kScale, single_.potential(sigma_, x), 1e-13);
  }
}

// A wavy sheet of unequal triangles.
TriMesh sheet(int cells) {
  TriMesh mesh;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> jitter(-0.3, 0.3);
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i) {
      mesh.vertices.emplace_back((i + jitter(random)) / cells, (j + jitter(random)) / cells,
                                 jitter(random) / cells);
    }
  }
  const auto index = [cells](int i, int j) { return j * (cells + 1) + i; };
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      mesh.triangles.push_back({index(i, j), index(i + 1, j), index(i + 1, j + 1)});
      mesh.triangles.push_back({index(i, j), index(i + 1, j + 1), index(i, j + 1)});
    }
  }
  return mesh;
}

class NearFieldOfSheet : public ::testing::Test {
 protected:
  static constexpr double kSquaredSoftening = 1e-14;
  NearFieldOfSheet() {
    std::mt19937 random(9);
    std::uniform_real_distribution<double> value(0.5, 1.5);
    for (double& s : sigma_) s = value(random);
    for (int i = 0; i < 20; ++i)
      points_.emplace_back(value(random) - 0.5, value(random) - 0.5, 0.05 * (value(random) - 1));
    std::iota(all_.begin(), all_.end(), 0);
  }
  const TriMesh mesh_ = sheet(24);  // more triangles than the candidates' test takes in one go
  const NearField field_{mesh_, kSquaredSoftening};
  std::vector<double> sigma_ = std::vector<double>(mesh_.vertices.size());
  std::vector<Vec3> points_;
  std::vector<std::uint32_t> all_ = std::vector<std::uint32_t>(mesh_.triangles.size());
};

TEST_F(NearFieldOfSheet, IsTheSumOfItsTriangles) {
  const NearField::Density density = field_.density(sigma_);
  const NearCandidates candidates(field_, all_);
  for (const Vec3& x : points_) {
    double potential = 7, sum = 0, ofRows = 0;
    Vec3 gradient(1, 2, 3), gradientSum = Vec3::Zero();
    field_.addPotentialAndGradient(x, candidates, density, potential, gradient);
    for (const std::uint32_t t : all_)
      field_.addPotentialAndGradient(x, {field_, {&t, 1}}, density, sum, gradientSum);
    EXPECT_NEAR(potential - 7, sum, 1e-13);
    EXPECT_LT((gradient - Vec3(1, 2, 3) - gradientSum).norm(), 1e-11);
    EXPECT_NEAR(field_.potential(x, candidates, density), sum, 1e-13);
    std::vector<NearField::Row> rows;
    field_.appendRows(x, candidates, rows);
    for (const NearField::Row& row : rows) {
      for (int k = 0; k < 3; ++k) ofRows += row.coefficient[k] * sigma_[mesh_.triangles[row.triangle][k]];
    }
    EXPECT_NEAR(ofRows, sum, 1e-13);
  }
}

TEST_F(NearFieldOfSheet, SameBytesForAnySuperset) {
  const NearField::Density density = field_.density(sigma_);
  const NearCandidates candidates(field_, all_);
  for (const Vec3& x : points_) {
    std::vector<std::uint32_t> near;
    for (const std::uint32_t t : all_) {
      const NearField::Sphere sphere = field_.nearSphere(t);
      if ((x - sphere.center).norm() < 1.001 * sphere.radius) near.push_back(t);
    }
    ASSERT_LT(near.size(), all_.size() / 2);
    double a = 0, b = 0;
    Vec3 ga = Vec3::Zero(), gb = Vec3::Zero();
    field_.addPotentialAndGradient(x, candidates, density, a, ga);
    field_.addPotentialAndGradient(x, {field_, near}, density, b, gb);
    EXPECT_EQ(a, b);
    EXPECT_EQ(ga, gb);
    EXPECT_EQ(field_.potential(x, candidates, density), field_.potential(x, {field_, near}, density));
  }
}

TEST_F(NearFieldOfSheet, TakesAwayTheChargesEvenUnderThePoint) {
  // On a charge's own position the sum of both is the layer's potential, continuous there.
  const std::uint32_t t = 600;
  PointCharges charges;
  charges.squaredSoftening = kSquaredSoftening;
  for (int k = 0; k < 3; ++k) {
    const Vec3 m = 0.5 * (mesh_.corner(t, k) + mesh_.corner(t, (k + 1) % 3));
    charges.x.push_back(m[0]);
    charges.y.push_back(m[1]);
    charges.z.push_back(m[2]);
    charges.charge.push_back(field_.area(t) / 6 *
                             (sigma_[mesh_.triangles[t][k]] + sigma_[mesh_.triangles[t][(k + 1) % 3]]));
  }
  const auto total = [&](const Vec3& x) {
    double potential = 0;
    sumPotential(charges, {&x, 1}, {&potential, 1});
    return potential + field_.potential(x, {field_, {&t, 1}}, field_.density(sigma_));
  };
  const Vec3 middle(charges.x[1], charges.y[1], charges.z[1]);
  const double size = std::sqrt(field_.area(t)), scale = total(middle + size * Vec3::UnitZ());
  EXPECT_NEAR(total(middle), total(middle + 1e-9 * size * Vec3::UnitZ()), 1e-7 * scale);
}

TEST(NearField, NeedleIsARod) {
  // 1 : 1e5. The potential of a needle is that of a rod with linear density.
  const Single needle({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1e-5, 0)});
  const Vec3 x(0.4, 0.7, 0.3);
  const double d2 = x[1] * x[1] + x[2] * x[2];
  const double a = std::sqrt(x[0] * x[0] + d2), b = std::sqrt((1 - x[0]) * (1 - x[0]) + d2);
  const double log = std::asinh((1 - x[0]) / std::sqrt(d2)) + std::asinh(x[0] / std::sqrt(d2));
  const double rod = 1e-5 * ((1 - x[0]) * log - (b - a));  // integral of 1e-5 (1 - s)/|x - s|
  EXPECT_NEAR(needle.potential({1, 1, 1}, x) / rod, 1, 2e-5);
}

TEST(NearField, NoCandidatesNoCorrection) {
  const Single single({Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)});
  EXPECT_EQ(single.field().potential(Vec3(0.1, 0.1, 0.1), NearCandidates(),
                                     single.field().density(std::array{1.0, 1.0, 1.0})),
            0);
}

}  // namespace
}  // namespace polestar::detail
