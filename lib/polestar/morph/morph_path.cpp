#include "polestar/morph/morph_path.h"

#include <cmath>

#include "polestar/core/detail/parallel.h"
#include "polestar/sphere/sphere_locator.h"

namespace polestar {
namespace {

constexpr std::size_t kChunk = 4096;

Vec3 logarithm(const Mat3& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

Mat3 exponential(const Vec3& turn) {
  const double angle = turn.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix() : Mat3(Mat3::Identity());
}

}  // namespace

const char* toString(PathKind kind) { return kind == PathKind::straight ? "straight" : "radial"; }

struct MorphPath::Data {
  MorphComplex complex;
  PathKind kind;
  std::vector<Vec3> turns;  ///< logarithms of the rotations
  // Of the radial path: the surfaces seen from their centers and turned back, and nodes over the distance to
  // the surface in their direction.
  std::vector<SphereLocator> surfaces;
  std::vector<std::vector<Vec3>> inBall;

  double radius(std::size_t shape, const Vec3& direction) const {
    const auto hit = surfaces[shape].locate(direction);
    return hit ? surfaces[shape].point(*hit).norm() / direction.norm() : 0;
  }
  void straight(std::span<const double> weights, std::vector<Vec3>& nodes) const;
  void radial(std::span<const double> weights, std::vector<Vec3>& nodes) const;
};

MorphPath::MorphPath(MorphComplex complex, PathKind kind) {
  auto data = std::make_shared<Data>(Data{std::move(complex), kind, {}, {}, {}});
  const std::size_t shapes = data->complex.shapeCount();
  const Foliation& ball = data->complex.ball();
  for (std::size_t s = 0; s < shapes; ++s) {
    const MorphShape& shape = data->complex.shape(s);
    data->turns.push_back(logarithm(shape.rotation));
    if (kind != PathKind::radial) continue;
    const StarShape& solid = shape.map.chart().green().shape();
    std::vector<Vec3> surface = solid.mesh().vertices;
    for (Vec3& vertex : surface) vertex = solid.frame().unit * (shape.rotation.transpose() * vertex);
    data->surfaces.emplace_back(surface, solid.mesh().triangles);
    const std::span<const Vec3> nodes = data->complex.nodes(s);
    std::vector<Vec3> inBall(nodes.begin(), nodes.end());
    detail::parallelChunks(inBall.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t id = begin; id < end; ++id) {
        if (id == ball.centerNode()) continue;
        inBall[id] = id < ball.vertexCount ? Vec3(nodes[id].normalized())
                                           : Vec3(nodes[id] / data->radius(s, nodes[id].normalized()));
      }
    });
    data->inBall.push_back(std::move(inBall));
  }
  data_ = std::move(data);
}

PathKind MorphPath::kind() const { return data_->kind; }
const MorphComplex& MorphPath::complex() const { return data_->complex; }

void MorphPath::Data::straight(std::span<const double> weights, std::vector<Vec3>& nodes) const {
  for (std::size_t s = 0; s < weights.size(); ++s) {
    if (weights[s] == 0) continue;
    const std::span<const Vec3> own = complex.nodes(s);
    detail::parallelChunks(nodes.size(), kChunk, [&](std::size_t begin, std::size_t end) {
      for (std::size_t id = begin; id < end; ++id) nodes[id] += weights[s] * own[id];
    });
  }
}

void MorphPath::Data::radial(std::span<const double> weights, std::vector<Vec3>& nodes) const {
  const std::size_t center = complex.ball().centerNode();
  detail::parallelChunks(nodes.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t id = begin; id < end; ++id) {
      if (id == center) continue;
      Vec3 mean = Vec3::Zero();
      double radius = 0;
      for (std::size_t s = 0; s < weights.size(); ++s) {
        mean += weights[s] * inBall[s][id];
        radius += weights[s] * inBall[s][id].norm();
      }
      const Vec3 direction = mean.normalized();
      double logarithm = 0;
      for (std::size_t s = 0; s < weights.size(); ++s) {
        if (weights[s] != 0) logarithm += weights[s] * std::log(this->radius(s, direction));
      }
      nodes[id] = std::exp(logarithm) * radius * direction;
    }
  });
}

MorphPose MorphPath::pose(std::span<const double> weights) const {
  const MorphComplex& complex = data_->complex;
  MorphPose pose;
  pose.nodes.assign(complex.ball().nodes.size(), Vec3::Zero());
  Vec3 turn = Vec3::Zero();
  for (std::size_t s = 0; s < weights.size(); ++s) {
    pose.center += weights[s] * complex.center(s);
    turn += weights[s] * data_->turns[s];
  }
  if (data_->kind == PathKind::straight) {
    data_->straight(weights, pose.nodes);
  } else {
    data_->radial(weights, pose.nodes);
  }
  if (turn.isZero(0)) return pose;
  const Mat3 rotation = exponential(turn);
  for (Vec3& node : pose.nodes) node = rotation * node;
  return pose;
}

MorphFrame MorphPath::frame(const MorphTimeline& timeline, double frame, double framesPerSecond,
                            const Context& context) const {
  constexpr double kStep = 1e-3;  // of a frame
  MorphFrame result;
  result.weights = timeline.weights(frame);
  result.pose = pose(result.weights);
  result.mending = mendCells(data_->complex.ball(), result.pose.nodes, context);
  result.velocity.assign(result.pose.nodes.size(), Vec3::Zero());
  const std::vector<double> rates = timeline.rates(frame);
  std::vector<double> before = result.weights, after = result.weights;
  bool moves = false;
  for (std::size_t s = 0; s < rates.size(); ++s) {
    before[s] -= kStep * rates[s];
    after[s] += kStep * rates[s];
    moves = moves || rates[s] != 0;
  }
  if (!moves) return result;
  // Weights beyond the ends go on as they came: the difference is symmetric there, too.
  const MorphPose low = pose(before), high = pose(after);
  const double scale = framesPerSecond / (2 * kStep);
  result.centerVelocity = scale * (high.center - low.center);
  detail::parallelChunks(result.velocity.size(), kChunk, [&](std::size_t begin, std::size_t end) {
    for (std::size_t id = begin; id < end; ++id)
      result.velocity[id] = result.centerVelocity + scale * (high.nodes[id] - low.nodes[id]);
  });
  return result;
}

TriMesh surfaceOf(const MorphComplex& complex, const MorphPose& pose) {
  const Foliation& ball = complex.ball();
  TriMesh mesh;
  mesh.triangles = ball.triangles;
  mesh.vertices.reserve(ball.vertexCount);
  for (std::size_t v = 0; v < ball.vertexCount; ++v) mesh.vertices.push_back(pose.center + pose.nodes[v]);
  return mesh;
}

}  // namespace polestar
