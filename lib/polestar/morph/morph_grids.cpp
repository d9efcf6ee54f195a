#include "polestar/morph/morph_grids.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "polestar/core/version.h"
#include "polestar/morph/detail/cell_raster.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {
namespace {

using detail::CellRaster;

/// A voxel's place in the complex.
struct Place {
  CellRaster::Cell cell{};
  CellRaster::Weights weights{};
  CellRaster::Gradients gradients;  ///< 1 / voxel
  /// Distance from the center over that of the surface where the place is on the surface for a voxel beyond.
  double stretch = 1;
  bool known = false;
};

class FrameSampler {
 public:
  FrameSampler(const MorphComplex& complex, const MorphFrame& frame, std::span<const MorphTexture> textures,
               const MorphGridOptions& options, const SolidGrids& grids)
      : complex_(complex),
        ball_(complex.ball()),
        frame_(frame),
        textures_(textures),
        options_(options),
        index_(indexNodes(frame.pose, grids)),
        raster_(ball_, index_),
        surface_(std::span(frame.pose.nodes).first(ball_.vertexCount), ball_.triangles) {}

  void sample(const VoxelBatch& batch, AttributeValues& values) const {
    std::vector<Place> places(batch.points.size());
    locate(batch, places);
    fillRest(places, values.vectors(0));
    std::size_t attribute = 1;
    if (options_.velocity) fillVelocity(places, values.vectors(attribute++));
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (places[i].known) continue;
      for (std::size_t a = 0; a < attribute; ++a) values.active(a)[i] = 0;
    }
    if (textures_.empty()) return;
    std::vector<Vec3f> colors(places.size(), Vec3f::Zero());
    std::vector<std::uint8_t> active(places.size(), 0);
    fillColors(places, values.vectors(0), colors, active);
    for (std::size_t n = 0; n < gridsOfColor(options_.colorNames).size(); ++n, ++attribute) {
      std::copy(colors.begin(), colors.end(), values.vectors(attribute).begin());
      std::copy(active.begin(), active.end(), values.active(attribute).begin());
    }
  }

 private:
  static std::vector<Vec3> indexNodes(const MorphPose& pose, const SolidGrids& grids) {
    const Vec3 shift = pose.center - grids.indexToWorld(Vec3::Zero());
    std::vector<Vec3> nodes(pose.nodes.size());
    for (std::size_t id = 0; id < nodes.size(); ++id)
      nodes[id] = (pose.nodes[id] + shift) / grids.voxelSize();
    return nodes;
  }

  void locate(const VoxelBatch& batch, std::vector<Place>& places) const {
    constexpr int kLeafVoxels = CellRaster::kLeafSize * CellRaster::kLeafSize * CellRaster::kLeafSize;
    std::array<int, kLeafVoxels> pointAt{};
    pointAt.fill(-1);
    for (std::size_t i = 0; i < batch.places.size(); ++i) pointAt[batch.places[i]] = static_cast<int>(i);
    raster_.visitLeaf(
        batch.first, [&](int place, const CellRaster::Cell& cell, const CellRaster::Weights& weights,
                         const CellRaster::Gradients& gradients) {
          if (pointAt[place] < 0) return;
          places[static_cast<std::size_t>(pointAt[place])] = {cell, weights, gradients, 1, true};
        });
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!places[i].known) places[i] = onSurface(batch.points[i], batch.signedDistance[i] < 0);
    }
  }

  /// Where the ray from the center through x leaves the solid, with the slopes of the cell below.
  Place onSurface(const Vec3& x, bool inside) const {
    Place place;
    const Vec3 ray = x - frame_.pose.center;
    const auto hit = surface_.locate(ray);
    if (!hit) return place;
    const Triangle& t = ball_.triangles[hit->triangle];
    // The last cell of a prism has all three corners of the outer triangle.
    place.cell = ball_.cell(3 * hit->triangle + 2);
    for (int k = 0; k < 4; ++k) {
      for (int corner = 0; corner < 3; ++corner) {
        if (place.cell[k] == static_cast<std::uint32_t>(t[corner])) place.weights[k] = hit->weights[corner];
      }
    }
    const Vec3& a = index_[place.cell[0]];
    const std::array<Vec3, 3> edge{index_[place.cell[1]] - a, index_[place.cell[2]] - a,
                                   index_[place.cell[3]] - a};
    const Vec3 across = edge[1].cross(edge[2]);
    const double volume = edge[0].dot(across);
    place.gradients = {Vec3::Zero(), across / volume, edge[2].cross(edge[0]) / volume,
                       edge[0].cross(edge[1]) / volume};
    place.gradients[0] = -(place.gradients[1] + place.gradients[2] + place.gradients[3]);
    place.stretch = ray.norm() / surface_.point(*hit).norm();
    if (inside) place.stretch = std::min(place.stretch, 1.0);  // by rounding in no cell
    place.known = true;
    return place;
  }

  double level(std::uint32_t node) const {
    return node == ball_.centerNode() ? 0 : ball_.levels[node / ball_.vertexCount];
  }

  void fillRest(const std::vector<Place>& places, std::span<Vec3f> rest) const {
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Place& place = places[i];
      Vec3 mean = Vec3::Zero();
      double radius = 0;
      for (int k = 0; k < 4; ++k) {
        mean += place.weights[k] * ball_.nodes[place.cell[k]];
        radius += place.weights[k] * level(place.cell[k]);
      }
      const double length = mean.norm();
      if (length > 0) rest[i] = (place.stretch * radius / length * mean).cast<float>();
    }
  }

  void fillVelocity(const std::vector<Place>& places, std::span<Vec3f> velocity) const {
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!places[i].known) continue;
      Vec3 mean = Vec3::Zero();
      for (int k = 0; k < 4; ++k) mean += places[i].weights[k] * frame_.velocity[places[i].cell[k]];
      velocity[i] =
          Vec3(frame_.centerVelocity + places[i].stretch * (mean - frame_.centerVelocity)).cast<float>();
    }
  }

  void fillColors(const std::vector<Place>& places, std::span<const Vec3f> rest, std::vector<Vec3f>& colors,
                  std::vector<std::uint8_t>& active) const {
    std::vector<float> total(places.size(), 0);
    std::vector<Vec3f> own(places.size());
    std::vector<float> share(places.size());
    for (std::size_t s = 0; s < textures_.size(); ++s) {
      const auto weight = static_cast<float>(frame_.weights[s]);
      if (weight == 0) continue;
      if (textures_[s].solid) {
        sampleSolid(s, places, rest, own);
        std::fill(share.begin(), share.end(), 1.0F);
      } else {
        sampleGrid(textures_[s], places, own, share);
      }
      for (std::size_t i = 0; i < places.size(); ++i) {
        const float w = places[i].known && share[i] > 0 ? weight : 0;
        colors[i] += w * own[i];
        total[i] += w;
      }
    }
    for (std::size_t i = 0; i < places.size(); ++i) {
      active[i] = total[i] > 0;
      if (active[i]) colors[i] /= total[i];
    }
  }

  template <class NodePlace>
  static Mat3 slope(const Place& place, NodePlace&& at) {
    Mat3 slope = Mat3::Zero();
    for (int k = 0; k < 4; ++k) slope += at(place.cell[k]) * place.gradients[k].transpose();
    return slope;
  }

  void sampleSolid(std::size_t shape, const std::vector<Place>& places, std::span<const Vec3f> rest,
                   std::vector<Vec3f>& colors) const {
    std::vector<Vec3> ball(places.size());
    std::vector<TexturePoint> points(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      ball[i] = rest[i].cast<double>() / std::max(1.0, static_cast<double>(rest[i].norm()));
      if (places[i].known)
        points[i].footprint = slope(places[i], [&](std::uint32_t node) { return ball_.nodes[node]; });
    }
    if (const VolumeMap* motion = complex_.shape(shape).motion.get()) {
      std::vector<Mat3> derivative(ball.size());
      motion->jacobian(ball, derivative);
      for (std::size_t i = 0; i < ball.size(); ++i) points[i].footprint = derivative[i] * points[i].footprint;
      const std::vector<Vec3> common = ball;
      motion->forward(common, ball);
    }
    for (std::size_t i = 0; i < ball.size(); ++i) points[i].ball = ball[i] / std::max(1.0, ball[i].norm());
    std::vector<TextureSample> samples(points.size());
    textures_[shape].solid->sample(points, samples);
    for (std::size_t i = 0; i < samples.size(); ++i) colors[i] = samples[i].color;
  }

  static void sampleGrid(const MorphTexture& texture, const std::vector<Place>& places,
                         std::vector<Vec3f>& colors, std::vector<float>& share) {
    std::vector<Vec3> world(places.size(), Vec3::Zero());
    std::vector<Mat3> footprints(places.size(), Mat3::Zero());
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!places[i].known) continue;
      for (int k = 0; k < 4; ++k) world[i] += places[i].weights[k] * texture.places[places[i].cell[k]];
      footprints[i] = slope(places[i], [&](std::uint32_t node) { return texture.places[node]; });
    }
    texture.colors->sample(world, footprints, colors, share);
  }

  const MorphComplex& complex_;
  const Foliation& ball_;
  const MorphFrame& frame_;
  std::span<const MorphTexture> textures_;
  const MorphGridOptions& options_;
  std::vector<Vec3> index_;
  CellRaster raster_;
  SphereLocator surface_;
};

std::vector<Attribute> attributesOf(const MorphGridOptions& options, bool colored) {
  std::vector<Attribute> attributes{{.name = "rest", .vector = true}};
  if (options.velocity) {
    attributes.push_back(
        {.name = "vel", .vector = true, .role = ValueRole::contravariant, .half = options.half});
  }
  if (!colored) return attributes;
  for (const std::string& name : gridsOfColor(options.colorNames))
    attributes.push_back({.name = name, .vector = true, .half = options.half});
  return attributes;
}

}  // namespace

SolidGrids morphGrids(const MorphComplex& complex, const MorphFrame& frame,
                      std::span<const MorphTexture> textures, const MorphGridOptions& options,
                      Context& context) {
  SolidGrids grids(surfaceOf(complex, frame.pose), options.grids, context);
  const FrameSampler sampler(complex, frame, textures, options, grids);
  grids.add(
      attributesOf(options, !textures.empty()),
      [&](const VoxelBatch& batch, AttributeValues& values) { sampler.sample(batch, values); }, true,
      context);
  std::string weights;
  for (const double weight : frame.weights) weights += (weights.empty() ? "" : ",") + std::to_string(weight);
  grids.setMetadata("polestar:version", std::string(kVersion));
  grids.setMetadata("polestar:domain", std::string("ball"));
  grids.setMetadata("polestar:center", frame.pose.center);
  grids.setMetadata("polestar:weights", weights);
  return grids;
}

}  // namespace polestar
