#include "pmap_maps.h"

#include <xxhash.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "polestar/map/map_file.h"
#include "polestar/mesh/shapes.h"
#include "support/scratch_folder.h"
#include "support/solids.h"

namespace polestar::testing {

const BallMap& smallMap() {
  static const BallMap map = ballMap(
      starShape(transformed(smoothStar(2), [](const Vec3& p) { return Vec3(0.1 * p + Vec3(5, 6, 7)); })));
  return map;
}

verify::PmapContents contentsOf(const BallMap& map) {
  const test::ScratchFolder folder;
  writeMapFile(folder / "map.pmap", map);
  return verify::readPmap(folder / "map.pmap");
}

void fillLevels(verify::PmapContents& map, std::size_t levels) {
  map.levels = levels;
  map.radii.clear();
  map.nodes.clear();
  map.ball.clear();
  for (std::size_t level = 0; level < levels; ++level) {
    const double radius = 1 - static_cast<double>(level) / static_cast<double>(levels);
    map.radii.push_back(radius);
    for (const verify::Vec3& v : map.vertices) {
      map.nodes.push_back(radius * v);
      map.ball.push_back((radius / length(v)) * v);
    }
  }
  map.nodes.push_back({});
  map.ball.push_back({});
}

verify::PmapContents coneMap(const TriMesh& mesh, std::size_t levels) {
  verify::PmapContents map;
  for (const Vec3& v : mesh.vertices) map.vertices.push_back({v.x(), v.y(), v.z()});
  for (const Triangle& t : mesh.triangles) map.triangles.push_back({t[0], t[1], t[2]});
  fillLevels(map, levels);
  return map;
}

PmapBytes::PmapBytes(const std::filesystem::path& path) {
  const std::string bytes = test::bytesOf(path);
  std::uint32_t length = 0;
  std::memcpy(&format, bytes.data() + 8, sizeof format);
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  auto json = nlohmann::json::parse(bytes.substr(16, length));
  json.erase("hash");
  header = json.dump();
  data = bytes.substr((16 + length + 63) / 64 * 64);
  for (const auto& entry : json["arrays"]) {
    arrays.push_back({entry["name"], entry["type"],
                      entry["shape"][0].get<std::size_t>() * entry["shape"][1].get<std::size_t>(),
                      entry["offset"]});
  }
}

void PmapBytes::write(const std::filesystem::path& path) const {
  auto json = nlohmann::json::parse(header);
  std::string signedBytes = json.dump() + data;
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits(signedBytes.data(), signedBytes.size()));
  std::string hash;
  for (const unsigned char byte : canonical.digest) {
    for (const int half : {byte >> 4, byte & 15}) hash += "0123456789abcdef"[half];
  }
  json["hash"] = hash;
  const std::string text = json.dump();
  const std::uint32_t numbers[2] = {format, static_cast<std::uint32_t>(text.size())};
  std::string bytes = "POLESTAR" + std::string(reinterpret_cast<const char*>(numbers), sizeof numbers) + text;
  bytes.resize((bytes.size() + 63) / 64 * 64, '\0');
  test::writeBytes(path, bytes + data);
}

}  // namespace polestar::testing
