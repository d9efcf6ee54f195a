#include "support.h"

#include <Eigen/Geometry>

#include "polestar/texture/procedural.h"

namespace polestar::testing {

std::vector<Vec3> randomPoints(std::size_t count, double half, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-half, half);
  std::vector<Vec3> points(count);
  for (Vec3& p : points) {
    for (int axis = 0; axis < 3; ++axis) p[axis] = uniform(generator);
  }
  return points;
}

std::vector<Vec3> randomBallPoints(std::size_t count, unsigned seed) {
  std::vector<Vec3> inside;
  for (const Vec3& p : randomPoints(3 * count, 1, seed)) {
    if (p.norm() <= 1 && inside.size() < count) inside.push_back(p);
  }
  return inside;
}

std::vector<Vec3> randomDirections(std::size_t count, unsigned seed) {
  std::mt19937 generator(seed);
  std::normal_distribution<double> normal;
  std::vector<Vec3> directions(count);
  for (Vec3& d : directions) {
    for (int axis = 0; axis < 3; ++axis) d[axis] = normal(generator);
    d.normalize();
  }
  return directions;
}

Mat3 randomFootprint(double size, std::mt19937& generator) {
  std::normal_distribution<double> normal;
  Eigen::Quaterniond turn(normal(generator), normal(generator), normal(generator), normal(generator));
  turn.normalize();
  return turn.toRotationMatrix() * Vec3(size, size / 2, size / 4).asDiagonal();
}

std::vector<std::string_view> textureNames() {
  std::vector<std::string_view> names;
  for (const TextureInfo& info : proceduralTextures()) names.push_back(info.name);
  return names;
}

std::string nameOfTest(const ::testing::TestParamInfo<std::string_view>& texture) {
  std::string name(texture.param);
  std::erase(name, '-');
  return name;
}

Vec3f colorAt(const SolidTexture& texture, const Vec3& ball, const Mat3& footprint) {
  const TexturePoint point{ball, footprint};
  TextureSample sample;
  texture.sample({&point, 1}, {&sample, 1});
  return sample.color;
}

Vec3f supersample(const SolidTexture& texture, const TexturePoint& point, int count, unsigned seed) {
  std::vector<TexturePoint> points;
  for (const Vec3& offset : randomPoints(count, 0.5, seed)) {
    points.push_back({point.ball + point.footprint * offset, Mat3::Zero()});
  }
  std::vector<TextureSample> samples(points.size());
  texture.sample(points, samples);
  Vec3f sum = Vec3f::Zero();
  for (const TextureSample& sample : samples) sum += sample.color;
  return sum / static_cast<float>(count);
}

}  // namespace polestar::testing
