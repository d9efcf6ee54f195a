#pragma once
// What the file of a procedural texture provides, and what it gets: its parameters by name.

#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "polestar/texture/procedural.h"

namespace polestar::detail {

/// The values of a texture's parameters.
class Parameters {
 public:
  Parameters(const TextureInfo& info, std::vector<double> values) : info_(info), values_(std::move(values)) {}

  /// The name has to be one of the texture's own.
  double operator[](std::string_view name) const;
  int count(std::string_view name) const { return static_cast<int>(std::lround((*this)[name])); }
  /// Of the parameter `seed`.
  std::uint32_t seed() const { return static_cast<std::uint32_t>(std::llround((*this)["seed"])); }

 private:
  const TextureInfo& info_;
  std::vector<double> values_;
};

/// The parameter that all random textures have.
inline constexpr TextureParameter kSeedParameter{"seed", 1, 0, 1e9, "another number, another specimen"};

struct ProceduralTexture {
  TextureInfo info;
  std::unique_ptr<SolidTexture> (*make)(const Parameters& parameters);
};

/// For ProceduralTexture::make.
template <class Texture>
std::unique_ptr<SolidTexture> makeOf(const Parameters& parameters) {
  return std::make_unique<Texture>(parameters);
}

ProceduralTexture agate();
ProceduralTexture granite();
ProceduralTexture kiwi();
ProceduralTexture marble();
ProceduralTexture orange();
ProceduralTexture soccer();
ProceduralTexture treeRings();
ProceduralTexture watermelon();

}  // namespace polestar::detail
