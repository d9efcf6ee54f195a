#pragma once
// Seeded points and footprints for the tests of textures.

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "polestar/texture/solid_texture.h"

namespace polestar::testing {

/// Uniform in the box [-half, half]^3.
std::vector<Vec3> randomPoints(std::size_t count, double half, unsigned seed);

/// Uniform in the ball.
std::vector<Vec3> randomBallPoints(std::size_t count, unsigned seed);

/// Unit vectors.
std::vector<Vec3> randomDirections(std::size_t count, unsigned seed);

/// A turned box with edges of `size`, `size` / 2 and `size` / 4.
Mat3 randomFootprint(double size, std::mt19937& generator);

/// Of all procedural textures, for tests that run over them.
std::vector<std::string_view> textureNames();
std::string nameOfTest(const ::testing::TestParamInfo<std::string_view>& texture);

/// Color at one point.
Vec3f colorAt(const SolidTexture& texture, const Vec3& ball, const Mat3& footprint = Mat3::Zero());

/// Mean of `count` samples at points in the footprint.
Vec3f supersample(const SolidTexture& texture, const TexturePoint& point, int count, unsigned seed);

}  // namespace polestar::testing
