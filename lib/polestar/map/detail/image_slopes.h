#pragma once
// Derivatives of the map at the nodes of the foliation: what lets the table be quadratic between them.

#include <span>
#include <vector>

#include "polestar/chart/green_chart.h"
#include "polestar/map/radius_profile.h"

namespace polestar::detail {

struct ImageSlopes {
  /// d image / d node position (ball units over inner units), one a node.
  std::vector<Eigen::Matrix3f> slope;
  /// 1 where the slope holds, 0 where none could be had (creases, linear nodes, the center): the slope is
  /// then that of whatever cell is looked at. In between it is blended.
  std::vector<float> trust;
};

/// Of an image s(R) u: along the field line R falls as the field says and u changes only in the core (a
/// difference along the line); in the level's tangent plane u is a quadratic fit through the ring of lines
/// around (TangentFit). Where that finds a kink, as at creases, it is not trusted. Linear in the nodes;
/// parallel.
ImageSlopes slopesOfImages(const GreenChart& chart, std::span<const Vec3> images,
                           const RadiusProfile& profile);

}  // namespace polestar::detail
