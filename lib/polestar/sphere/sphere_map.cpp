#include "polestar/sphere/sphere_map.h"

#include <Eigen/LU>
#include <Eigen/SVD>

#include "polestar/core/error.h"
#include "polestar/sphere/detail/conformal.h"
#include "polestar/sphere/detail/sphere_quality.h"

namespace polestar {

void ConformalOptions::validate() const {
  if (maxIterations < 1) throw Error(Errc::usage, "ConformalOptions: maxIterations must be at least 1");
  if (!(tolerance > 0)) throw Error(Errc::usage, "ConformalOptions: tolerance must be positive");
}

const char* toString(SphereMapKind kind) {
  switch (kind) {
    case SphereMapKind::conformal:
      return "conformal";
    case SphereMapKind::fieldLine:
      return "field-line";
    case SphereMapKind::balanced:
      return "balanced";
    default:
      return "radial";
  }
}

SphereMap radialSphereMap(const StarShape& shape) { return detail::radialMap(shape.mesh()); }

SphereMap conformalSphereMap(const StarShape& shape, const ConformalOptions& options, Context& context) {
  return detail::conformalMap(shape.mesh(), options, context);
}

SphereMap fieldLineSphereMap(const StarShape& shape, std::span<const Vec3> omega, Context& context) {
  if (omega.size() != shape.mesh().vertices.size())
    throw Error(Errc::usage, "fieldLineSphereMap: wants one direction a vertex");
  return detail::fieldLineMap(shape.mesh(), omega, context);
}

SphereMap measuredSphereMap(const StarShape& shape, SphereMapKind kind, std::vector<Vec3> directions) {
  return detail::measuredMap(shape.mesh(), kind, std::move(directions));
}

std::size_t countFlips(std::span<const Vec3> directions, const std::vector<Triangle>& triangles) {
  return detail::flippedTriangles(directions, triangles).size();
}

Mat3 bestRotation(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const double> weight) {
  Mat3 covariance = Mat3::Zero();
  for (std::size_t i = 0; i < from.size(); ++i) covariance += weight[i] * to[i] * from[i].transpose();
  const Eigen::JacobiSVD<Mat3> svd(covariance, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // A reflection may fit better; the rotation that fits best then gives up the weakest direction. [Kabsch
  // 1976]
  Vec3 sign = Vec3::Ones();
  sign[2] = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

}  // namespace polestar
