#include "voxel_poisson.h"

#include <openvdb/openvdb.h>
#include <openvdb/tools/PoissonSolver.h>

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "exact_solid.h"

namespace polestar::bench {
namespace {

using openvdb::Coord;
using openvdb::DoubleTree;
namespace pcg = openvdb::math::pcg;
namespace poisson = openvdb::tools::poisson;

constexpr std::array<std::array<int, 3>, 6> kArms = {
    {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}}};

/// A boundary value and its place along the arm of a stencil, in voxels from the center.
struct BoundaryDatum {
  Vec3 place;
  double distance, value;
};

/// The problem on the lattice of voxel centers.
struct Lattice {
  DirichletProblem problem;
  VoxelBoundary boundary;
  double voxel;

  Vec3 center(const Coord& c) const {
    return problem.box.min + voxel * (Vec3(c.x(), c.y(), c.z()) + Vec3::Constant(0.5));
  }

  BoundaryDatum datum(const Coord& in, const Coord& out) const {
    if (boundary == VoxelBoundary::neighbours) return {center(out), 1, problem.boundaryValue(center(out))};
    // Shorter arms make rows so large that the conjugate gradients stop too early or give up, and moving the
    // surface by a thousandth of a voxel is far below the scheme's own error.
    constexpr double kShortest = 1e-3;
    const Vec3 place = crossing(problem.inside, center(in), center(out));
    const double distance = std::max(kShortest, (place - center(in)).norm() / voxel);
    return {place, distance, problem.boundaryValue(place)};
  }
};

/// What OpenVDB asks for every arm that leaves the solid: (h_boundary - h) / distance takes the place of
/// h_neighbour - h.
struct BoundaryOperator {
  const Lattice* lattice;
  void operator()(const Coord& in, const Coord& out, double& source, double& diagonal) const {
    const BoundaryDatum datum = lattice->datum(in, out);
    source -= datum.value / datum.distance;
    diagonal -= 1 / datum.distance;
  }
};

using HarmonicBasis = Eigen::Matrix<double, 16, 1>;

/// All of degree at most 3.
HarmonicBasis harmonicPolynomials(const Vec3& d) {
  const double x = d[0], y = d[1], z = d[2], xx = x * x, yy = y * y, zz = z * z;
  HarmonicBasis basis;
  basis << 1, x, y, z, x * y, y * z, z * x, xx - yy, 2 * zz - xx - yy, x * y * z, z * (xx - yy),
      x * (xx - 3 * yy), y * (3 * xx - yy), x * (4 * zz - xx - yy), y * (4 * zz - xx - yy),
      z * (2 * zz - 3 * xx - 3 * yy);
  return basis;
}

}  // namespace

struct VoxelPoisson::Impl {
  Lattice lattice;
  double residual;
  DoubleTree source{0.0};
  DoubleTree::Ptr solution;

  double fit(const Vec3& x) const;
};

VoxelPoisson::VoxelPoisson(DirichletProblem problem, const VoxelPoissonOptions& options)
    : impl_(new Impl{{std::move(problem), options.boundary, 0}, options.residual, DoubleTree(0.0), nullptr}) {
  Lattice& lattice = impl_->lattice;
  const Vec3 extent = lattice.problem.box.extent();
  lattice.voxel = extent.maxCoeff() / options.dim;
  Coord dims;
  for (int k = 0; k < 3; ++k) dims[k] = static_cast<int>(std::ceil(extent[k] / lattice.voxel - 1e-9));
  openvdb::tree::ValueAccessor<DoubleTree> accessor(impl_->source);
  Coord c;
  for (c.x() = 0; c.x() < dims.x(); ++c.x()) {
    for (c.y() = 0; c.y() < dims.y(); ++c.y()) {
      for (c.z() = 0; c.z() < dims.z(); ++c.z()) {
        if (lattice.problem.inside(lattice.center(c))) accessor.setValueOn(c);
      }
    }
  }
}

VoxelPoisson::~VoxelPoisson() = default;

int VoxelPoisson::solve() {
  using Matrix = poisson::LaplacianMatrix;
  // OpenVDB's relative residual is relative to the largest entry of the right-hand side, which short arms
  // make as large as they please; the absolute one means the same on every row.
  pcg::State state{
      .success = false, .iterations = 100000, .relativeError = 1e-300, .absoluteError = impl_->residual};
  openvdb::util::NullInterrupter interrupter;
  impl_->solution =
      poisson::solveWithBoundaryConditionsAndPreconditioner<pcg::IncompleteCholeskyPreconditioner<Matrix>>(
          impl_->source, BoundaryOperator{&impl_->lattice}, state, interrupter, /*staggered=*/true);
  if (!state.success) throw std::runtime_error("OpenVDB's Poisson solver did not converge");
  return state.iterations;
}

std::size_t VoxelPoisson::voxels() const { return impl_->source.activeVoxelCount(); }

std::size_t VoxelPoisson::boundaryVoxels() const {
  openvdb::MaskTree interior(impl_->source, false, openvdb::TopologyCopy());
  openvdb::tools::erodeActiveValues(interior, 1, openvdb::tools::NN_FACE, openvdb::tools::IGNORE_TILES);
  return voxels() - interior.activeVoxelCount();
}

double VoxelPoisson::Impl::fit(const Vec3& x) const {
  constexpr int kReach = 2;
  Eigen::Matrix<double, 16, 16> normal = Eigen::Matrix<double, 16, 16>::Zero();
  HarmonicBasis moment = HarmonicBasis::Zero();
  auto add = [&](const Vec3& place, double value) {
    const Vec3 d = (place - x) / lattice.voxel;
    const double weight = std::exp(-d.squaredNorm());
    const HarmonicBasis basis = harmonicPolynomials(d);
    normal += weight * basis * basis.transpose();
    moment += weight * value * basis;
  };
  openvdb::tree::ValueAccessor<const DoubleTree> values(*solution);
  const Vec3 place = (x - lattice.problem.box.min) / lattice.voxel;
  const Coord home = Coord::floor(openvdb::Vec3d(place[0], place[1], place[2]));
  const openvdb::CoordBBox around(home.offsetBy(-kReach), home.offsetBy(kReach));
  for (auto c = around.begin(); c; ++c) {
    double value;
    if (!values.probeValue(*c, value)) continue;
    add(lattice.center(*c), value);
    for (const auto& arm : kArms) {
      const Coord neighbour = (*c).offsetBy(arm[0], arm[1], arm[2]);
      if (values.isValueOn(neighbour)) continue;
      const BoundaryDatum datum = lattice.datum(*c, neighbour);
      add(datum.place, datum.value);
    }
  }
  return normal.ldlt().solve(moment)[0];
}

void VoxelPoisson::evaluate(std::span<const Vec3> points, std::span<double> h) const {
  for (std::size_t i = 0; i < points.size(); ++i) h[i] = impl_->fit(points[i]);
}

}  // namespace polestar::bench
