#include "polestar/mesh/principal_axes.h"

#include <Eigen/Eigenvalues>

namespace polestar {

Mat3 principalAxes(const TriMesh& mesh) {
  Mat3 second = Mat3::Zero();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
    const double area = 0.5 * (b - a).cross(c - a).norm();
    const Vec3 sum = a + b + c;
    second += area / 12 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
  }
  Mat3 axes = Eigen::SelfAdjointEigenSolver<Mat3>(second).eigenvectors().transpose();
  // An axis has two directions: the heavier side is the positive one, by the third moment.
  Vec3 third = Vec3::Zero();
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
    const double area = 0.5 * (b - a).cross(c - a).norm();
    third += area * (axes * (a + b + c)).array().cube().matrix();
  }
  for (int k = 0; k < 2; ++k) {
    if (third[k] < 0) axes.row(k) *= -1;
  }
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return axes;
}

}  // namespace polestar
