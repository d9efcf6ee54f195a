#include "polestar/sphere/detail/shifted_laplacian.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "polestar/core/error.h"
#include "polestar/mesh/shapes.h"
#include "polestar/sphere/detail/nested_dissection.h"
#include "support.h"

namespace polestar {
namespace {

using detail::Laplacian;
using detail::ShiftedLaplacian;

TEST(NestedDissection, OrdersEveryVertexOnceAndSeparates) {
  const TriMesh mesh = testing::withNeedles(smoothStar(4), 50, 1e-3, 2);
  const Laplacian graph = detail::intrinsicDelaunayLaplacian(mesh);
  const std::vector<std::int32_t> order = detail::nestedDissection(graph, mesh.vertices).order;
  std::vector<std::int32_t> sorted = order;
  std::sort(sorted.begin(), sorted.end());
  for (std::size_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], static_cast<std::int32_t>(i));
  ASSERT_EQ(order.size(), mesh.vertices.size());

  // Without the vertices eliminated last, the graph falls into pieces of at most half its size.
  const std::size_t kept = order.size() - 4 * static_cast<std::size_t>(std::sqrt(order.size()));
  std::vector<char> alive(order.size(), 0);
  for (std::size_t i = 0; i < kept; ++i) alive[order[i]] = 1;
  std::size_t largest = 0;
  for (const std::int32_t seed : order) {
    if (!alive[seed]) continue;
    std::vector<std::int32_t> stack{seed};
    std::size_t size = 0;
    for (alive[seed] = 0; !stack.empty(); ++size) {
      const std::int32_t v = stack.back();
      stack.pop_back();
      for (std::size_t e = graph.rowStart[v]; e < graph.rowStart[v + 1]; ++e) {
        if (alive[graph.column[e]]) alive[graph.column[e]] = 0, stack.push_back(graph.column[e]);
      }
    }
    largest = std::max(largest, size);
  }
  EXPECT_LE(largest, (order.size() + 1) / 2);
}

TEST(ShiftedLaplacian, SolvesTheSystem) {
  const TriMesh mesh = smoothStar(3);
  const Laplacian laplacian = detail::intrinsicDelaunayLaplacian(mesh);
  const std::vector<double> shift = detail::vertexAreaShares(mesh);
  const ShiftedLaplacian solver(laplacian, shift, mesh.vertices);
  std::vector<Vec3> right, x(mesh.vertices.size());
  for (const Vec3& v : mesh.vertices) right.push_back(Vec3(v[0], std::sin(5 * v[1]), 1));
  solver.solve(right, x);
  for (std::size_t i = 0; i < x.size(); ++i) {
    Vec3 product = shift[i] * x[i];
    for (std::size_t e = laplacian.rowStart[i]; e < laplacian.rowStart[i + 1]; ++e) {
      product += laplacian.weight[e] * (x[i] - x[laplacian.column[e]]);
    }
    EXPECT_LT((product - right[i]).norm(), 1e-9);
  }
}

TEST(ShiftedLaplacian, RefusesAMatrixThatIsNotPositiveDefinite) {
  const TriMesh mesh = icosphere(1);
  const Laplacian laplacian = detail::intrinsicDelaunayLaplacian(mesh);
  const std::vector<double> shift(mesh.vertices.size(), -1.0);
  EXPECT_THROW(ShiftedLaplacian(laplacian, shift, mesh.vertices), Error);
}

}  // namespace
}  // namespace polestar
