#include "tet_map.h"

#include <Eigen/LU>
#include <array>
#include <limits>
#include <optional>
#include <utility>

#include "polestar/core/detail/aabb_tree.h"
#include "polestar/core/detail/parallel.h"

namespace polestar::bench {
namespace {

constexpr std::size_t kChunk = 256;
const Vec3 kNowhere = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());

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

}  // namespace

struct TetMap::Data {
  Frame frame;
  TetMesh mesh;
  std::vector<Vec3> image;
  std::optional<Finder> inSolid, inBall;
};

TetMap::TetMap(const Frame& frame, TetMesh mesh, std::vector<Vec3> image) {
  auto data = std::make_shared<Data>(Data{frame, std::move(mesh), std::move(image), {}, {}});
  data->inSolid.emplace(data->mesh.vertices, data->mesh.tetrahedra);
  data->inBall.emplace(data->image, data->mesh.tetrahedra);
  data_ = std::move(data);
}

void TetMap::forward(std::span<const Vec3> solid, std::span<Vec3> domain) const {
  detail::parallelChunks(solid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      domain[i] = kNowhere;
      if (const auto found = data_->inSolid->find(data_->frame.toInner(solid[i]))) {
        const Corners& t = data_->mesh.tetrahedra[found->first];
        domain[i] = data_->image[t[0]] + edges(data_->image, t) * found->second;
      }
    }
  });
}

void TetMap::inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const {
  detail::parallelChunks(domain.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      solid[i] = kNowhere;
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
  });
}

void TetMap::jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const {
  detail::parallelChunks(solid.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      derivative[i].setConstant(std::numeric_limits<double>::quiet_NaN());
      if (const auto found = data_->inSolid->find(data_->frame.toInner(solid[i]))) {
        const Corners& t = data_->mesh.tetrahedra[found->first];
        derivative[i] = edges(data_->image, t) * edges(data_->mesh.vertices, t).inverse() / data_->frame.unit;
      }
    }
  });
}

}  // namespace polestar::bench
