#include "pmap_file.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>

#include "report.h"

namespace polestar::verify {
namespace {

using nlohmann::json;

constexpr char kMagic[8] = {'P', 'O', 'L', 'E', 'S', 'T', 'A', 'R'};
constexpr std::uint32_t kOldestFormat = 2, kBallFormat = 3, kFormat = 4;
constexpr std::size_t kPreamble = 16, kAlignment = 64;

struct Bytes {
  std::vector<char> all;
  json header;
  std::uint32_t format = 0;
  std::size_t data = 0;  ///< where the arrays begin
};

struct Array {
  std::string name, type;
  std::size_t rows = 0, columns = 0;
  const char* begin = nullptr;
};

std::vector<char> readAll(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::is_regular_file(path, code)) {
    throw Unreadable(code ? code.message() : "it is not a regular file");
  }
  std::vector<char> bytes(std::filesystem::file_size(path, code));
  std::ifstream in(path, std::ios::binary);
  if (code || !in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    throw Unreadable("it cannot be read to its end");
  }
  return bytes;
}

std::string hashOf(const std::string& header, const char* data, std::size_t size) {
  const std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_128bits_reset(state.get());
  XXH3_128bits_update(state.get(), header.data(), header.size());
  XXH3_128bits_update(state.get(), data, size);
  XXH128_canonical_t canonical;
  XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state.get()));
  std::string text;
  for (const unsigned char byte : canonical.digest) {
    for (const int half : {byte >> 4, byte & 15}) text += "0123456789abcdef"[half];
  }
  return text;
}

Bytes parse(const std::filesystem::path& path) {
  Bytes file;
  file.all = readAll(path);
  const std::size_t size = file.all.size();
  if (size < kPreamble || std::memcmp(file.all.data(), kMagic, sizeof kMagic) != 0) {
    throw Unreadable("it is no .pmap (no POLESTAR signature)");
  }
  std::uint32_t length = 0;
  std::memcpy(&file.format, file.all.data() + 8, sizeof file.format);
  std::memcpy(&length, file.all.data() + 12, sizeof length);
  if (file.format < kOldestFormat || file.format > kFormat) {
    throw Unreadable("it has .pmap format " + std::to_string(file.format) + ", this program judges " +
                     std::to_string(kOldestFormat) + " to " + std::to_string(kFormat) +
                     "; make the map again with polestar map");
  }
  if (length > size - kPreamble) throw Unreadable("it ends within its header");
  const char* text = file.all.data() + kPreamble;
  file.header = json::parse(text, text + length, nullptr, false);
  if (!file.header.is_object() || !file.header.contains("hash")) throw Unreadable("its header is damaged");
  file.data = std::min((kPreamble + length + kAlignment - 1) / kAlignment * kAlignment, size);
  json others = file.header;
  others.erase("hash");
  if (std::any_of(text + length, static_cast<const char*>(file.all.data()) + file.data,
                  [](char byte) { return byte != 0; })) {
    throw Unreadable("it is damaged: there is something between its header and its arrays");
  }
  if (file.header["hash"] != hashOf(others.dump(), file.all.data() + file.data, size - file.data)) {
    throw Unreadable("it is damaged: its hash does not match");
  }
  return file;
}

std::vector<Array> arraysOf(const Bytes& file) {
  std::vector<Array> arrays;
  for (const json& entry : file.header.at("arrays")) {
    Array array{entry.at("name"), entry.at("type"), entry.at("shape").at(0), entry.at("shape").at(1)};
    const std::size_t bytes = array.type == "int32" || array.type == "float32"    ? 4
                              : array.type == "float64" || array.type == "uint64" ? 8
                                                                                  : 0;
    if (bytes == 0) continue;  // of a later version, and no concern of ours
    const std::size_t offset = entry.at("offset"), available = file.all.size() - file.data;
    if (array.columns == 0 || array.columns > 64 || offset > available ||
        array.rows > (available - offset) / (array.columns * bytes)) {
      throw Unreadable("its array '" + array.name + "' is larger than the file");
    }
    array.begin = file.all.data() + file.data + offset;
    arrays.push_back(array);
  }
  return arrays;
}

/// `rows`: how many there have to be; 0: any number.
template <class Row>
std::vector<Row> take(const std::vector<Array>& arrays, const std::string& name, const std::string& type,
                      std::size_t rows, std::size_t columns = 3) {
  for (const Array& array : arrays) {
    if (array.name != name) continue;
    if (array.type != type || array.columns != columns || (rows != 0 && array.rows != rows)) {
      throw Unreadable("its array '" + name + "' has the wrong type or size");
    }
    std::vector<Row> values(array.rows);
    if (array.rows > 0) {
      std::memcpy(static_cast<void*>(values.data()), array.begin, array.rows * sizeof(Row));
    }
    return values;
  }
  throw Unreadable("its array '" + name + "' is missing");
}

/// 1 for nodes that the list names; empty when it names none, or when there is no such list.
std::vector<char> namedNodes(const std::vector<Array>& arrays, const std::string& list, std::size_t nodes) {
  std::vector<char> named;
  if (std::none_of(arrays.begin(), arrays.end(), [&](const Array& a) { return a.name == list; }))
    return named;
  for (const std::uint64_t id : take<std::uint64_t>(arrays, list, "uint64", 0, 1)) {
    if (id >= nodes) throw Unreadable("its array '" + list + "' names a node that is not there");
    named.resize(nodes, 0);
    named[id] = 1;
  }
  return named;
}

/// Of how the table bends between the nodes, which is no part of the theorem: that a program which evaluates
/// it can make sense of the file.
void checkBends(const std::vector<Array>& arrays, std::size_t nodes) {
  const std::vector<float> trust = take<float>(arrays, "slope_trust", "float32", nodes, 1);
  const std::vector<char> straight = namedNodes(arrays, "straight_nodes", nodes);
  for (std::size_t id = 0; id < nodes; ++id) {
    if (std::isnan(trust[id])) continue;  // counted among what is not finite
    if (!(trust[id] >= 0 && trust[id] <= 1)) {
      throw Unreadable("its slope_trust of node " + std::to_string(id) + " lies outside of [0, 1]");
    }
    if (!straight.empty() && straight[id] && trust[id] > 0) {
      throw Unreadable("node " + std::to_string(id) + " is one of straight_nodes and has a slope_trust");
    }
  }
}

template <class Number>
void countNotFinite(const Array& array, BallMapContents& contents) {
  for (std::size_t i = 0; i < array.rows * array.columns; ++i) {
    Number value = 0;
    std::memcpy(&value, array.begin + sizeof value * i, sizeof value);
    if (std::isfinite(value)) continue;
    if (contents.notFinite++ == 0) {
      contents.firstNotFinite = array.name + " row " + std::to_string(i / array.columns);
    }
  }
}

void countNotFinite(const std::vector<Array>& arrays, BallMapContents& contents) {
  for (const Array& array : arrays) {
    if (array.type == "float64") countNotFinite<double>(array, contents);
    if (array.type == "float32") countNotFinite<float>(array, contents);
  }
}

Vec3 vec3Of(const json& list) {
  Vec3 v;
  for (int k = 0; k < 3; ++k) v[k] = list.at(static_cast<std::size_t>(k));
  return v;
}

/// The arrays of one of a file's two maps, by their names without what tells the two apart.
std::vector<Array> arraysNamed(const std::vector<Array>& all, const std::string& prefix) {
  std::vector<Array> found;
  for (Array array : all) {
    if (!array.name.starts_with(prefix)) continue;
    array.name.erase(0, prefix.size());
    found.push_back(std::move(array));
  }
  return found;
}

BallMapContents readBallMap(const Bytes& file, const json& header, const std::vector<Array>& arrays) {
  BallMapContents contents;
  contents.vertices = take<Vec3>(arrays, "vertices", "float64", 0);
  contents.triangles = take<Triangle>(arrays, "triangles", "int32", 0);
  const std::size_t n = contents.vertices.size();
  for (const Triangle& t : contents.triangles) {
    for (const std::int32_t v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= n) {
        throw Unreadable("a triangle names vertex " + std::to_string(v) + ", which is not there");
      }
    }
  }
  contents.radii = header.at("levels").get<std::vector<double>>();
  contents.levels = contents.radii.size();
  contents.radiusIsOfGreen = !header.contains("radius") || header["radius"].at("kind") == "green";
  if (contents.levels == 0) throw Unreadable("it has no levels");
  if (n > file.all.size() || contents.levels > file.all.size()) throw Unreadable("it has impossible sizes");
  contents.nodes = take<Vec3>(arrays, "nodes_inner", "float64", contents.levels * n + 1);
  contents.ball = take<Vec3>(arrays, "ball", "float64", contents.levels * n + 1);
  contents.moved = namedNodes(arrays, "moved_nodes", contents.nodes.size());
  // The hash does not cover the format.
  const bool hasBends = std::any_of(arrays.begin(), arrays.end(),
                                    [](const Array& array) { return array.name == "slope_trust"; });
  if (hasBends != (file.format > kOldestFormat)) throw Unreadable("it is damaged: its format is another one");
  if (hasBends) checkBends(arrays, contents.nodes.size());
  contents.center = vec3Of(header.at("center"));
  contents.unit = header.at("unit");
  countNotFinite(arrays, contents);
  return contents;
}

DomainContents readDomain(const Bytes& file, const std::vector<Array>& arrays) {
  const json &shape = file.header.at("domain_shape"), &motion = file.header.at("motion");
  DomainContents domain{Domain(shape.at("cells"), shape.at("cell_side")),
                        readBallMap(file, file.header.at("domain_map"), arraysNamed(arrays, "domain_")),
                        {}};
  for (std::size_t k = 0; k < 3; ++k) domain.motion.rotation[k] = vec3Of(motion.at("rotation").at(k));
  domain.motion.coreRadius = motion.at("core_radius");
  if (motion.at("kind") == "moebius") {
    domain.motion.pull = vec3Of(motion.at("pull"));
    return domain;
  }
  if (motion.at("kind") != "table") throw Unreadable("the motion between its balls is of an unknown kind");
  domain.motion.from = take<Vec3>(arrays, "motion_from", "float64", 0);
  domain.motion.to = take<Vec3>(arrays, "motion_to", "float64", domain.motion.from.size());
  domain.motion.triangles = take<Triangle>(arrays, "motion_triangles", "int32", 0);
  for (const Triangle& t : domain.motion.triangles) {
    for (const std::int32_t v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= domain.motion.from.size())
        throw Unreadable("a triangle of the motion between its balls names a vertex that is not there");
    }
  }
  return domain;
}

}  // namespace

PmapContents readPmap(const std::filesystem::path& path) try {
  const Bytes file = parse(path);
  const std::vector<Array> arrays = arraysOf(file);
  PmapContents contents{readBallMap(file, file.header, arrays), std::nullopt};
  if (file.header.contains("domain_map") != (file.format > kBallFormat))
    throw Unreadable("it is damaged: its format is another one");
  if (file.format > kBallFormat) contents.domain = readDomain(file, arrays);
  return contents;
} catch (const json::exception& error) {
  throw Unreadable(std::string("its header lacks something: ") + error.what());
}

}  // namespace polestar::verify
