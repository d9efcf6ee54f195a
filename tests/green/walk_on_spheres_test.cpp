// h from random walks: no equation, no integral, no code of the solver. From x, walk to a random point of the
// largest sphere around x inside the solid, again and again, until the surface is reached: the mean of
// -1/|exit| over walks is h(x). [Muller 1956]
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "polestar/core/detail/parallel.h"
#include "polestar/green/green_function.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/detail/triangle_tree.h"
#include "support/solids.h"

namespace polestar {
namespace {

using testing::pointsInside;
using testing::starShape;

constexpr std::size_t kWalks = 10000, kPoints = 4, kBatch = 500;
constexpr double kReached = 1e-5;  // of the surface; what remains of G there is below the statistics by far

struct Estimate {
  double mean = 0, standardError = 0;
};

Vec3 randomDirection(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double z = uniform(random), angle = std::numbers::pi * uniform(random), r = std::sqrt(1 - z * z);
  return {r * std::cos(angle), r * std::sin(angle), z};
}

/// h at `start`. The same for any number of threads: a generator belongs to a batch of walks.
Estimate walk(const detail::TriangleTree& surface, const Vec3& start, unsigned seed) {
  std::vector<double> exits(kWalks);
  detail::parallelChunks(kWalks, kBatch, [&](std::size_t begin, std::size_t end) {
    std::seed_seq sequence{seed, static_cast<unsigned>(begin)};
    std::mt19937_64 random(sequence);
    for (std::size_t i = begin; i < end; ++i) {
      Vec3 x = start;
      for (double bound = 10;;) {
        const double radius = surface.distance(x, bound);
        if (radius < kReached) break;
        x += radius * randomDirection(random);
        bound = 2 * radius;  // the point that touched the last sphere is no farther
      }
      exits[i] = -1 / x.norm();
    }
  });
  Estimate estimate;
  for (const double exit : exits) estimate.mean += exit / kWalks;
  for (const double exit : exits) estimate.standardError += std::pow(exit - estimate.mean, 2);
  estimate.standardError = std::sqrt(estimate.standardError) / kWalks;
  return estimate;
}

/// The shape's walks, made once for all Green's functions that are held against them.
class Walks {
 public:
  explicit Walks(const StarShape& shape) : points_(pointsInside(shape, kPoints, 7)) {
    const detail::TriangleTree surface(shape.mesh());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      points_[i] = shape.frame().toInner(points_[i]);
      estimates_.push_back(walk(surface, points_[i], static_cast<unsigned>(i)));
    }
  }

  /// Largest |h - mean| over what statistics and the boundary error, by the maximum principle, allow.
  double worstExcess(const std::vector<double>& h, double allowance) const {
    double worst = 0;
    for (std::size_t i = 0; i < h.size(); ++i) {
      worst = std::max(worst,
                       std::abs(h[i] - estimates_[i].mean) / (4 * estimates_[i].standardError + allowance));
    }
    return worst;
  }
  const std::vector<Vec3>& points() const { return points_; }

 private:
  std::vector<Vec3> points_;
  std::vector<Estimate> estimates_;
};

std::vector<double> harmonicPart(const GreenFunction& green, const std::vector<Vec3>& points) {
  std::vector<double> h(points.size());
  std::vector<Vec3> gradient(points.size());
  green.field().evaluate(points, h, gradient);
  return h;
}

void expectAgreement(const StarShape& shape, const GreenOptions& options = {}) {
  const Walks walks(shape);
  const GreenFunction green = solveGreen(shape, options);
  const double allowance = green.boundaryError().max / green.harmonicRadius();
  std::vector<double> h = harmonicPart(green, walks.points());
  EXPECT_LT(walks.worstExcess(h, allowance), 1);
  // What must be refused: a density two percent too large.
  for (double& value : h) value *= 1.02;
  EXPECT_GT(walks.worstExcess(h, allowance), 1);
}

TEST(WalkOnSpheres, AgreesOnACubeWithItsPoleOffTheCenter) {
  expectAgreement(starShape(cube(12), Vec3(0.2, 0.1, -0.15)));
}

TEST(WalkOnSpheres, AgreesOnAnAsteroid) { expectAgreement(starShape(asteroid(14))); }

TEST(WalkOnSpheres, AgreesOnAHead) { expectAgreement(starShape(stylizedHead(14))); }

TEST(WalkOnSpheres, AgreesWithCharges) {
  GreenOptions options;
  options.solver = GreenSolver::mfs;
  expectAgreement(starShape(geodesicSphere(14), Vec3(0.3, 0.2, -0.1)), options);
}

TEST(WalkOnSpheres, RefusesAPoleElsewhere) {
  const StarShape shape = starShape(asteroid(10), Vec3(0, 0, 0));
  const Walks walks(shape);
  // The same solid in the same frame, its Green's function about another pole.
  const Vec3 pole(0.02, 0, 0);
  const StarShape other = starShape(shape.surface().mesh(), pole);
  const GreenFunction green = solveGreen(other);
  std::vector<Vec3> points = walks.points();
  for (Vec3& p : points) p = other.frame().toInner(shape.frame().toWorld(p));
  std::vector<double> h = harmonicPart(green, points);
  for (double& value : h) value *= shape.frame().unit / other.frame().unit;
  EXPECT_GT(walks.worstExcess(h, green.boundaryError().max / green.harmonicRadius()), 1);
}

}  // namespace
}  // namespace polestar
