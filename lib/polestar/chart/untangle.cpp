#include "polestar/chart/untangle.h"

#include <Eigen/Geometry>
#include <Eigen/IterativeLinearSolvers>
#include <Eigen/LU>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <unordered_map>

#include "polestar/core/detail/lbfgs.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar {
namespace {

using Cell = std::array<std::uint32_t, 4>;
using Block = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;  // a row a node

constexpr double kVolume = 0.05;
/// A traced cell serves as its own reference unless it is flatter than this: 6 volume / longest edge^3,
/// against the same of the cell between rays.
constexpr double kSoundShare = 0.05;
constexpr int kRounds = 40, kIdleRounds = 8, kStepsPerRound = 40, kPolishSteps = 60;
constexpr double kLeastFall = 1e-3;
constexpr std::size_t kHistory = 8;
/// Nodes of the largest patch that is tried: minutes otherwise.
constexpr std::size_t kMostNodes = 20000;

// Triangles around every vertex of the surface.
class Surroundings {
 public:
  explicit Surroundings(const Foliation& f) : start_(f.vertexCount + 1, 0) {
    for (const Triangle& t : f.triangles) {
      for (const std::int32_t v : t) ++start_[v + 1];
    }
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    triangles_.resize(start_.back());
    std::vector<std::size_t> next(start_.begin(), start_.end() - 1);
    for (std::size_t t = 0; t < f.triangles.size(); ++t) {
      for (const std::int32_t v : f.triangles[t]) triangles_[next[v]++] = static_cast<std::uint32_t>(t);
    }
  }
  std::span<const std::uint32_t> around(std::size_t vertex) const {
    return std::span(triangles_).subspan(start_[vertex], start_[vertex + 1] - start_[vertex]);
  }

 private:
  std::vector<std::size_t> start_;
  std::vector<std::uint32_t> triangles_;
};

// The cells of one layer of a triangle's column (the cone's for the last).
template <class Visit>
void visitCells(const Foliation& f, std::size_t layer, std::size_t triangle, Visit&& visit) {
  const std::size_t count = f.triangles.size();
  if (layer == f.layerCount()) {
    visit(3 * layer * count + triangle);
    return;
  }
  for (std::size_t j = 0; j < 3; ++j) visit(3 * (layer * count + triangle) + j);
}

// Nodes that may move, as connected sets.
std::vector<std::vector<std::uint32_t>> patchesAround(const Foliation& f, const Surroundings& surroundings,
                                                      const std::vector<std::size_t>& bad, int rings) {
  const std::size_t n = f.vertexCount;
  auto movable = [&](std::uint32_t id) { return id >= n && id < f.centerNode(); };
  std::vector<char> free(f.nodes.size(), 0);
  std::vector<std::uint32_t> front, all;
  auto add = [&](std::uint32_t id, std::vector<std::uint32_t>& to) {
    if (!movable(id) || free[id]) return;
    free[id] = 1;
    to.push_back(id);
    all.push_back(id);
  };
  for (const std::size_t id : bad) {
    for (const std::uint32_t node : f.cell(id)) add(node, front);
  }
  auto neighbours = [&](std::uint32_t id, auto&& visit) {
    // All that may share a cell with it.
    const std::size_t level = id / n, vertex = id % n;
    for (const std::uint32_t t : surroundings.around(vertex)) {
      for (const std::int32_t v : f.triangles[t]) {
        for (std::size_t k = level - 1; k <= level + 1 && k < f.levels.size(); ++k)
          visit(static_cast<std::uint32_t>(f.nodeId(k, v)));
      }
    }
  };
  for (int ring = 0; ring < rings; ++ring) {
    std::vector<std::uint32_t> next;
    for (const std::uint32_t id : front) neighbours(id, [&](std::uint32_t other) { add(other, next); });
    front = std::move(next);
  }
  std::sort(all.begin(), all.end());
  std::vector<std::vector<std::uint32_t>> patches;
  for (const std::uint32_t seed : all) {
    if (free[seed] != 1) continue;
    std::vector<std::uint32_t> patch{seed};
    free[seed] = 2;
    for (std::size_t i = 0; i < patch.size(); ++i) {
      neighbours(patch[i], [&](std::uint32_t other) {
        if (movable(other) && free[other] == 1) {
          free[other] = 2;
          patch.push_back(other);
        }
      });
    }
    std::sort(patch.begin(), patch.end());
    patches.push_back(std::move(patch));
  }
  return patches;
}

// One patch on its way.
class Patch {
 public:
  Patch(const Foliation& f, const Surroundings& surroundings, std::vector<std::uint32_t> free)
      : foliation_(f), free_(std::move(free)) {
    collectCells(surroundings);
    for (const std::size_t id : cellIds_) addCell(f.cell(id));
    place_.resize(static_cast<Eigen::Index>(free_.size()), 3);
    for (std::size_t i = 0; i < free_.size(); ++i) place_.row(i) = f.nodes[free_[i]].transpose();
    factorize();
  }

  /// Places of the free nodes that leave fewer bad cells than there were; empty when none were found.
  std::vector<Vec3> solve(const Context& context) {
    const std::size_t before = countBad(place_);
    Block best = place_;
    std::size_t fewest = before;
    double smallest = smallestDeterminant(place_);
    double epsilon = std::sqrt(1e-12 + 0.04 * std::min(smallest, 0.0) * std::min(smallest, 0.0));
    int idle = 0;  // rounds without fewer bad cells
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
    std::vector<Vec3> result(free_.size());
    for (std::size_t i = 0; i < free_.size(); ++i) result[i] = best.row(i).transpose();
    return result;
  }

  const std::vector<std::uint32_t>& free() const { return free_; }

 private:
  struct Element {
    std::array<std::int32_t, 4> slot;  // of free nodes; -1: fixed
    Cell node;
    Eigen::Matrix<double, 4, 3> slope;  // gradients of the barycentric weights on the reference
  };

  void collectCells(const Surroundings& surroundings) {
    const std::size_t n = foliation_.vertexCount;
    for (std::size_t i = 0; i < free_.size(); ++i) slotOf_[free_[i]] = static_cast<std::int32_t>(i);
    for (const std::uint32_t id : free_) {
      const std::size_t level = id / n;
      for (const std::uint32_t t : surroundings.around(id % n)) {
        for (const std::size_t layer : {level - 1, level}) {
          visitCells(foliation_, layer, t, [&](std::size_t cell) { cellIds_.push_back(cell); });
        }
      }
    }
    std::sort(cellIds_.begin(), cellIds_.end());
    cellIds_.erase(std::unique(cellIds_.begin(), cellIds_.end()), cellIds_.end());
    std::erase_if(cellIds_, [&](std::size_t cell) {
      const Cell c = foliation_.cell(cell);
      return std::none_of(c.begin(), c.end(), [&](std::uint32_t id) { return slotOf_.count(id) > 0; });
    });
  }

  // Where the node would be on the ray of its vertex, were distances from the center to fall from level to
  // level.
  Vec3 onRay(std::uint32_t id) const {
    if (id == foliation_.centerNode()) return Vec3::Zero();
    const std::size_t level = id / foliation_.vertexCount, vertex = id % foliation_.vertexCount;
    const Vec3& q = foliation_.nodes[vertex];
    double distance = q.norm();
    for (std::size_t k = 1; k <= level; ++k)
      distance = std::min(foliation_.node(k, vertex).norm(), (1 - kLeastFall) * distance);
    return distance / q.norm() * q;
  }

  static double soundness(const Mat3& edges) {
    const double longest = std::max(
        {edges.col(0).norm(), edges.col(1).norm(), edges.col(2).norm(), (edges.col(0) - edges.col(1)).norm(),
         (edges.col(1) - edges.col(2)).norm(), (edges.col(2) - edges.col(0)).norm()});
    return edges.determinant() / (longest * longest * longest);
  }

  void addCell(const Cell& cell) {
    Mat3 traced, radial;
    const Vec3 origin = onRay(cell[0]);
    for (int k = 0; k < 3; ++k) {
      traced.col(k) = foliation_.nodes[cell[k + 1]] - foliation_.nodes[cell[0]];
      radial.col(k) = onRay(cell[k + 1]) - origin;
    }
    const double ofRadial = soundness(radial);
    const bool useTraced = !(ofRadial > 0) || soundness(traced) > kSoundShare * ofRadial;
    Mat3 reference = useTraced ? traced : radial;
    if (!(reference.determinant() > 0)) return;  // below rounding: nothing to go by
    Element element;
    element.node = cell;
    for (int k = 0; k < 4; ++k) {
      const auto found = slotOf_.find(cell[k]);
      element.slot[k] = found == slotOf_.end() ? -1 : found->second;
    }
    const Mat3 inverse = reference.inverse();
    element.slope.bottomRows<3>() = inverse;
    element.slope.row(0) = -inverse.colwise().sum();
    elements_.push_back(element);
  }

  void factorize() {
    std::vector<Eigen::Triplet<double>> entries;
    for (const Element& e : elements_) {
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b < 4; ++b) {
          if (e.slot[a] < 0 || e.slot[b] < e.slot[a]) continue;
          entries.emplace_back(e.slot[b], e.slot[a], 2.0 / 3 * e.slope.row(a).dot(e.slope.row(b)));
        }
      }
    }
    const auto n = static_cast<Eigen::Index>(free_.size());
    Eigen::SparseMatrix<double> matrix(n, n);
    matrix.setFromTriplets(entries.begin(), entries.end());
    for (Eigen::Index i = 0; i < n; ++i) matrix.coeffRef(i, i) *= 1 + 1e-9;
    laplacian_.compute(matrix);
  }

  Vec3 at(const Block& place, const Element& e, int k) const {
    return e.slot[k] < 0 ? foliation_.nodes[e.node[k]] : Vec3(place.row(e.slot[k]).transpose());
  }

  Mat3 jacobian(const Block& place, const Element& e) const {
    Mat3 j = Mat3::Zero();
    const Vec3 origin = at(place, e, 0);
    for (int k = 1; k < 4; ++k) j += (at(place, e, k) - origin) * e.slope.row(k);
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
        if (e.slot[k] >= 0) gradient->row(e.slot[k]) += (derivative * e.slope.row(k).transpose()).transpose();
      }
    }
    return std::isfinite(sum) ? sum : HUGE_VAL;
  }

  // At a fixed epsilon; the energy where it ends.
  double descend(double epsilon, int steps) {
    return detail::descendLbfgs(
        place_, {.steps = steps, .memory = kHistory, .gain = 1e-5},
        [&](const Block& place, Block& gradient) { return energy(place, epsilon, &gradient); },
        [&](const Block& q, const auto&) {
          Block result(q.rows(), 3);
          for (int k = 0; k < 3; ++k) result.col(k) = laplacian_.solve(Eigen::VectorXd(q.col(k)));
          return result;
        });
  }

  // All cells that touch a free node, exactly.
  std::size_t countBad(const Block& place) const {
    std::size_t bad = 0;
    for (const std::size_t id : cellIds_) {
      const Cell c = foliation_.cell(id);
      std::array<Vec3, 4> p;
      for (int k = 0; k < 4; ++k) {
        const auto found = slotOf_.find(c[k]);
        p[k] = found == slotOf_.end() ? foliation_.nodes[c[k]] : Vec3(place.row(found->second).transpose());
      }
      bad += orient3d(p[0], p[1], p[2], p[3]) <= 0;
    }
    return bad;
  }

  const Foliation& foliation_;
  std::vector<std::uint32_t> free_;
  std::unordered_map<std::uint32_t, std::int32_t> slotOf_;
  std::vector<std::size_t> cellIds_;
  std::vector<Element> elements_;
  Block place_;
  // Complete factors of a graph in space fill up: 80,000 nodes took minutes.
  Eigen::IncompleteCholesky<double, Eigen::Lower, Eigen::AMDOrdering<int>> laplacian_;
};

}  // namespace

Untangling untangle(Foliation& foliation, int rings, const Context& context) {
  Untangling result;
  const std::vector<std::size_t> bad = badCells(foliation, foliation.nodes);
  if (bad.empty()) return result;
  const Surroundings surroundings(foliation);
  auto patches = patchesAround(foliation, surroundings, bad, rings);
  // Patches share no cells: their nodes would be neighbours and they one patch.
  std::vector<std::vector<Vec3>> places(patches.size());
  detail::parallelChunks(patches.size(), 1, [&](std::size_t p, std::size_t) {
    if (patches[p].size() <= kMostNodes)
      places[p] = Patch(foliation, surroundings, patches[p]).solve(context);
  });
  for (std::size_t p = 0; p < patches.size(); ++p) {
    for (std::size_t i = 0; i < places[p].size(); ++i) {
      Vec3& node = foliation.nodes[patches[p][i]];
      result.largestMove = std::max(result.largestMove, (places[p][i] - node).norm());
      if (places[p][i] != node) result.movedNodes.push_back(patches[p][i]);
      node = places[p][i];
    }
  }
  std::sort(result.movedNodes.begin(), result.movedNodes.end());
  return result;
}

}  // namespace polestar
