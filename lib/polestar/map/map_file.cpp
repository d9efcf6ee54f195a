#include "polestar/map/map_file.h"

#include <xxhash.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <span>

#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/shell_map.h"

namespace polestar {
namespace {

using nlohmann::json;

constexpr char kMagic[8] = {'P', 'O', 'L', 'E', 'S', 'T', 'A', 'R'};
/// Format 2 has no `slope_trust` and `straight_nodes`. Files without a domain of their own have 3 still: for
/// them nothing is different.
constexpr std::uint32_t kFormat = 4, kBallFormat = 3, kOldestFormat = 2;
/// Before the names of what belongs to the domain's map.
const std::string kDomainPrefix = "domain_";
constexpr std::size_t kPreamble = sizeof kMagic + 2 * sizeof(std::uint32_t), kAlignment = 64;

std::size_t aligned(std::size_t size) { return (size + kAlignment - 1) / kAlignment * kAlignment; }

class Hasher {
 public:
  Hasher() : state_(XXH3_createState()) { XXH3_128bits_reset(state_); }
  ~Hasher() { XXH3_freeState(state_); }
  Hasher(const Hasher&) = delete;
  Hasher& operator=(const Hasher&) = delete;
  void add(const void* data, std::size_t size) { XXH3_128bits_update(state_, data, size); }
  std::string hex() const {
    XXH128_canonical_t canonical;
    XXH128_canonicalFromHash(&canonical, XXH3_128bits_digest(state_));
    std::string text;
    for (const unsigned char byte : canonical.digest) {
      constexpr const char* kDigits = "0123456789abcdef";
      text += {kDigits[byte >> 4], kDigits[byte & 15]};
    }
    return text;
  }

 private:
  XXH3_state_t* state_;
};

json toJson(const Vec3& v) { return json::array({v[0], v[1], v[2]}); }
Vec3 toVec3(const json& j) { return {j.at(0).get<double>(), j.at(1).get<double>(), j.at(2).get<double>()}; }

/// What a row of an array is made of, and how the header calls it.
template <class Row>
struct NumberOf;
template <>
struct NumberOf<Vec3> {
  using Type = double;
  static constexpr const char* kName = "float64";
};
template <>
struct NumberOf<double> : NumberOf<Vec3> {};
template <>
struct NumberOf<float> {
  using Type = float;
  static constexpr const char* kName = "float32";
};
template <>
struct NumberOf<Triangle> {
  using Type = std::int32_t;
  static constexpr const char* kName = "int32";
};
template <>
struct NumberOf<std::size_t> {
  using Type = std::size_t;
  static constexpr const char* kName = "uint64";
};

// The arrays of a file, in order; views of memory that the caller keeps.
class ArrayList {
 public:
  template <class T>
  void add(const std::string& name, std::span<const T> values, std::size_t columns) {
    using Number = NumberOf<T>::Type;
    const std::span numbers(reinterpret_cast<const Number*>(values.data()),
                            values.size_bytes() / sizeof(Number));
    description_.push_back({{"name", name},
                            {"type", NumberOf<T>::kName},
                            {"shape", {numbers.size() / columns, columns}},
                            {"offset", offset_}});
    if constexpr (std::is_floating_point_v<Number>) {
      notFinite_ += static_cast<std::size_t>(
          std::count_if(numbers.begin(), numbers.end(), [](Number x) { return !std::isfinite(x); }));
    }
    bytes_.push_back(std::as_bytes(values));
    offset_ = aligned(offset_ + values.size_bytes());
  }
  const json& description() const { return description_; }
  const std::vector<std::span<const std::byte>>& bytes() const { return bytes_; }
  /// NaN and infinite numbers in all of them.
  std::size_t notFinite() const { return notFinite_; }

 private:
  json description_ = json::array();
  std::vector<std::span<const std::byte>> bytes_;
  std::size_t offset_ = 0;  // from the end of the aligned header
  std::size_t notFinite_ = 0;
};

json toJson(const MfsSummary& mfs) {
  return {{"mode", mfs.mode == MfsMode::paper ? "paper" : "smooth"},
          {"sources", mfs.sources},
          {"left_out", mfs.leftOut},
          {"offset_inner", mfs.offset},
          {"cutoff", mfs.cutoff},
          {"rank", mfs.rank},
          {"reciprocal_condition", mfs.reciprocalCondition},
          {"collocation_error", mfs.collocationError},
          {"held_out_error", mfs.heldOutError}};
}

MfsSummary toMfsSummary(const json& j) {
  return {j.at("mode") == "paper" ? MfsMode::paper : MfsMode::smooth,
          j.at("sources"),
          j.at("left_out"),
          j.at("offset_inner"),
          j.at("cutoff"),
          j.at("rank"),
          j.at("reciprocal_condition"),
          j.at("collocation_error"),
          j.at("held_out_error")};
}

json toJson(const SignProof::Sign& sign) {
  return {{"failed", sign.failed}, {"refuted", sign.refuted}, {"worst", sign.worst}};
}

SignProof::Sign toSign(const json& j) { return {j.at("failed"), j.at("refuted"), j.at("worst")}; }

json toJson(const SignProof& proof) {
  json weakest = json::array();
  for (const SignProof::Face& face : proof.weakest) {
    weakest.push_back({{"triangle", face.triangle},
                       {"place_inner", toJson(face.place)},
                       {"radial", face.radial},
                       {"normal", face.normal},
                       {"seen", face.seen}});
  }
  return {{"delta", proof.delta},           {"faces", proof.faces}, {"points", proof.points},
          {"radial", toJson(proof.radial)}, {"weakest", weakest},   {"normal", toJson(proof.normal)}};
}

SignProof toSignProof(const json& j) {
  SignProof proof;
  proof.delta = j.at("delta");
  proof.faces = j.at("faces");
  proof.points = j.at("points");
  proof.radial = toSign(j.at("radial"));
  proof.normal = toSign(j.at("normal"));
  for (const json& face : j.at("weakest")) {
    proof.weakest.push_back({face.at("triangle"), toVec3(face.at("place_inner")), face.at("radial"),
                             face.at("normal"), face.at("seen")});
  }
  return proof;
}

json toJson(const std::vector<SignProof>& proofs) {
  json list = json::array();
  for (const SignProof& proof : proofs) list.push_back(toJson(proof));
  return list;
}

json toJson(const Mat3& m) {
  json rows = json::array();
  for (int k = 0; k < 3; ++k) rows.push_back(toJson(Vec3(m.row(k))));
  return rows;
}
Mat3 toMat3(const json& j) {
  Mat3 m;
  for (int k = 0; k < 3; ++k) m.row(k) = toVec3(j.at(static_cast<std::size_t>(k)));
  return m;
}

json describe(const BallMap& map) {
  const GreenChart& chart = map.chart();
  const GreenRecord& green = chart.green().record();
  const ChartReport& report = chart.report();
  const Frame& frame = chart.green().shape().frame();
  json header{{"center", toJson(frame.origin)},
              {"unit", frame.unit},
              {"levels", chart.foliation().levels},
              {"green",
               {{"solver", green.summary.solver},
                {"iterations", green.summary.iterations},
                {"passes", green.summary.passes},
                {"residual", green.summary.residual},
                {"harmonic_radius_inner", green.harmonicRadius},
                {"charge", green.charge ? json(*green.charge) : json()},
                {"mfs", green.mfs ? toJson(*green.mfs) : json()},
                {"accuracy", green.accuracy},
                {"unresolved_area", green.unresolvedArea},
                {"boundary_error",
                 {{"max", green.boundaryError.max},
                  {"rms", green.boundaryError.rms},
                  {"points", green.boundaryError.points},
                  {"worst_inner", toJson(green.boundaryError.worst)},
                  {"kind", green.boundaryError.bound ? "bound" : "sampled"},
                  {"sampled", green.boundaryError.sampled},
                  {"truncation", green.boundaryError.truncation}}}}},
              {"chart",
               {{"lines", report.lines},
                {"deepened", report.deepened},
                {"failed", report.failed},
                {"retraced", report.retraced},
                {"repaired", report.repaired},
                {"ray_lines", report.rayLines},
                {"largest_move_inner", report.largestMove},
                {"largest_move_ball", report.largestMoveInBall},
                {"evaluations", report.evaluations},
                {"direction_flips", report.directionFlips}}},
              {"sphere",
               {{"kind", toString(map.sphere().kind)},
                {"flips", map.sphere().flips},
                {"qc_mean", map.sphere().qcMean},
                {"qc_max", map.sphere().qcMax},
                {"repaired_vertices", map.sphere().repairedVertices},
                {"fallback", map.sphere().fallbackReason}}},
              {"core", map.options().core == CoreMode::smooth ? "smooth" : "paper"},
              {"core_radius", map.options().coreRadius},
              {"radius",
               {{"kind", toString(map.radius().kind())},
                {"knots", std::vector<RadiusProfile::Knot>(map.radius().knots().begin(),
                                                           map.radius().knots().end())}}}};
  if (!green.signs.empty()) header["green"]["signs"] = toJson(green.signs);
  return header;
}

json describeMotion(const VolumeMap& motion) {
  if (const auto* shells = dynamic_cast<const ShellMap*>(&motion))
    return {
        {"kind", "table"}, {"rotation", toJson(shells->rotation())}, {"core_radius", shells->coreRadius()}};
  const auto& moebius = dynamic_cast<const BallMotion&>(motion);
  return {{"kind", "moebius"},
          {"rotation", toJson(moebius.rotation())},
          {"pull", toJson(moebius.pull())},
          {"core_radius", moebius.coreRadius()}};
}

json describe(const BallMap& map, const DomainMap* domain, const MapProvenance& provenance) {
  json header = describe(map);
  header["format"] = "polestar/pmap";
  header["version"] = kVersion;
  header["source"] = provenance.source;
  header["arguments"] = provenance.arguments;
  header["balance_volume"] = provenance.balanceVolume ? json(*provenance.balanceVolume) : json();
  header["domain"] = "ball";
  if (!domain) return header;
  const DomainShape& shape = domain->shape();
  header["domain"] = shape.kind;
  header["domain_shape"] = {{"cells", shape.cells},
                            {"cell_side", shape.cellSide},
                            {"axes", toJson(shape.axes)},
                            {"unit", shape.unit},
                            {"overlap", shape.overlap}};
  header["domain_map"] = describe(domain->domain());
  header["motion"] = describeMotion(domain->motion());
  return header;
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& reason) {
  throw Error(Errc::io, path.string() + ": " + reason);
}

// A file in memory, its header parsed and its hash verified.
struct RawFile {
  std::vector<char> bytes;
  std::uint32_t format = 0;
  json header;
  std::size_t dataBegin = 0;
};

RawFile readRaw(const std::filesystem::path& path) {
  std::error_code code;
  const auto size = std::filesystem::file_size(path, code);
  std::ifstream in(path, std::ios::binary);
  if (code || !in) fail(path, "cannot be read; is it a .pmap file made by polestar map?");
  RawFile raw;
  raw.bytes.resize(size);
  if (!in.read(raw.bytes.data(), static_cast<std::streamsize>(size))) fail(path, "cannot be read to its end");
  std::uint32_t length = 0;
  if (size < kPreamble || std::memcmp(raw.bytes.data(), kMagic, sizeof kMagic) != 0) {
    fail(path, "is not a .pmap file (no POLESTAR signature)");
  }
  std::memcpy(&raw.format, &raw.bytes[sizeof kMagic], sizeof raw.format);
  std::memcpy(&length, &raw.bytes[sizeof kMagic + sizeof raw.format], sizeof length);
  if (raw.format < kOldestFormat || raw.format > kFormat) {
    fail(path, "has .pmap format " + std::to_string(raw.format) + ", this program reads " +
                   std::to_string(kOldestFormat) + " to " + std::to_string(kFormat) +
                   "; make the map again with polestar map");
  }
  if (kPreamble + length > size) fail(path, "is truncated within its header; make the map again");
  raw.header =
      json::parse(raw.bytes.begin() + kPreamble, raw.bytes.begin() + kPreamble + length, nullptr, false);
  if (!raw.header.is_object() || !raw.header.contains("hash") || !raw.header["hash"].is_string()) {
    fail(path, "has a damaged header; make the map again");
  }
  raw.dataBegin = std::min<std::size_t>(aligned(kPreamble + length), size);

  json unsigned_ = raw.header;
  unsigned_.erase("hash");
  const std::string text = unsigned_.dump();
  Hasher hasher;
  hasher.add(text.data(), text.size());
  hasher.add(raw.bytes.data() + raw.dataBegin, raw.bytes.size() - raw.dataBegin);
  // The hash covers neither the zeros after the header nor the format, which what the file holds tells again.
  const bool zeros = std::all_of(raw.bytes.begin() + static_cast<std::ptrdiff_t>(kPreamble + length),
                                 raw.bytes.begin() + static_cast<std::ptrdiff_t>(raw.dataBegin),
                                 [](char byte) { return byte == 0; });
  const json arrays = raw.header.value("arrays", json::array());
  const bool hasBends = std::any_of(arrays.begin(), arrays.end(), [](const json& entry) {
    return entry.is_object() && entry.value("name", json()) == "slope_trust";
  });
  if (hasher.hex() != raw.header["hash"].get<std::string>() || !zeros ||
      hasBends != (raw.format > kOldestFormat) ||
      raw.header.contains("domain_map") != (raw.format > kBallFormat)) {
    fail(path, "is damaged or truncated (its hash does not match); make the map again");
  }
  return raw;
}

template <class T>
std::vector<T> takeArray(const RawFile& raw, const std::filesystem::path& path, const std::string& name,
                         std::size_t columns, std::size_t expectedRows) {
  for (const json& entry : raw.header.at("arrays")) {
    if (entry.at("name") != name) continue;
    const auto rows = entry.at("shape").at(0).get<std::size_t>(),
               offset = entry.at("offset").get<std::size_t>();
    const std::size_t available = raw.bytes.size() - raw.dataBegin;
    if (entry.at("shape").at(1) != columns || (expectedRows != 0 && rows != expectedRows) ||
        offset > available || rows > (available - offset) / sizeof(T)) {
      fail(path, "array '" + name + "' has an impossible size");
    }
    std::vector<T> values(rows);
    if (rows > 0)
      std::memcpy(static_cast<void*>(values.data()), &raw.bytes[raw.dataBegin + offset], rows * sizeof(T));
    return values;
  }
  fail(path, "array '" + name + "' is missing");
}

void checkIndices(const TriMesh& mesh, const std::filesystem::path& path) {
  for (const Triangle& t : mesh.triangles) {
    for (const std::int32_t v : t) {
      if (v < 0 || static_cast<std::size_t>(v) >= mesh.vertices.size()) {
        fail(path, "a triangle names a vertex that is not there");
      }
    }
  }
}

void checkNodes(const std::vector<std::size_t>& ids, std::size_t nodes, const std::filesystem::path& path) {
  if (std::any_of(ids.begin(), ids.end(), [&](std::size_t id) { return id >= nodes; }))
    fail(path, "a list names a node that is not there");
}

/// What a file holds of one ball map: the solid's, or that of its domain.
struct Part {
  const RawFile& raw;
  const std::filesystem::path& path;
  const json& header;
  std::string prefix;  ///< of its arrays' names

  template <class T>
  std::vector<T> take(const std::string& name, std::size_t columns, std::size_t expectedRows) const {
    return takeArray<T>(raw, path, prefix + name, columns, expectedRows);
  }
};

std::optional<NodeBends> takeBends(const Part& part, std::size_t nodes) {
  if (part.raw.format == kOldestFormat) return std::nullopt;
  NodeBends bends{part.take<float>("slope_trust", 1, nodes), part.take<std::size_t>("straight_nodes", 1, 0)};
  if (!std::all_of(bends.trust.begin(), bends.trust.end(), [](float x) { return x >= 0 && x <= 1; }))
    fail(part.path, "has a trust in slopes outside of [0, 1]; make the map again");
  checkNodes(bends.straight, nodes, part.path);
  return bends;
}

// The layer of the solver "layer", the charges of "mfs".
void addSources(ArrayList& arrays, const std::string& prefix, const GreenSources& sources) {
  if (const auto* layer = std::get_if<SurfaceLayer>(&sources)) {
    arrays.add(prefix + "layer_vertices_inner", std::span(layer->mesh.vertices), 3);
    arrays.add(prefix + "layer_triangles", std::span(layer->mesh.triangles), 3);
    arrays.add(prefix + "density", std::span(layer->density), 1);
  } else {
    const auto& charges = std::get<PointSources>(sources);
    arrays.add(prefix + "source_positions_inner", std::span(charges.positions), 3);
    arrays.add(prefix + "source_charges", std::span(charges.charges), 1);
  }
}

GreenSources takeSources(const Part& part) {
  if (part.header.at("green").at("solver") == "mfs") {
    PointSources charges;
    charges.positions = part.take<Vec3>("source_positions_inner", 3, 0);
    charges.charges = part.take<double>("source_charges", 1, charges.positions.size());
    return charges;
  }
  SurfaceLayer layer;
  layer.mesh.vertices = part.take<Vec3>("layer_vertices_inner", 3, 0);
  layer.mesh.triangles = part.take<Triangle>("layer_triangles", 3, 0);
  checkIndices(layer.mesh, part.path);
  layer.density = part.take<double>("density", 1, layer.mesh.vertices.size());
  return layer;
}

SphereMapKind toSphereMapKind(const std::string& name, const std::filesystem::path& path) {
  for (const SphereMapKind kind : kSphereMapKinds) {
    if (name == toString(kind)) return kind;
  }
  fail(path, "its boundary map '" + name + "' is unknown to this program");
}

// Files without one have s = R.
RadiusProfile toRadiusProfile(const json& header, const std::filesystem::path& path) {
  if (!header.contains("radius")) return {};
  const auto knots = header.at("radius").at("knots").get<std::vector<RadiusProfile::Knot>>();
  const std::string name = header.at("radius").at("kind");
  if (knots.empty()) return {};
  for (const RadiusKind kind : kRadiusKinds) {
    if (name == toString(kind)) return {kind, knots};
  }
  fail(path, "its radius '" + name + "' is unknown to this program");
}

// Nothing in files from before it was written down, either.
std::optional<double> toBalanceVolume(const json& header) {
  if (const auto found = header.find("balance_volume"); found != header.end() && !found->is_null())
    return found->get<double>();
  return std::nullopt;
}

BallMap restore(const Part& part) {
  const json& header = part.header;
  const std::filesystem::path& path = part.path;
  TriMesh mesh;
  mesh.vertices = part.take<Vec3>("vertices", 3, 0);
  mesh.triangles = part.take<Triangle>("triangles", 3, 0);
  const std::size_t n = mesh.vertices.size();
  checkIndices(mesh, path);
  StarOptions starOptions;
  starOptions.center = toVec3(header.at("center"));
  starOptions.rays = 0;
  const StarShape shape = verifyStarShape(verifyClosedSurface(std::move(mesh)), starOptions);

  const json& g = header.at("green");
  GreenRecord record;
  record.summary.solver = g.at("solver");
  record.summary.iterations = g.at("iterations");
  record.summary.passes = g.at("passes");
  record.summary.residual = g.at("residual");
  record.harmonicRadius = g.at("harmonic_radius_inner");
  if (!g.at("charge").is_null()) record.charge = g.at("charge").get<double>();
  if (!g.at("mfs").is_null()) record.mfs = toMfsSummary(g.at("mfs"));
  record.accuracy = g.at("accuracy");
  record.unresolvedArea = g.at("unresolved_area");
  const json& e = g.at("boundary_error");
  record.boundaryError = {e.at("max"),
                          e.at("rms"),
                          e.at("points"),
                          toVec3(e.at("worst_inner")),
                          e.at("kind") == "bound",
                          e.value("sampled", 0.0),
                          e.value("truncation", 0.0)};
  for (const json& proof : g.value("signs", json::array())) record.signs.push_back(toSignProof(proof));
  GreenSources sources = takeSources(part);
  GreenFunction green = restoreGreen(shape, std::move(sources), std::move(record));

  auto data = std::make_shared<GreenChart::Data>(GreenChart::Data{green, {}, {}, {}, {}, {}, {}, {}});
  Foliation& f = data->foliation;
  f.vertexCount = n;
  f.triangles = shape.mesh().triangles;
  f.levels = header.at("levels").get<std::vector<double>>();
  if (f.levels.size() < 2) fail(path, "has fewer than two levels");
  const std::size_t nodes = f.centerNode() + 1;
  f.nodes = part.take<Vec3>("nodes_inner", 3, nodes);
  data->h = part.take<double>("harmonic", 1, nodes);
  data->gradient = part.take<Vec3>("harmonic_gradient", 3, nodes);
  data->directions = part.take<Vec3>("omega", 3, n);
  data->movedNodes = part.take<std::size_t>("moved_nodes", 1, 0);
  checkNodes(data->movedNodes, nodes, path);
  const json& c = header.at("chart");
  data->report.lines = c.at("lines");
  data->report.deepened = c.at("deepened");
  data->report.failed = c.at("failed");
  data->report.retraced = c.at("retraced");
  data->report.repaired = c.at("repaired");
  data->report.rayLines = c.at("ray_lines");
  data->report.largestMove = c.at("largest_move_inner");
  data->report.largestMoveInBall = c.at("largest_move_ball");
  data->report.evaluations = c.at("evaluations");
  data->report.directionFlips = c.at("direction_flips");
  data->report.cells = countCells(f);

  const json& s = header.at("sphere");
  SphereMap sphere;
  sphere.kind = toSphereMapKind(s.at("kind"), path);
  sphere.directions = part.take<Vec3>("phi", 3, n);
  sphere.flips = countFlips(sphere.directions, f.triangles);
  sphere.qcMean = s.at("qc_mean");
  sphere.qcMax = s.at("qc_max");
  sphere.repairedVertices = s.at("repaired_vertices");
  sphere.fallbackReason = s.at("fallback");
  const BallMapOptions options{header.at("core") == "smooth" ? CoreMode::smooth : CoreMode::paper,
                               header.at("core_radius")};
  NodeImages images{part.take<Vec3>("ball", 3, nodes), part.take<std::size_t>("linear_nodes", 1, 0)};
  checkNodes(images.linear, nodes, path);
  return BallMap(GreenChart(std::move(data)), std::move(sphere), options, toRadiusProfile(header, path),
                 std::move(images), takeBends(part, nodes));
}

std::shared_ptr<const VolumeMap> restoreMotion(const RawFile& raw, const std::filesystem::path& path) {
  const json& m = raw.header.at("motion");
  if (m.at("kind") == "moebius")
    return std::make_shared<BallMotion>(toMat3(m.at("rotation")), toVec3(m.at("pull")), m.at("core_radius"));
  if (m.at("kind") != "table") fail(path, "the motion between its balls is unknown to this program");
  ShellTable table;
  table.from = takeArray<Vec3>(raw, path, "motion_from", 3, 0);
  table.to = takeArray<Vec3>(raw, path, "motion_to", 3, table.from.size());
  table.triangles = takeArray<Triangle>(raw, path, "motion_triangles", 3, 0);
  return std::make_shared<ShellMap>(std::move(table), m.at("core_radius"));
}

DomainMap restoreDomain(BallMap solid, const RawFile& raw, const std::filesystem::path& path) {
  const json& s = raw.header.at("domain_shape");
  DomainShape shape{raw.header.at("domain"), s.at("cells"), s.at("cell_side"),
                    toMat3(s.at("axes")),    s.at("unit"),  s.at("overlap")};
  return {std::move(solid), restoreMotion(raw, path),
          restore({raw, path, raw.header.at("domain_map"), kDomainPrefix}), std::move(shape)};
}

void addArrays(ArrayList& arrays, const std::string& prefix, const BallMap& map) {
  const GreenChart& chart = map.chart();
  const TriMesh& mesh = chart.green().shape().surface().mesh();
  arrays.add(prefix + "vertices", std::span(mesh.vertices), 3);
  arrays.add(prefix + "triangles", std::span(mesh.triangles), 3);
  addSources(arrays, prefix, chart.green().sources());
  arrays.add(prefix + "nodes_inner", std::span(chart.foliation().nodes), 3);
  arrays.add(prefix + "ball", std::span(map.nodeImages().ball), 3);
  arrays.add(prefix + "linear_nodes", std::span(map.nodeImages().linear), 1);
  arrays.add(prefix + "slope_trust", std::span(map.nodeBends().trust), 1);
  arrays.add(prefix + "straight_nodes", std::span(map.nodeBends().straight), 1);
  arrays.add(prefix + "harmonic", chart.harmonic(), 1);
  arrays.add(prefix + "harmonic_gradient", chart.harmonicGradient(), 3);
  arrays.add(prefix + "omega", chart.directions(), 3);
  arrays.add(prefix + "moved_nodes", chart.movedNodes(), 1);
  arrays.add(prefix + "phi", std::span(map.sphere().directions), 3);
}

void addDomain(ArrayList& arrays, const DomainMap& domain) {
  addArrays(arrays, kDomainPrefix, domain.domain());
  const auto* shells = dynamic_cast<const ShellMap*>(&domain.motion());
  if (!shells) return;
  arrays.add("motion_from", std::span(shells->table().from), 3);
  arrays.add("motion_to", std::span(shells->table().to), 3);
  arrays.add("motion_triangles", std::span(shells->table().triangles), 3);
}

std::string write(const std::filesystem::path& path, const BallMap& map, const DomainMap* domain,
                  const MapProvenance& provenance) {
  ArrayList arrays;
  addArrays(arrays, "", map);
  if (domain) addDomain(arrays, *domain);
  json header = describe(map, domain, provenance);
  header["arrays"] = arrays.description();
  const std::string unsigned_ = header.dump();
  static constexpr char kZeros[kAlignment] = {};
  auto padding = [](std::size_t size) { return aligned(size) - size; };
  Hasher hasher;
  hasher.add(unsigned_.data(), unsigned_.size());
  for (const auto bytes : arrays.bytes()) {
    hasher.add(bytes.data(), bytes.size());
    hasher.add(kZeros, padding(bytes.size()));
  }
  const std::string hash = hasher.hex();
  header["hash"] = hash;
  const std::string text = header.dump();

  writeAtomically(path, [&](const std::filesystem::path& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    const std::uint32_t format = domain ? kFormat : kBallFormat,
                        length = static_cast<std::uint32_t>(text.size());
    out.write(kMagic, sizeof kMagic);
    out.write(reinterpret_cast<const char*>(&format), sizeof format);
    out.write(reinterpret_cast<const char*>(&length), sizeof length);
    out.write(text.data(), static_cast<std::streamsize>(text.size()));
    out.write(kZeros, static_cast<std::streamsize>(padding(kPreamble + text.size())));
    for (const auto bytes : arrays.bytes()) {
      out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
      out.write(kZeros, static_cast<std::streamsize>(padding(bytes.size())));
    }
    out.close();
    if (!out) throw Error(Errc::io, "cannot write " + path.string() + ": is the disk full?");
  });
  return hash;
}

}  // namespace

std::size_t countNotFinite(const BallMap& map) {
  ArrayList arrays;
  addArrays(arrays, "", map);
  return arrays.notFinite();
}

std::string writeMapFile(const std::filesystem::path& path, const BallMap& map,
                         const MapProvenance& provenance) {
  return write(path, map, nullptr, provenance);
}

std::string writeMapFile(const std::filesystem::path& path, const DomainMap& map,
                         const MapProvenance& provenance) {
  return write(path, map.solid(), &map, provenance);
}

MapFile readMapFile(const std::filesystem::path& path) {
  const RawFile raw = readRaw(path);
  try {
    MapFile file{restore({raw, path, raw.header, ""}),
                 {raw.header.at("source"), raw.header.at("arguments"), toBalanceVolume(raw.header)},
                 raw.header.at("hash"),
                 raw.header.at("version"),
                 std::nullopt};
    if (raw.format > kBallFormat) file.domain = restoreDomain(file.map, raw, path);
    return file;
  } catch (const json::exception& e) {
    fail(path, std::string("its header lacks something: ") + e.what());
  }
}

MapFileInfo readMapFileInfo(const std::filesystem::path& path) {
  const RawFile raw = readRaw(path);
  return {raw.header.value("version", ""), raw.header.at("hash"), raw.header.dump(), raw.bytes.size()};
}

}  // namespace polestar
