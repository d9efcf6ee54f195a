#include "polestar/texture/procedural.h"

#include <algorithm>
#include <numeric>
#include <sstream>
#include <stdexcept>

#include "polestar/core/error.h"
#include "polestar/texture/detail/procedural_texture.h"

namespace polestar {
namespace {

const std::vector<detail::ProceduralTexture>& catalog() {
  static const std::vector<detail::ProceduralTexture> all = {
      detail::agate(),  detail::granite(), detail::kiwi(),      detail::marble(),
      detail::orange(), detail::soccer(),  detail::treeRings(), detail::watermelon()};
  return all;
}

/// Insertions, deletions and replacements that make one name the other (Levenshtein).
std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), 0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] != b[j]);
      diagonal = row[j + 1];
      row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, replaced});
    }
  }
  return row.back();
}

/// `kind` is "texture" or "parameter of kiwi"; a name that differs in up to a third of its letters is
/// offered.
[[noreturn]] void refuseName(const std::string& kind, std::string_view wrong,
                             const std::vector<std::string_view>& names) {
  std::ostringstream message;
  message << "there is no " << kind << " '" << wrong << "'";
  const auto nearest = std::min_element(names.begin(), names.end(), [&](auto a, auto b) {
    return editDistance(a, wrong) < editDistance(b, wrong);
  });
  if (editDistance(*nearest, wrong) <= std::max<std::size_t>(2, nearest->size() / 3)) {
    message << "; did you mean '" << *nearest << "'?";
  }
  message << "\nthere are: ";
  for (std::size_t i = 0; i < names.size(); ++i) message << (i ? ", " : "") << names[i];
  throw Error(Errc::usage, message.str());
}

const detail::ProceduralTexture& findTexture(std::string_view name) {
  std::vector<std::string_view> names;
  for (const detail::ProceduralTexture& texture : catalog()) {
    if (texture.info.name == name) return texture;
    names.push_back(texture.info.name);
  }
  refuseName("texture", name, names);
}

std::size_t findParameter(const TextureInfo& info, std::string_view name) {
  std::vector<std::string_view> names;
  for (std::size_t i = 0; i < info.parameters.size(); ++i) {
    if (info.parameters[i].name == name) return i;
    names.push_back(info.parameters[i].name);
  }
  refuseName("parameter of " + std::string(info.name), name, names);
}

}  // namespace

double detail::Parameters::operator[](std::string_view name) const {
  for (std::size_t i = 0; i < values_.size(); ++i) {
    if (info_.parameters[i].name == name) return values_[i];
  }
  throw std::logic_error("texture " + std::string(info_.name) + " has no parameter " + std::string(name));
}

std::span<const TextureInfo> proceduralTextures() {
  static const std::vector<TextureInfo> infos = [] {
    std::vector<TextureInfo> all;
    for (const detail::ProceduralTexture& texture : catalog()) all.push_back(texture.info);
    return all;
  }();
  return infos;
}

std::unique_ptr<SolidTexture> makeTexture(std::string_view name, const TextureSettings& settings) {
  const detail::ProceduralTexture& texture = findTexture(name);
  std::vector<double> values;
  for (const TextureParameter& parameter : texture.info.parameters) values.push_back(parameter.defaultValue);
  for (const auto& [key, value] : settings) {
    const std::size_t i = findParameter(texture.info, key);
    const TextureParameter& parameter = texture.info.parameters[i];
    if (!(value >= parameter.min && value <= parameter.max)) {
      std::ostringstream message;
      message << "'" << key << "' of " << name << " has to be from " << parameter.min << " to "
              << parameter.max << ", not " << value << " (" << parameter.description << ")";
      throw Error(Errc::usage, message.str());
    }
    values[i] = value;
  }
  return texture.make(detail::Parameters(texture.info, std::move(values)));
}

}  // namespace polestar
