#include "harmonic.h"

#include <Eigen/LU>
#include <array>
#include <limits>
#include <map>
#include <utility>

#include "polestar/core/detail/aabb_tree.h"
#include "tet_laplacian.h"
#include "tetgen.h"

namespace polestar::bench {
namespace {

using Corners = std::array<std::int32_t, 4>;

Mat3 edges(const std::vector<Vec3>& at, const Corners& t) {
  Mat3 e;
  for (int k = 0; k < 3; ++k) e.col(k) = at[t[k + 1]] - at[t[0]];
  return e;
}

/// Which tetrahedron holds a point, and where in it.
class Finder {
 public:
  Finder(const std::vector<Vec3>& at, const std::vector<Corners>& tetrahedra)
      : at_(at), tetrahedra_(tetrahedra) {
    std::vector<detail::Bounds> boxes(tetrahedra.size());
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      for (const std::int32_t v : tetrahedra[i]) boxes[i].include(at[v]);
    }
    tree_ = detail::AabbTree(boxes);
  }

  std::optional<std::pair<std::size_t, Vec3>> find(const Vec3& p) const {
    std::optional<std::pair<std::size_t, Vec3>> found;
    tree_.visitWithin(p, 1e-24, [&](std::size_t i) {
      const Vec3 w = edges(at_, tetrahedra_[i]).inverse() * (p - at_[tetrahedra_[i][0]]);
      if (!(w.minCoeff() >= -1e-9 && w.sum() <= 1 + 1e-9)) return false;
      found = {i, w};
      return true;
    });
    return found;
  }

 private:
  const std::vector<Vec3>& at_;
  const std::vector<Corners>& tetrahedra_;
  detail::AabbTree tree_;
};

const double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace

struct HarmonicMap::Data {
  Frame frame;
  TetMesh mesh;
  std::vector<Vec3> image;
  std::optional<Finder> inSolid, inBall;
  std::size_t inverted = 0;
};

std::optional<HarmonicMap> HarmonicMap::make(const StarShape& shape, const SphereMap& boundary) {
  std::optional<TetMesh> mesh = tetrahedralize(shape.mesh());
  if (!mesh) return std::nullopt;
  auto data = std::make_shared<Data>();
  data->frame = shape.frame();
  data->mesh = std::move(*mesh);
  std::map<std::array<double, 3>, std::size_t> vertexAt;
  for (std::size_t i = 0; i < data->mesh.surfaceVertices; ++i) {
    const Vec3& v = data->mesh.vertices[i];
    vertexAt[{v[0], v[1], v[2]}] = i;
  }
  data->image.resize(data->mesh.vertices.size());
  for (int axis = 0; axis < 3; ++axis) {
    const TetSolution solution = solveTetLaplacian(
        data->mesh,
        [&](const Vec3& v) {
          return boundary.directions[vertexAt.at({v[0], v[1], v[2]})][axis];
        },
        1e-9);
    for (std::size_t i = 0; i < data->image.size(); ++i) data->image[i][axis] = solution.h[i];
  }
  for (Corners& t : data->mesh.tetrahedra) {
    if (edges(data->mesh.vertices, t).determinant() < 0) std::swap(t[2], t[3]);
    data->inverted += !(edges(data->image, t).determinant() > 0);
  }
  data->inSolid.emplace(data->mesh.vertices, data->mesh.tetrahedra);
  data->inBall.emplace(data->image, data->mesh.tetrahedra);
  return HarmonicMap(data);
}

void HarmonicMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  for (std::size_t i = 0; i < solid.size(); ++i) {
    domain[i].setConstant(kNan);
    if (const auto found = data_->inSolid->find(data_->frame.toInner(solid[i]))) {
      const Corners& t = data_->mesh.tetrahedra[found->first];
      domain[i] = data_->image[t[0]] + edges(data_->image, t) * found->second;
    }
  }
}

void HarmonicMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  for (std::size_t i = 0; i < domain.size(); ++i) {
    solid[i].setConstant(kNan);
    // Images fill a polyhedron with its corners on the sphere: points above its faces go down to them.
    double shrink = 0;
    auto found = data_->inBall->find(domain[i]);
    for (int step = 0; !found && step < 12; ++step) {
      shrink = shrink > 0 ? 2 * shrink : 1e-4;
      found = data_->inBall->find((1 - shrink) * domain[i]);
    }
    if (!found) continue;
    const Corners& t = data_->mesh.tetrahedra[found->first];
    solid[i] =
        data_->frame.toWorld(data_->mesh.vertices[t[0]] + edges(data_->mesh.vertices, t) * found->second);
  }
}

void HarmonicMap::jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const {
  for (std::size_t i = 0; i < solid.size(); ++i) {
    derivative[i].setConstant(kNan);
    if (const auto found = data_->inSolid->find(data_->frame.toInner(solid[i]))) {
      const Corners& t = data_->mesh.tetrahedra[found->first];
      derivative[i] = edges(data_->image, t) * edges(data_->mesh.vertices, t).inverse() / data_->frame.unit;
    }
  }
}

std::size_t HarmonicMap::tetrahedra() const { return data_->mesh.tetrahedra.size(); }
std::size_t HarmonicMap::inverted() const { return data_->inverted; }

}  // namespace polestar::bench
