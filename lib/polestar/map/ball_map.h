#pragma once
// The map of a star-shaped solid onto the unit ball: f(x) = s(R(x)) A_R(omega(x)). [Xia 2010, sec. 4.1,
// algorithm 1, where s = R; the radius s, the core and the interpolation: docs/method.md]
//
// R and omega are the canonical coordinates (chart/), A_R carries directions of field lines at the center to
// boundary parameters: A(omega of q's line) = phi(q). With A the same at all R ("paper"), f has a kink at the
// center unless A is a rotation; so by default A_R turns into the rotation closest to A within the core.
// Where phi is omega itself (`field-line`) A is the identity and needs no core.

#include <memory>
#include <optional>
#include <string>

#include "polestar/chart/green_chart.h"
#include "polestar/map/radius_profile.h"
#include "polestar/map/volume_map.h"
#include "polestar/sphere/sphere_map.h"

namespace polestar {

enum class CoreMode {
  smooth,  ///< A_R = A for R >= coreRadius, a rotation for R <= coreRadius / 4, a flip-free blend in between
  paper    ///< A_R = A everywhere
};

struct BallMapOptions {
  CoreMode core = CoreMode::smooth;
  /// In ball radii, (0, 1). Up to 2.4 times as much is used where this would turn cells inside out.
  double coreRadius = 0.25;

  void validate() const;  ///< @throws Error{Errc::usage}
};

/// Where the nodes of the foliation go.
struct NodeImages {
  std::vector<Vec3> ball;  ///< s(R) A_R(omega) in the unit ball; 0 for the center
  /// Nodes that repairs moved and that still stand for their level and line, ids, ascending: around them the
  /// map is the piecewise linear one, since the field would disagree with the table.
  std::vector<std::size_t> linear;
};

/// How the table bends between its nodes: with the map's slopes there, less where cells would fold. It
/// follows from the rest of a map; finding it is most of the work of making a table, and so a file keeps it.
struct NodeBends {
  /// In the slope at a node, [0, 1], one a node; at 0 every cell around takes its own.
  std::vector<float> trust;
  /// Corners of the cells that are linear, in G too: those around NodeImages::linear, around nodes whose G is
  /// noise, and those that would fold; ids, ascending.
  std::vector<std::size_t> straight;
};

/// The map by its table, the foliation: R from h interpolated with its gradients, directions those of the
/// piecewise linear map from the foliation's cells to their images in the ball. Cheap to copy. Frames: points
/// of the solid in mesh units, of the domain in the unit ball.
class BallMap final : public VolumeMap {
 public:
  BallMap(GreenChart chart, SphereMap sphere, const BallMapOptions& options = {}, RadiusProfile radius = {});
  /// With images that were computed before, as a file holds them; the rest says how they were made. Without
  /// `nodeBends` these are found anew.
  BallMap(GreenChart chart, SphereMap sphere, const BallMapOptions& options, RadiusProfile radius,
          NodeImages nodeImages, std::optional<NodeBends> nodeBends = std::nullopt);

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

  /// forward(), continued outside the solid by phi(q) |x - c| / |q - c|, q where the ray from the center
  /// through x leaves the solid; and G (1 / mesh units; 0 outside, +infinity at the center).
  void sample(std::span<const Vec3> solid, std::span<Vec3> domain, std::span<double> green) const;

  const GreenChart& chart() const;
  const SphereMap& sphere() const;
  const RadiusProfile& radius() const;
  /// What was built: `core` may be `paper` where `smooth` was asked; then coreFallbackReason() says why,
  /// unless phi is `field-line`.
  const BallMapOptions& options() const;
  const std::string& coreFallbackReason() const;
  /// The map is one to one when all cells are positive at the nodes and at these images. [docs/method.md,
  /// "One to one"]
  const NodeImages& nodeImages() const;
  const NodeBends& nodeBends() const;
  /// Exact counts over the cells at their images.
  const CellCounts& imageCells() const;
  /// Triangles that are not positively oriented on the sphere, summed over all levels (exact).
  std::size_t levelFlips() const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

/// The same map by tracing a field line from every point: the slow reference that the table is held against.
/// Directions pass from omega to phi on the triangles of the omega map, with slopes at their corners. The
/// inverse iterates on the forward map from the table's answer; the Jacobian is a central difference. A point
/// costs one trace, 100 to 200 evaluations of the field; in batches a quarter of the time.
class TracedBallMap final : public VolumeMap {
 public:
  explicit TracedBallMap(BallMap table);

  void forward(std::span<const Vec3> solid, std::span<Vec3> domain) const override;
  void inverse(std::span<const Vec3> domain, std::span<Vec3> solid) const override;
  void jacobian(std::span<const Vec3> solid, std::span<Mat3> derivative) const override;

  /// As BallMap::sample; points of the solid by their traces, with the field's own G. Where a trace fails, as
  /// on the surface itself, the table's answer stands: returns how many points inside that were.
  std::size_t sample(std::span<const Vec3> solid, std::span<Vec3> domain, std::span<double> green) const;

 private:
  struct Data;
  std::shared_ptr<const Data> data_;
};

}  // namespace polestar
