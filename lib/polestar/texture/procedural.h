#pragma once
// Procedural solid textures in ball coordinates, by name: fruit, wood, stone and a soccer ball. Each is a
// function of the point and of a few named parameters; docs/textures.md tells how one is written.

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "polestar/texture/solid_texture.h"

namespace polestar {

/// A number that shapes a texture. Lengths are in ball radii unless the description says otherwise.
struct TextureParameter {
  std::string_view name;
  double defaultValue = 0;
  double min = 0, max = 1;
  std::string_view description;  ///< one line
};

struct TextureInfo {
  std::string_view name;
  std::string_view description;  ///< one line
  std::vector<TextureParameter> parameters;
};

/// All there are, by name.
std::span<const TextureInfo> proceduralTextures();

/// Names and values of parameters that differ from their defaults.
using TextureSettings = std::vector<std::pair<std::string, double>>;

/// The texture of that name. The same name and settings give the same texture on every machine, but for
/// rounding.
/// @throws Error{Errc::usage} for a name that is not there, with those that are, and for a value out of its
/// range.
std::unique_ptr<SolidTexture> makeTexture(std::string_view name, const TextureSettings& settings = {});

}  // namespace polestar
