#include "polestar/render/iso_objects.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "polestar/core/error.h"
#include "polestar/map/iso_geometry.h"

namespace polestar {
namespace {

constexpr int kSides = 8;                // of a tube; shading normals make it round
constexpr double kLineTolerance = 5e-4;  // share of the box's diagonal: a tenth of a tube's width

// From the pole outward: hot to cold, dark at neither end.
constexpr std::array<std::uint32_t, 6> kShellColors{0xc8443c, 0xe07b39, 0xeab54d,
                                                    0x8fb96a, 0x4f9fa8, 0x4a6fa5};
constexpr std::uint32_t kLineColor = 0x8c1c24;

/// At the share t in [0, 1] of the way from the pole to the surface, scene-linear.
Vec3f shellColor(double t) {
  const double at = std::clamp(t, 0.0, 1.0) * (kShellColors.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(at), kShellColors.size() - 2);
  const auto share = static_cast<float>(at - static_cast<double>(below));
  return (1 - share) * linearFromSrgb(kShellColors[below]) + share * linearFromSrgb(kShellColors[below + 1]);
}

void append(const TriMesh& mesh, TriMesh& all) {
  const auto first = static_cast<std::int32_t>(all.vertices.size());
  all.vertices.insert(all.vertices.end(), mesh.vertices.begin(), mesh.vertices.end());
  for (const Triangle& t : mesh.triangles)
    all.triangles.push_back({first + t[0], first + t[1], first + t[2]});
}

/// Rings around a line that goes along `tangent`.
class TubeBuilder {
 public:
  explicit TubeBuilder(double radius) : radius_(radius) {}

  /// The ring turns as little as it can from one to the next [Wang et al. 2008].
  void ring(const Vec3& center, const Vec3& tangent, double scale) {
    across_ = across_.isZero() ? tangent.unitOrthogonal() : across_ - across_.dot(tangent) * tangent;
    across_.normalize();
    const Vec3 other = tangent.cross(across_);
    for (int k = 0; k < kSides; ++k) {
      const double angle = 2 * std::numbers::pi * k / kSides;
      mesh_.vertices.push_back(center +
                               scale * radius_ * (std::cos(angle) * across_ + std::sin(angle) * other));
    }
    const auto end = static_cast<std::int32_t>(mesh_.vertices.size());
    if (end == kSides) return;
    for (int k = 0; k < kSides; ++k) {
      const std::int32_t a = end - 2 * kSides + k, b = end - 2 * kSides + (k + 1) % kSides;
      mesh_.triangles.push_back({a, b, b + kSides});
      mesh_.triangles.push_back({a, b + kSides, a + kSides});
    }
  }

  TriMesh closed(const Vec3& start, const Vec3& end) {
    const auto last = static_cast<std::int32_t>(mesh_.vertices.size()) - kSides;
    const std::int32_t first = last + kSides, second = first + 1;
    mesh_.vertices.push_back(start);
    mesh_.vertices.push_back(end);
    for (int k = 0; k < kSides; ++k) {
      const int next = (k + 1) % kSides;
      mesh_.triangles.push_back({first, next, k});
      mesh_.triangles.push_back({second, last + k, last + next});
    }
    return std::move(mesh_);
  }

 private:
  double radius_;
  Vec3 across_ = Vec3::Zero();
  TriMesh mesh_;
};

}  // namespace

void IsoObjectOptions::validate() const {
  for (const double level : shells) {
    if (!(level > 0 && level < 1)) throw Error(Errc::usage, "shells are ball radii between 0 and 1");
  }
  if (lines < 0) throw Error(Errc::usage, "the number of field lines must not be negative");
  if (!(lineWidth > 0 && lineWidth < 0.2))
    throw Error(Errc::usage, "the width of lines lies between 0 and 0.2");
}

TriMesh tubeAround(std::span<const Vec3> line, double radius) {
  if (line.size() < 2) throw Error(Errc::usage, "a tube needs a line of two points at least");
  const auto leg = [&](std::size_t i) { return Vec3((line[i + 1] - line[i]).normalized()); };
  TubeBuilder tube(radius);
  const std::size_t last = line.size() - 1;
  const Vec3 first = leg(0), end = leg(last - 1);
  // Ends are round: two rings of a half ball.
  constexpr double kHalf = std::numbers::sqrt2 / 2;
  tube.ring(line[0] - kHalf * radius * first, first, kHalf);
  for (std::size_t i = 0; i <= last; ++i) {
    const Vec3 before = i > 0 ? leg(i - 1) : first, after = i < last ? leg(i) : end;
    const Vec3 tangent = (before + after).stableNormalized();
    // A mitred corner is wider across its bend; not without bounds.
    tube.ring(line[i], tangent, std::min(1.5, 1 / std::max(0.1, tangent.dot(after))));
  }
  tube.ring(line[last] + kHalf * radius * end, end, kHalf);
  return tube.closed(line[0] - radius * first, line[last] + radius * end);
}

std::vector<StageObject> isoObjects(const VolumeMap& map, const TriMesh& surface,
                                    std::span<const Vec3> directions, const IsoObjectOptions& options,
                                    Context& context) {
  options.validate();
  std::vector<StageObject> objects;
  std::vector<double> shells = options.shells;
  std::sort(shells.begin(), shells.end());
  for (std::size_t i = 0; i < shells.size(); ++i) {
    context.throwIfCancelled();
    TriMesh shell{pointsOfLevel(map, directions, shells[i]), surface.triangles};
    objects.push_back({std::move(shell), shellColor(shells[i]), 0.35f, i > 0});
  }
  if (options.lines == 0) return objects;
  const double diagonal = boundingBox(surface).diagonal();
  const double innermost = shells.empty() ? 0 : shells.front();
  const std::vector<Vec3> lines = evenDirections(static_cast<std::size_t>(options.lines));
  StageObject tubes{{}, linearFromSrgb(kLineColor), 0.5f, false};
  for (const SolidCurve& line : radialLines(map, lines, innermost, kLineTolerance * diagonal, context))
    append(tubeAround(line.solid, 0.5 * options.lineWidth * diagonal), tubes.mesh);
  objects.push_back(std::move(tubes));
  return objects;
}

}  // namespace polestar
