#include "polestar/render/detail/staging.h"

#include <algorithm>
#include <cmath>

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
