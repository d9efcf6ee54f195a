#include "tet_laplacian.h"

#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "polestar/core/detail/parallel.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::bench {
namespace {

using Index = std::int32_t;
using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;
using Tetrahedron = std::array<Index, 4>;

/// Corner k's gradients times six volumes: the inward normal of the face opposite to it, twice the face long.
struct CornerNormals {
  std::array<Vec3, 4> normal;
  double sixVolumes;

  CornerNormals(const TetMesh& mesh, const Tetrahedron& t) {
    const Vec3& o = mesh.vertices[t[0]];
    const Vec3 a = mesh.vertices[t[1]] - o, b = mesh.vertices[t[2]] - o, c = mesh.vertices[t[3]] - o;
    normal = {Vec3::Zero(), b.cross(c), c.cross(a), a.cross(b)};
    normal[0] = -(normal[1] + normal[2] + normal[3]);
    sixVolumes = a.dot(normal[1]);
    if (sixVolumes < 0) {
      for (Vec3& n : normal) n = -n;
      sixVolumes = -sixVolumes;
    }
  }
};

/// For every vertex its tetrahedra.
struct Incidence {
  std::vector<std::size_t> start;
  std::vector<Index> tets;

  explicit Incidence(const TetMesh& mesh) : start(mesh.vertices.size() + 1) {
    for (const Tetrahedron& t : mesh.tetrahedra) {
      for (const Index v : t) ++start[v + 1];
    }
    for (std::size_t v = 1; v < start.size(); ++v) start[v] += start[v - 1];
    tets.resize(start.back());
    std::vector<std::size_t> next(start.begin(), start.end() - 1);
    for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
      for (const Index v : mesh.tetrahedra[i]) tets[next[v]++] = static_cast<Index>(i);
    }
  }
};

/// One row of the stiffness matrix, K_ij = sum over tetrahedra of V grad_i . grad_j = n_i . n_j / (6 * 6V),
/// which is the cotangent formula -1/6 sum l_kl cot(theta_kl) with the cotangents multiplied out.
void stiffnessRow(const TetMesh& mesh, const Incidence& incidence, Index row,
                  std::vector<std::pair<Index, double>>& entries) {
  entries.clear();
  for (std::size_t e = incidence.start[row]; e < incidence.start[row + 1]; ++e) {
    const Tetrahedron& t = mesh.tetrahedra[incidence.tets[e]];
    const CornerNormals corners(mesh, t);
    const auto self = std::find(t.begin(), t.end(), row) - t.begin();
    for (int k = 0; k < 4; ++k) {
      entries.emplace_back(t[k], corners.normal[self].dot(corners.normal[k]) / (6 * corners.sixVolumes));
    }
  }
  std::sort(entries.begin(), entries.end(), [](auto& a, auto& b) { return a.first < b.first; });
  std::size_t last = 0;
  for (std::size_t i = 1; i < entries.size(); ++i) {
    if (entries[i].first == entries[last].first) {
      entries[last].second += entries[i].second;
    } else {
      entries[++last] = entries[i];
    }
  }
  entries.resize(std::min(entries.size(), last + 1));
}

struct System {
  Matrix matrix;  // interior vertices only
  Eigen::VectorXd rightHandSide;
};

System assemble(const TetMesh& mesh, std::span<const double> boundary) {
  const auto first = static_cast<Index>(mesh.surfaceVertices);
  const auto unknowns = static_cast<Index>(mesh.vertices.size()) - first;
  const Incidence incidence(mesh);
  System system{Matrix(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
  constexpr std::size_t kChunk = 1024;
  std::vector<std::vector<std::pair<Index, double>>> rows(unknowns);
  detail::parallelChunks(static_cast<std::size_t>(unknowns), kChunk, [&](std::size_t begin, std::size_t end) {
    std::vector<std::pair<Index, double>> entries;
    for (std::size_t i = begin; i < end; ++i) {
      stiffnessRow(mesh, incidence, first + static_cast<Index>(i), entries);
      for (const auto& [vertex, value] : entries) {
        if (vertex < first) {
          system.rightHandSide[static_cast<Eigen::Index>(i)] -= value * boundary[vertex];
        } else {
          rows[i].emplace_back(vertex - first, value);
        }
      }
    }
  });
  std::size_t entries = 0;
  for (const auto& row : rows) entries += row.size();
  system.matrix.reserve(static_cast<Eigen::Index>(entries));
  for (Index i = 0; i < unknowns; ++i) {
    system.matrix.startVec(i);
    for (const auto& [column, value] : rows[i]) system.matrix.insertBack(i, column) = value;
  }
  system.matrix.finalize();
  return system;
}

Eigen::VectorXd times(const Matrix& matrix, const Eigen::VectorXd& x) {
  Eigen::VectorXd result(x.size());
  detail::parallelChunks(static_cast<std::size_t>(x.size()), 4096, [&](std::size_t begin, std::size_t end) {
    const auto first = static_cast<Eigen::Index>(begin), count = static_cast<Eigen::Index>(end - begin);
    result.segment(first, count).noalias() = matrix.middleRows(first, count) * x;
  });
  return result;
}

/// Scaled by the diagonal. Eigen's own run on one core, or on all with OpenMP's waiting threads in the way of
/// TBB's.
std::pair<Eigen::VectorXd, int> conjugateGradients(const System& system, double residual) {
  const Eigen::VectorXd inverseDiagonal = system.matrix.diagonal().cwiseInverse();
  const double goal = residual * system.rightHandSide.norm();
  Eigen::VectorXd x = Eigen::VectorXd::Zero(system.rightHandSide.size()), r = system.rightHandSide;
  Eigen::VectorXd direction = inverseDiagonal.cwiseProduct(r);
  double energy = r.dot(direction);
  constexpr int kMost = 100000;
  for (int iteration = 0; iteration < kMost; ++iteration) {
    if (r.norm() <= goal) return {x, iteration};
    const Eigen::VectorXd image = times(system.matrix, direction);
    const double step = energy / direction.dot(image);
    x += step * direction;
    r -= step * image;
    const double before = energy;
    const Eigen::VectorXd scaled = inverseDiagonal.cwiseProduct(r);
    energy = r.dot(scaled);
    direction = scaled + energy / before * direction;
  }
  throw std::runtime_error("the cotangent Laplacian did not converge");
}

/// Tetrahedra by the cells of a uniform grid that their boxes touch.
class TetGrid {
 public:
  explicit TetGrid(const TetMesh& mesh) : mesh_(mesh) {
    Box box;
    for (const Vec3& v : mesh.vertices) box.min = box.min.cwiseMin(v), box.max = box.max.cwiseMax(v);
    origin_ = box.min;
    cell_ = std::cbrt(box.extent().prod() / static_cast<double>(mesh.tetrahedra.size())) * 2;
    for (int k = 0; k < 3; ++k) dims_[k] = 1 + static_cast<int>(box.extent()[k] / cell_);
    cells_.resize(static_cast<std::size_t>(dims_[0]) * dims_[1] * dims_[2]);
    for (std::size_t t = 0; t < mesh.tetrahedra.size(); ++t) {
      Box around;
      for (const Index v : mesh.tetrahedra[t]) {
        around.min = around.min.cwiseMin(mesh.vertices[v]);
        around.max = around.max.cwiseMax(mesh.vertices[v]);
      }
      visit(around, [&](std::vector<Index>& cell) { cell.push_back(static_cast<Index>(t)); });
    }
  }

  /// The tetrahedron around x, or the one that it misses least; with its barycentric coordinates.
  std::pair<Tetrahedron, std::array<double, 4>> find(const Vec3& x) {
    Index best = -1;
    double bestLeast = -std::numeric_limits<double>::infinity();
    std::array<double, 4> coordinates{};
    for (double reach = 0; best < 0; reach += cell_) {
      visit({x.array() - reach, x.array() + reach}, [&](const std::vector<Index>& cell) {
        for (const Index t : cell) {
          const std::array<double, 4> b = barycentric(mesh_.tetrahedra[t], x);
          const double least = *std::min_element(b.begin(), b.end());
          if (least > bestLeast) best = t, bestLeast = least, coordinates = b;
        }
      });
    }
    return {mesh_.tetrahedra[best], coordinates};
  }

 private:
  std::array<double, 4> barycentric(const Tetrahedron& t, const Vec3& x) const {
    const CornerNormals corners(mesh_, t);
    std::array<double, 4> b{};
    for (int k = 0; k < 4; ++k)
      b[k] = corners.normal[k].dot(x - mesh_.vertices[t[(k + 1) % 4]]) / corners.sixVolumes;
    return b;
  }

  template <class Visit>
  void visit(const Box& box, Visit&& visit) {
    std::array<int, 3> low{}, high{};
    for (int k = 0; k < 3; ++k) {
      low[k] = std::clamp(static_cast<int>((box.min[k] - origin_[k]) / cell_), 0, dims_[k] - 1);
      high[k] = std::clamp(static_cast<int>((box.max[k] - origin_[k]) / cell_), 0, dims_[k] - 1);
    }
    for (int i = low[0]; i <= high[0]; ++i) {
      for (int j = low[1]; j <= high[1]; ++j) {
        for (int k = low[2]; k <= high[2]; ++k)
          visit(cells_[(static_cast<std::size_t>(i) * dims_[1] + j) * dims_[2] + k]);
      }
    }
  }

  const TetMesh& mesh_;
  Vec3 origin_;
  double cell_;
  std::array<int, 3> dims_{};
  std::vector<std::vector<Index>> cells_;
};

}  // namespace

TetSolution solveTetLaplacian(const TetMesh& mesh, const std::function<double(const Vec3&)>& boundaryValue,
                              double residual) {
  std::vector<double> values;
  for (std::size_t v = 0; v < mesh.surfaceVertices; ++v) values.push_back(boundaryValue(mesh.vertices[v]));
  return solveTetLaplacian(mesh, values, residual);
}

TetSolution solveTetLaplacian(const TetMesh& mesh, std::span<const double> boundaryValues, double residual) {
  TetSolution solution;
  solution.h.assign(boundaryValues.begin(), boundaryValues.end());
  solution.h.resize(mesh.vertices.size());
  const System system = assemble(mesh, solution.h);
  const auto [interior, iterations] = conjugateGradients(system, residual);
  std::copy(interior.begin(), interior.end(),
            solution.h.begin() + static_cast<std::ptrdiff_t>(mesh.surfaceVertices));
  solution.iterations = iterations;
  return solution;
}

void interpolateOnTets(const TetMesh& mesh, std::span<const double> h, std::span<const Vec3> points,
                       std::span<double> values) {
  TetGrid grid(mesh);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto [corners, weights] = grid.find(points[i]);
    values[i] = 0;
    for (int k = 0; k < 4; ++k) values[i] += weights[k] * h[corners[k]];
  }
}

}  // namespace polestar::bench
