#pragma once
// The near field of a single layer: what point charges at the edge midpoints miss close to a triangle. The
// far field, by whatever fast method, stays a plain sum over point charges; this corrects it.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/green/detail/near_kernels.h"
#include "polestar/mesh/tri_mesh.h"

namespace polestar::detail {

class NearField;

/// Triangles that may be near a group of points, packed for the distance test that every point begins with.
///
/// Pack once a group (a box of targets), then ask for each of its points. Reusing the object keeps its
/// memory.
class NearCandidates {
 public:
  NearCandidates() = default;
  NearCandidates(const NearField& field, std::span<const std::uint32_t> triangles) {
    assign(field, triangles);
  }
  void assign(const NearField& field, std::span<const std::uint32_t> triangles);
  std::size_t size() const { return triangle_.size(); }

 private:
  friend class NearField;
  std::vector<std::uint32_t> triangle_;
  std::vector<double> x_, y_, z_;             ///< centroids
  std::vector<double> inverseSquaredRadius_;  ///< of the near spheres
};

/// Corrections that turn the field of the edge-midpoint charges into that of the linear density.
///
/// Triangle t adds  w(x) (exact(x) - charges(x)):  exact is the closed form of the integral of sigma(y)/|x -
/// y|, charges is area/6 (sigma_k + sigma_k+1) / sqrt(|x - m_k|^2 + softening^2) over its edge midpoints m_k
/// = 0.5 (a_k + a_k+1), and w falls smoothly from 1 at kBlendFrom of the near radius to 0 at the radius, so
/// that the sum is continuously differentiable off the surface. All lengths in the mesh's unit.
///
/// Accuracy of the closed forms, relative to the triangle's own potential: 1e-14 for ordinary triangles,
/// 1e-16 times the aspect ratio for a constant density on needles, times its square for the part that varies
/// across the needle; gradients at distance d from an edge further lose 1e-16 diameters/d, as if the point
/// were rounded.
///
/// The results depend on the order of the near triangles among the candidates, not on the other candidates:
/// same bytes for every superset. Const methods are safe from many threads.
class NearField {
 public:
  static constexpr double kNear = 2.5;        ///< near radius, in diameters of the triangle
  static constexpr double kBlendFrom = 0.75;  ///< share of that radius where the blend begins

  /// @param squaredSoftening of the point charges that are corrected.
  NearField(const TriMesh& mesh, double squaredSoftening);

  std::size_t triangleCount() const { return spheres_.size(); }

  /// Outside its near sphere a triangle adds nothing.
  struct Sphere {
    Vec3 center;  ///< the triangle's centroid
    double radius;
  };
  Sphere nearSphere(std::size_t t) const { return spheres_[t]; }
  double area(std::size_t t) const;

  /// A density, linear on the triangles, in the form that the sums read.
  class Density {
    friend class NearField;
    std::vector<std::array<double, kNearDensity>>
        affine_;  ///< a triangle: value at its first corner, slopes in its frame
  };
  Density density(std::span<const double> atVertices) const;

  /// The correction at x for a density with values s_k at the corners mesh.triangles[triangle][k] is the sum
  /// of coefficient[k] s_k.
  struct Row {
    std::uint32_t triangle;
    std::array<double, 3> coefficient;
  };
  /// Appends one row for each near triangle, in the order of the candidates.
  void appendRows(const Vec3& x, const NearCandidates& candidates, std::vector<Row>& rows) const;

  /// Sum of the corrections at x.
  double potential(const Vec3& x, const NearCandidates& candidates, const Density& density) const;

  /// Adds the corrections and their gradient in x.
  ///
  /// On a triangle the gradient is its limit from the inner side (against the normal); on an edge whose
  /// density is not 0 the true one is infinite, and a large finite one is returned.
  void addPotentialAndGradient(const Vec3& x, const NearCandidates& candidates, const Density& density,
                               double& potential, Vec3& gradient) const;

 private:
  friend class NearCandidates;
  struct NearTriangle;
  struct Block;

  void pack(const TriMesh& mesh, std::size_t t);
  void fill(const NearTriangle* near, std::size_t count, const Density* density, Block& block) const;
  template <class Compute>
  void forNearBlocks(const Vec3& x, const NearCandidates& candidates, const Density* density,
                     Compute compute) const;

  std::vector<Sphere> spheres_;
  std::vector<std::array<double, kNearRecord>> records_;
  std::vector<Triangle> corners_;       ///< as in the records: edge 0 is the longest
  std::vector<std::uint8_t> rotation_;  ///< which corner of the mesh's triangle is corner 0 of the record
  double squaredSoftening_;
};

}  // namespace polestar::detail
