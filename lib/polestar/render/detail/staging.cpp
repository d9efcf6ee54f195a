#include "polestar/render/detail/staging.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "polestar/core/error.h"

namespace polestar::detail {
namespace {

Plane cutPlane(const CutPlane& cut, const TriMesh& mesh, const Vec3& center) {
  const Vec3 normal = cut.normal.normalized();
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Vec3& v : mesh.vertices) {
    low = std::min(low, normal.dot(v));
    high = std::max(high, normal.dot(v));
  }
  const double middle = normal.dot(center);
  return {normal, middle + (cut.offset > 0 ? cut.offset * (high - middle) : cut.offset * (middle - low))};
}

Plane flipped(const Plane& plane) { return {-plane.normal, -plane.offset}; }

/// Bit i of a piece's number: which side of plane i it lies on.
std::vector<Piece> explodedPieces(const std::vector<Plane>& planes, double distance) {
  std::vector<Piece> pieces(std::size_t{1} << planes.size());
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    for (std::size_t i = 0; i < planes.size(); ++i) {
      const bool beyond = (p >> i & 1) != 0;
      pieces[p].planes.push_back(beyond ? flipped(planes[i]) : planes[i]);
      pieces[p].shift += (beyond ? 0.5 : -0.5) * distance * planes[i].normal;
    }
  }
  return pieces;
}

/// Cuts triangles along planes; neighbours share the points where a plane cuts their edge.
class Clipper {
 public:
  explicit Clipper(const TriMesh& mesh) : vertices_(mesh.vertices) {}

  struct Sides {
    std::vector<Triangle> inner, outer;
  };
  Sides split(const std::vector<Triangle>& triangles, const Plane& plane) {
    cuts_.clear();
    Sides sides;
    for (const Triangle& t : triangles) {
      std::vector<std::int32_t> inner, outer;
      for (int k = 0; k < 3; ++k) {
        const std::int32_t a = t[k], b = t[(k + 1) % 3];
        const bool isOut = plane.height(vertices_[a]) > 0;
        (isOut ? outer : inner).push_back(a);
        if (isOut == (plane.height(vertices_[b]) > 0)) continue;
        const std::int32_t cut = cutOf(a, b, plane);
        inner.push_back(cut);
        outer.push_back(cut);
      }
      addFan(inner, sides.inner);
      addFan(outer, sides.outer);
    }
    return sides;
  }
  TriMesh mesh(std::vector<Triangle> triangles) { return {std::move(vertices_), std::move(triangles)}; }

 private:
  static void addFan(const std::vector<std::int32_t>& polygon, std::vector<Triangle>& triangles) {
    for (std::size_t i = 2; i < polygon.size(); ++i)
      triangles.push_back({polygon[0], polygon[i - 1], polygon[i]});
  }

  std::int32_t cutOf(std::int32_t a, std::int32_t b, const Plane& plane) {
    const auto [entry, isNew] =
        cuts_.try_emplace(std::minmax(a, b), static_cast<std::int32_t>(vertices_.size()));
    if (isNew) {
      const double below = plane.height(vertices_[a]), above = plane.height(vertices_[b]);
      const Vec3 point = vertices_[a] + below / (below - above) * (vertices_[b] - vertices_[a]);
      vertices_.push_back(point);
    }
    return entry->second;
  }

  std::vector<Vec3> vertices_;
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> cuts_;
};

/// Those that triangles use.
TriMesh withoutSpareVertices(const TriMesh& mesh) {
  TriMesh result;
  std::vector<std::int32_t> number(mesh.vertices.size(), -1);
  for (Triangle t : mesh.triangles) {
    for (std::int32_t& v : t) {
      if (number[v] < 0) {
        number[v] = static_cast<std::int32_t>(result.vertices.size());
        result.vertices.push_back(mesh.vertices[v]);
      }
      v = number[v];
    }
    result.triangles.push_back(t);
  }
  return result;
}

}  // namespace

RenderFrame renderFrame(const TriMesh& surface) {
  if (surface.triangles.empty()) throw Error(Errc::usage, "nothing to render: the surface has no triangles");
  const Box box = boundingBox(surface);
  const double unit = 0.5 * box.diagonal();
  if (!(unit > 0) || !std::isfinite(unit))
    throw Error(Errc::usage, "nothing to render: the surface has no extent");
  return {0.5 * (box.min + box.max), unit};
}

TriMesh inRenderFrame(const TriMesh& surface, const RenderFrame& frame) {
  TriMesh mesh = surface;
  for (Vec3& v : mesh.vertices) v = frame.toRender(v);
  return mesh;
}

std::vector<Piece> cutPieces(const RenderOptions& options, const TriMesh& mesh, const Vec3& center) {
  std::vector<Plane> planes;
  for (const CutPlane& cut : options.cuts) planes.push_back(cutPlane(cut, mesh, center));
  if (planes.empty()) return {Piece()};
  if (options.cutMode == CutMode::explode) return explodedPieces(planes, options.explode);
  Piece piece;
  piece.notched = options.cutMode == CutMode::notch;
  for (const Plane& plane : planes) piece.planes.push_back(piece.notched ? flipped(plane) : plane);
  return {piece};
}

TriMesh clipped(const TriMesh& mesh, const Piece& piece) {
  Clipper clipper(mesh);
  std::vector<Triangle> within = mesh.triangles, kept;
  for (const Plane& plane : piece.planes) {
    Clipper::Sides sides = clipper.split(within, plane);
    if (piece.notched) kept.insert(kept.end(), sides.outer.begin(), sides.outer.end());
    within = std::move(sides.inner);
  }
  return withoutSpareVertices(clipper.mesh(piece.notched ? std::move(kept) : std::move(within)));
}

CameraPose cameraPose(const RenderOptions& options) {
  return {options.viewDirection, options.up.normalized(), options.fieldOfView,
          options.width,         options.height,          options.margin};
}

double keySide(const RenderOptions& options, const Camera& camera) {
  double side = 0;
  for (const CutPlane& cut : options.cuts) side += cut.normal.normalized().dot(camera.right());
  return side > 0 ? 1 : -1;
}

void require(bool holds, const std::string& what) {
  if (!holds) throw Error(Errc::usage, "render: " + what);
}

}  // namespace polestar::detail
