#include "polestar/morph/frame_proof.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "polestar/core/covering_number.h"
#include "polestar/core/detail/parallel.h"
#include "polestar/mesh/self_intersection.h"

namespace polestar {
namespace {

using Edges = std::array<Vec3, 3>;
using Cubic = std::array<double, 4>;  // Bernstein coefficients

constexpr int kHalvings = 6;
/// Of the product of the largest components of a cell's edges: a determinant of differences, means of six and
/// the halvings add up to less than 2^-47 of it.
constexpr double kRounding = 0x1p-45;

double det(const Vec3& a, const Vec3& b, const Vec3& c) { return a.dot(b.cross(c)); }

// det(p + t (q - p)), edge by edge: every coefficient is a mean of determinants of edges at both ends.
Cubic volumeOverTime(const Edges& p, const Edges& q) {
  return {det(p[0], p[1], p[2]), (det(q[0], p[1], p[2]) + det(p[0], q[1], p[2]) + det(p[0], p[1], q[2])) / 3,
          (det(p[0], q[1], q[2]) + det(q[0], p[1], q[2]) + det(q[0], q[1], p[2])) / 3, det(q[0], q[1], q[2])};
}

bool positive(const Cubic& b, double bound, int halvings) {
  if (*std::min_element(b.begin(), b.end()) > bound) return true;
  if (!(b[0] > bound && b[3] > bound) || halvings == 0) return false;
  const double b01 = (b[0] + b[1]) / 2, b12 = (b[1] + b[2]) / 2, b23 = (b[2] + b[3]) / 2;
  const double b012 = (b01 + b12) / 2, b123 = (b12 + b23) / 2, middle = (b012 + b123) / 2;
  return positive({b[0], b01, b012, middle}, bound, halvings - 1) &&
         positive({middle, b123, b23, b[3]}, bound, halvings - 1);
}

Edges edgesOf(std::span<const Vec3> nodes, const std::array<std::uint32_t, 4>& cell) {
  return {nodes[cell[1]] - nodes[cell[0]], nodes[cell[2]] - nodes[cell[0]], nodes[cell[3]] - nodes[cell[0]]};
}

double largestProduct(const Edges& p, const Edges& q) {
  double product = 1;
  for (int k = 0; k < 3; ++k)
    product *= std::max(p[k].lpNorm<Eigen::Infinity>(), q[k].lpNorm<Eigen::Infinity>());
  return product;
}

}  // namespace

const char* toString(Embedding embedding) {
  switch (embedding) {
    case Embedding::starShaped:
      return "star-shaped";
    case Embedding::noCrossing:
      return "no-crossing";
    case Embedding::none:
      break;
  }
  return "none";
}

std::string FrameProof::fault() const {
  std::ostringstream text;
  text.precision(6);
  if (cells.bad() > 0) {
    text << cells.bad() << " of " << cells.cells << " tetrahedra are inverted or flat";
    if (firstBad)
      text << ", the first around (" << firstBad->x() << ", " << firstBad->y() << ", " << firstBad->z()
           << ")";
  } else if (crossings > 0) {
    text << "the surface runs through itself in " << crossings << " pairs of triangles";
  } else if (embedding == Embedding::none) {
    text << "the surface winds around its center " << winding << " times";
  }
  return text.str();
}

FrameProof proveFrame(const MorphComplex& complex, const MorphPose& pose) {
  const Foliation& ball = complex.ball();
  const auto surface = std::span(pose.nodes).first(ball.vertexCount);
  FrameProof proof;
  proof.cells = countCells(ball, pose.nodes);
  if (proof.cells.bad() > 0) {
    Vec3 sum = Vec3::Zero();
    for (const std::uint32_t node : ball.cell(badCells(ball, pose.nodes).front())) sum += pose.nodes[node];
    proof.firstBad = pose.center + sum / 4;
  }
  proof.hiddenTriangles = countFlips(surface, ball.triangles);
  proof.winding = coveringNumber(surface, ball.triangles);
  const TriMesh mesh{{surface.begin(), surface.end()}, ball.triangles};
  proof.volume = volumeProperties(mesh).volume;
  if (proof.winding != 1) return proof;
  if (proof.hiddenTriangles == 0) {
    proof.embedding = Embedding::starShaped;
  } else {
    proof.crossings = findSelfIntersections(mesh).pairs;
    if (proof.crossings == 0) proof.embedding = Embedding::noCrossing;
  }
  return proof;
}

PassageProof provePassage(const MorphComplex& complex, std::size_t from, std::size_t to) {
  const Foliation& ball = complex.ball();
  const std::span<const Vec3> first = complex.nodes(from), last = complex.nodes(to);
  PassageProof proof{.cells = ball.cellCount()};
  proof.open = detail::reduceChunks(
      proof.cells, 1 << 14, std::size_t{0},
      [&](std::size_t begin, std::size_t end) {
        std::size_t open = 0;
        for (std::size_t id = begin; id < end; ++id) {
          const auto cell = ball.cell(id);
          const Edges p = edgesOf(first, cell), q = edgesOf(last, cell);
          open += !positive(volumeOverTime(p, q), kRounding * largestProduct(p, q), kHalvings);
        }
        return open;
      },
      [](std::size_t a, std::size_t b) { return a + b; });
  return proof;
}

}  // namespace polestar
