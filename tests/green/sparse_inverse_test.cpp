#include "polestar/green/detail/sparse_inverse.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <cmath>
#include <numbers>
#include <random>

#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/mesh/shapes.h"

namespace polestar::detail {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd areasOf(const TriMesh& mesh) {
  const std::vector<double> area = vertexAreas(mesh);
  return Eigen::Map<const VectorXd>(area.data(), static_cast<Eigen::Index>(area.size()));
}

MatrixXd kernelOf(const TriMesh& mesh) {
  const VectorXd area = areasOf(mesh);
  MatrixXd kernel(area.size(), area.size());
  for (Eigen::Index i = 0; i < area.size(); ++i) {
    for (Eigen::Index j = 0; j < area.size(); ++j) {
      const double soft = (i == j ? SparseInverse::kSelf : SparseInverse::kPair);
      kernel(i, j) = 1 / std::sqrt((mesh.vertices[i] - mesh.vertices[j]).squaredNorm() +
                                   soft * soft * std::sqrt(area[i] * area[j]));
    }
  }
  return kernel;
}

MatrixXd matrixOf(const SparseInverse& inverse, Eigen::Index size) {
  MatrixXd result(size, size);
  for (Eigen::Index i = 0; i < size; ++i) result.col(i) = inverse.apply(VectorXd::Unit(size, i));
  return result;
}

TriMesh ellipsoid(int level) {
  TriMesh mesh = icosphere(level);
  for (Vec3& p : mesh.vertices) p = p.cwiseProduct(Vec3(1, 0.7, 0.4));
  return mesh;
}

TEST(SparseInverse, IsTheInverseWhenNothingIsLeftOut) {
  const TriMesh mesh = ellipsoid(1);  // 42 vertices
  const SparseInverse inverse(mesh.vertices, areasOf(mesh), 42, Context::quiet());
  const MatrixXd product = matrixOf(inverse, 42) * kernelOf(mesh);
  EXPECT_LT((product - MatrixXd::Identity(42, 42)).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(SparseInverse, BoundsTheCondition) {
  const TriMesh mesh = ellipsoid(3);  // 642 vertices
  const auto size = static_cast<Eigen::Index>(mesh.vertices.size());
  const MatrixXd kernel = kernelOf(mesh);
  auto condition = [&](int neighbours) {
    const SparseInverse inverse(mesh.vertices, areasOf(mesh), neighbours, Context::quiet());
    // Similar to the product of the two: C^T (L L^T) C with K = C C^T.
    const MatrixXd factor = kernel.llt().matrixL();
    const VectorXd values = Eigen::SelfAdjointEigenSolver<MatrixXd>(
                                factor.transpose() * matrixOf(inverse, size) * factor, Eigen::EigenvaluesOnly)
                                .eigenvalues();
    EXPECT_GT(values[0], 0);
    return values[size - 1] / values[0];
  };
  EXPECT_LT(condition(30), 2);
  EXPECT_GT(condition(2), 10) << "the kernel is so well conditioned that the test shows nothing";
}

TEST(SparseInverse, DependsOnPlacesNotOnNumbers) {
  const TriMesh mesh = ellipsoid(3);
  const auto size = static_cast<Eigen::Index>(mesh.vertices.size());
  const VectorXd area = areasOf(mesh), potential = VectorXd::LinSpaced(size, -1, 2);
  std::vector<Vec3> vertices(mesh.vertices.rbegin(), mesh.vertices.rend());
  const VectorXd there = SparseInverse(mesh.vertices, area, 20, Context::quiet()).apply(potential);
  const VectorXd back =
      SparseInverse(vertices, area.reverse(), 20, Context::quiet()).apply(potential.reverse()).reverse();
  EXPECT_LT((there - back).cwiseAbs().maxCoeff(), 1e-9 * there.cwiseAbs().maxCoeff());
}

TEST(SparseInverse, NearlyEqualVerticesAndUnequalAreasKeepItFinite) {
  TriMesh mesh = ellipsoid(2);
  VectorXd area = areasOf(mesh);
  const std::size_t count = mesh.vertices.size();
  for (std::size_t i = 0; i < count; i += 3) {
    mesh.vertices.push_back(mesh.vertices[i] + Vec3(1e-9, 0, 0));
    area.conservativeResize(area.size() + 1);
    area[area.size() - 1] = 1e-6 * area[static_cast<Eigen::Index>(i)];
  }
  const SparseInverse inverse(mesh.vertices, area, 30, Context::quiet());
  const VectorXd ones = VectorXd::Ones(area.size()), charge = inverse.apply(ones);
  EXPECT_TRUE(charge.allFinite());
  EXPECT_GT(ones.dot(charge), 0);
}

TEST(SparseInverse, SameBytesForAnyNumberOfThreads) {
  const TriMesh mesh = ellipsoid(4);
  const VectorXd area = areasOf(mesh), potential = VectorXd::LinSpaced(area.size(), -1, 2);
  VectorXd one, two;
  withThreads(1, [&] { one = SparseInverse(mesh.vertices, area, 30, Context::quiet()).apply(potential); });
  withThreads(2, [&] { two = SparseInverse(mesh.vertices, area, 30, Context::quiet()).apply(potential); });
  EXPECT_EQ(one, two);
}

TEST(SparseInverse, StopsWhenCancelled) {
  const TriMesh mesh = ellipsoid(4);
  Context context;
  context.cancel();
  EXPECT_THROW(SparseInverse(mesh.vertices, areasOf(mesh), 30, context), Error);
}

}  // namespace
}  // namespace polestar::detail
