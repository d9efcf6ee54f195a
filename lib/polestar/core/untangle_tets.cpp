#include "polestar/core/detail/untangle_tets.h"

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>

#include "polestar/core/detail/lbfgs.h"
#include "polestar/core/predicates.h"

namespace polestar::detail {
namespace {

using Block = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;  // a row a node

constexpr double kVolume = 0.05;
constexpr int kRounds = 40, kIdleRounds = 8, kStepsPerRound = 40, kPolishSteps = 60;
constexpr std::size_t kHistory = 8;

class Untangler {
 public:
  explicit Untangler(TetPatch patch) : patch_(std::move(patch)) {
    for (const TetPatch::Tet& tet : patch_.tets) addElement(tet);
    place_.resize(static_cast<Eigen::Index>(patch_.free), 3);
    for (std::size_t i = 0; i < patch_.free; ++i) place_.row(row(i)) = patch_.nodes[i].transpose();
    factorize();
  }

  std::vector<Vec3> solve(const Context& context) {
    const std::size_t before = countBad(place_);
    Block best = place_;
    std::size_t fewest = before;
    double smallest = smallestDeterminant(place_);
    double epsilon = std::sqrt(1e-12 + 0.04 * std::min(smallest, 0.0) * std::min(smallest, 0.0));
    int idle = 0;  // rounds without fewer bad tetrahedra
    for (int round = 0; round < kRounds && fewest > 0 && idle < kIdleRounds; ++round, ++idle) {
      context.throwIfCancelled();
      const double start = energy(place_, epsilon, nullptr);
      const double end = descend(epsilon, kStepsPerRound);
      const std::size_t bad = countBad(place_);
      if (bad < fewest) {
        fewest = bad;
        best = place_;
        idle = -1;
      }
      if (bad == 0) break;
      // The update of epsilon that the paper proves to end in finitely many steps.
      smallest = smallestDeterminant(place_);
      const double sigma = std::max(1 - end / start, 0.1);
      const double chi = 0.5 * (smallest + std::sqrt(epsilon * epsilon + smallest * smallest));
      const double mu = (1 - sigma) * chi;
      epsilon = smallest < mu ? std::max(1e-9, 2 * std::sqrt(mu * (mu - smallest))) : 1e-9;
    }
    if (fewest >= before) return {};
    if (fewest == 0) {
      // Away from the edge of what is allowed.
      place_ = best;
      descend(1e-12, kPolishSteps);
      if (countBad(place_) == 0) best = place_;
    }
    std::vector<Vec3> result(patch_.free);
    for (std::size_t i = 0; i < result.size(); ++i) result[i] = best.row(row(i)).transpose();
    return result;
  }

 private:
  struct Element {
    std::array<std::uint32_t, 4> node;
    Eigen::Matrix<double, 4, 3> slope;  // gradients of the barycentric weights on the reference
  };

  static Eigen::Index row(std::size_t node) { return static_cast<Eigen::Index>(node); }
  bool isFree(std::uint32_t node) const { return node < patch_.free; }

  void addElement(const TetPatch::Tet& tet) {
    if (!(tet.reference.determinant() > 0)) return;
    Element element;
    element.node = tet.node;
    const Mat3 inverse = tet.reference.inverse();
    element.slope.bottomRows<3>() = inverse;
    element.slope.row(0) = -inverse.colwise().sum();
    elements_.push_back(element);
  }

  void factorize() {
    std::vector<Eigen::Triplet<double>> entries;
    for (const Element& e : elements_) {
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          if (!isFree(e.node[b]) || e.node[b] < e.node[a]) continue;
          entries.emplace_back(row(e.node[b]), row(e.node[a]), 2.0 / 3 * e.slope.row(a).dot(e.slope.row(b)));
        }
      }
    }
    const auto n = row(patch_.free);
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index i = 0; i < n; ++i) matrix.coeffRef(i, i) *= 1 + 1e-9;
    laplacian_.compute(matrix);
  }

  Vec3 at(const Block& place, std::uint32_t node) const {
    return isFree(node) ? Vec3(place.row(row(node)).transpose()) : patch_.nodes[node];
  }

  Mat3 jacobian(const Block& place, const Element& e) const {
    Mat3 j = Mat3::Zero();
    const Vec3 origin = at(place, e.node[0]);
    for (int k = 1; k < 4; ++k) j += (at(place, e.node[k]) - origin) * e.slope.row(k);
    return j;
  }

  double smallestDeterminant(const Block& place) const {
    double smallest = 1e300;
    for (const Element& e : elements_) smallest = std::min(smallest, jacobian(place, e).determinant());
    return smallest;
  }

  double energy(const Block& place, double epsilon, Block* gradient) const {
    if (gradient) gradient->setZero(place.rows(), 3);
    double sum = 0;
    for (const Element& e : elements_) {
      const Mat3 j = jacobian(place, e);
      Mat3 cofactor;
      cofactor.col(0) = j.col(1).cross(j.col(2));
      cofactor.col(1) = j.col(2).cross(j.col(0));
      cofactor.col(2) = j.col(0).cross(j.col(1));
      const double d = j.col(0).dot(cofactor.col(0)), root = std::sqrt(epsilon * epsilon + d * d);
      // (d + root) / 2 without cancellation.
      const double chi = d > 0 ? 0.5 * (d + root) : 0.5 * epsilon * epsilon / (root - d);
      if (!(chi > 0)) return HUGE_VAL;
      const double power = std::pow(chi, -2.0 / 3), size = j.squaredNorm();
      sum += size * power / 3 + kVolume * (d * d + 1) / (2 * chi);
      if (!gradient) continue;
      const double slopeOfChi = chi / root;
      const double slope = -2.0 / 9 * size * power / chi * slopeOfChi +
                           kVolume * (d / chi - (d * d + 1) / (2 * chi * chi) * slopeOfChi);
      const Mat3 derivative = 2.0 / 3 * power * j + slope * cofactor;
      for (int k = 0; k < 4; ++k) {
        if (isFree(e.node[k]))
          gradient->row(row(e.node[k])) += (derivative * e.slope.row(k).transpose()).transpose();
      }
    }
    return std::isfinite(sum) ? sum : HUGE_VAL;
  }

  // At a fixed epsilon; the energy where it ends.
  double descend(double epsilon, int steps) {
    return descendLbfgs(
        place_, {.steps = steps, .memory = kHistory, .gain = 1e-5},
        [&](const Block& place, Block& gradient) { return energy(place, epsilon, &gradient); },
        [&](const Block& q, const auto&) {
          Block result(q.rows(), 3);
          for (int k = 0; k < 3; ++k) result.col(k) = laplacian_.solve(Eigen::VectorXd(q.col(k)));
          return result;
        });
  }

  std::size_t countBad(const Block& place) const {
    std::size_t bad = 0;
    for (const TetPatch::Tet& tet : patch_.tets) {
      const auto& n = tet.node;
      bad += orient3d(at(place, n[0]), at(place, n[1]), at(place, n[2]), at(place, n[3])) <= 0;
    }
    return bad;
  }

  TetPatch patch_;
  std::vector<Element> elements_;
  Block place_;
  // Complete factors of a graph in space fill up: 80,000 nodes took minutes.
  Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::AMDOrdering<int>> laplacian_;
};

}  // namespace

std::vector<Vec3> untangleTets(TetPatch patch, const Context& context) {
  return Untangler(std::move(patch)).solve(context);
}

}  // namespace polestar::detail
