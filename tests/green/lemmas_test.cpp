// Lemmas 2 and 3 of [Xia 2010] on what is computed: in a star-shaped solid the pole is the only critical
// point of Green's function, and all its level sets are spheres. Counted on samples, without tolerances; the
// same counts have to find what other fields have more.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <span>

#include "green/level_topology.h"
#include "polestar/green/detail/inside_star.h"
#include "polestar/green/green_function.h"
#include "polestar/mesh/bodies.h"
#include "polestar/mesh/shapes.h"
#include "support/meshes.h"
#include "support/solids.h"

namespace polestar::testing {
namespace {

constexpr int kSteps = 22;  // from the pole to the farthest vertex

/// Coarser than by default: topology needs no more, and the finest layers take seconds.
GreenFunction solved(const StarShape& shape) {
  GreenOptions options;
  options.tolerance = 5e-3;
  return solveGreen(shape, options);
}

using Field = std::function<void(std::span<const Vec3>, std::span<double>, std::span<Vec3>)>;

Field fieldOf(const GreenFunction& green) {
  return [&](std::span<const Vec3> points, std::span<double> values, std::span<Vec3> gradients) {
    green.evaluate(points, values, gradients);
  };
}

Lattice sampled(const Field& field, const std::function<bool(const Vec3&)>& inside) {
  // Every point of the inner frame's solid lies within 1 of the pole.
  Lattice lattice = Lattice::aroundOrigin(1, kSteps);
  lattice.fill(inside, [&](std::span<const Vec3> points, std::span<double> values) {
    std::vector<Vec3> unused(points.size());
    field(points, values, unused);
  });
  return lattice;
}

Lattice sampled(const GreenFunction& green) {
  const detail::InsideStar inside(green.shape().mesh());
  return sampled(fieldOf(green), [&](const Vec3& p) { return p.isZero() || inside.contains(p); });
}

/// Sum of the indices of the gradient's zeros and poles inside a closed surface.
int gradientIndex(const Field& field, const TriMesh& surface) {
  std::vector<double> unused(surface.vertices.size());
  std::vector<Vec3> gradients(surface.vertices.size());
  field(surface.vertices, unused, gradients);
  return degreeOfField(gradients, surface.triangles);
}

TriMesh boxAt(const Vec3& center, double halfWidth) {
  return transformed(cube(8), [&](const Vec3& v) { return Vec3(center + halfWidth * v); });
}

/// Point charges: potentials of solids that are not star-shaped, such as a dumbbell's of two.
Field charges(std::vector<Vec3> places, double strength = 1) {
  return [places = std::move(places), strength](std::span<const Vec3> points, std::span<double> values,
                                                std::span<Vec3> gradients) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      values[i] = 0;
      gradients[i].setZero();
      for (const Vec3& place : places) {
        const Vec3 d = points[i] - place;
        values[i] += strength / d.norm();
        gradients[i] -= strength * d / std::pow(d.norm(), 3);
      }
    }
  };
}

bool inUnitBall(const Vec3& p) { return p.norm() < 1; }

/// Value of G on the level R.
double greenAt(const GreenFunction& green, double radius) {
  return (1 / radius - 1) / green.harmonicRadius();
}

class Lemmas : public ::testing::TestWithParam<std::string> {
 protected:
  static StarShape shapeOf(const std::string& name) {
    if (name == "star") return starShape(smoothStar(3));
    if (name == "pig") return starShape(coinPig(20));
    if (name == "lobes") return starShape(twelveLobes(10));
    return starShapeFromFile(*meshFolder() / name);
  }
};

TEST_P(Lemmas, LevelSetsAreSpheresAndThePoleIsTheOnlyCriticalPoint) {
  if (GetParam().find('.') != std::string::npos) POLESTAR_REQUIRE_MESHES();
  const GreenFunction green = solved(shapeOf(GetParam()));
  const Lattice lattice = sampled(green);

  for (const double radius : {0.03, 0.1, 0.2, 0.35, 0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95}) {
    const Lattice::LevelSurface surface = lattice.levelSurface(greenAt(green, radius));
    EXPECT_EQ(surface.components, 1u) << "R = " << radius;
    EXPECT_EQ(surface.eulerCharacteristic(), 2) << "R = " << radius;
  }

  const std::vector<Lattice::CriticalPoint> critical = lattice.criticalPoints();
  for (const auto& point : critical)
    EXPECT_TRUE(lattice.point(point.index).isZero()) << lattice.point(point.index).transpose();
  ASSERT_EQ(critical.size(), 1u);
  EXPECT_TRUE(critical[0].maximum());

  // The same by the gradient itself: around the pole, and around all of the solid but its rim; and nothing in
  // between, nor in boxes aside.
  for (const double share : {0.1, 0.6, 0.98}) {
    const TriMesh shrunk = transformed(green.shape().mesh(), [=](const Vec3& v) { return Vec3(share * v); });
    EXPECT_EQ(gradientIndex(fieldOf(green), shrunk), -1) << share;
  }
  const double reach = green.shape().report().centerMargin / green.shape().frame().unit;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 aside = 0.4 * reach * Vec3(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    EXPECT_EQ(gradientIndex(fieldOf(green), boxAt(aside, 0.1 * reach)), 0) << aside.transpose();
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, Lemmas,
                         ::testing::Values("star", "pig", "lobes", "castalia.obj", "max_smooth100.off"),
                         [](const auto& test) { return test.param.substr(0, test.param.find('.')); });

// What two poles make: a second maximum and a saddle between them, and level sets that fall in two above it.
TEST(LemmasFail, ForTwoPoles) {
  const Vec3 a(0.41, 0.07, -0.03), b(-0.38, 0.02, 0.05);
  const Field field = charges({a, b});
  const Lattice lattice = sampled(field, inUnitBall);
  std::map<long, int> indices;
  std::size_t saddle = 0;
  for (const Lattice::CriticalPoint& point : lattice.criticalPoints()) {
    ++indices[point.gradientIndex()];
    if (point.gradientIndex() == 1) saddle = point.index;
  }
  EXPECT_EQ(indices, (std::map<long, int>{{-1, 2}, {1, 1}}));
  EXPECT_LT((lattice.point(saddle) - 0.5 * (a + b)).norm(), 0.08);

  const double between = 4 / (a - b).norm();
  const Lattice::LevelSurface above = lattice.levelSurface(1.2 * between),
                              below = lattice.levelSurface(0.9 * between);
  EXPECT_EQ(above.components, 2u);
  EXPECT_EQ(above.eulerCharacteristic(), 4);
  EXPECT_EQ(below.components, 1u);
  EXPECT_EQ(below.eulerCharacteristic(), 2);

  EXPECT_EQ(gradientIndex(field, boxAt(a, 0.2)), -1);
  EXPECT_EQ(gradientIndex(field, boxAt(b, 0.2)), -1);
  EXPECT_EQ(gradientIndex(field, boxAt(0.5 * (a + b), 0.15)), 1);
  EXPECT_EQ(gradientIndex(field, boxAt(Vec3::Zero(), 0.9)), -1);
}

// A ring of poles has level sets that are tori, of Euler characteristic 0, until the hole closes at a
// critical point of index -1 in its middle.
TEST(LemmasFail, ForARingOfPoles) {
  std::vector<Vec3> ring;
  for (int i = 0; i < 40; ++i) {
    const double angle = 2 * std::numbers::pi * i / 40;
    ring.emplace_back(0.5 * std::cos(angle), 0.5 * std::sin(angle), 0.013);
  }
  const Field field = charges(ring, 1.0 / 40);
  const Lattice lattice = sampled(field, inUnitBall);
  const double middle = 2;  // 40 charges of 1/40 at a distance of 1/2
  const Lattice::LevelSurface torus = lattice.levelSurface(1.2 * middle),
                              closed = lattice.levelSurface(0.8 * middle);
  EXPECT_EQ(torus.components, 1u);
  EXPECT_EQ(torus.eulerCharacteristic(), 0);
  EXPECT_EQ(closed.components, 1u);
  EXPECT_EQ(closed.eulerCharacteristic(), 2);
}

// A bump on a good field, about as high as the field is there: a maximum more, and a saddle.
TEST(LemmasFail, ForABump) {
  const GreenFunction green = solved(starShape(smoothStar(3)));
  const Vec3 place(0.35, 0.1, -0.2);
  const Field field = [&](std::span<const Vec3> points, std::span<double> values, std::span<Vec3> gradients) {
    green.evaluate(points, values, gradients);
    for (std::size_t i = 0; i < points.size(); ++i)
      values[i] += 1.2 * std::exp(-(points[i] - place).squaredNorm() / 0.012);
  };
  const detail::InsideStar inside(green.shape().mesh());
  const Lattice lattice = sampled(field, [&](const Vec3& p) { return p.isZero() || inside.contains(p); });
  std::map<bool, int> maxima;
  long sum = 0;
  for (const Lattice::CriticalPoint& point : lattice.criticalPoints()) {
    ++maxima[point.maximum()];
    sum += point.gradientIndex();
  }
  EXPECT_EQ(maxima, (std::map<bool, int>{{true, 2}, {false, 1}}));
  EXPECT_EQ(sum, -1);
}

}  // namespace
}  // namespace polestar::testing
