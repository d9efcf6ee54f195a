#include "polestar/render/render_solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/error.h"
#include "polestar/render/detail/camera.h"
#include "polestar/render/detail/cut_scene.h"
#include "polestar/render/detail/sampling.h"
#include "polestar/render/detail/studio.h"

namespace polestar {
namespace {

using namespace detail;

constexpr int kTile = 32;
constexpr double kSecondTry = 1e-6;  // how far towards the map's center, as share of the distance

/// Mesh units <-> the renderer's own frame: the box's middle is the origin, half its diagonal the unit.
/// Embree computes in single precision, so a far-away or tiny mesh must not reach it.
struct RenderFrame {
  Vec3 origin;
  double unit;
  Vec3 toRender(const Vec3& mesh) const { return (mesh - origin) / unit; }
  Vec3 toMesh(const Vec3& render) const { return origin + unit * render; }
};

RenderFrame renderFrame(const TriMesh& surface) {
  if (surface.triangles.empty()) throw Error(Errc::usage, "nothing to render: the surface has no triangles");
  const Box box = boundingBox(surface);
  const double unit = 0.5 * box.diagonal();
  if (!(unit > 0) || !std::isfinite(unit))
    throw Error(Errc::usage, "nothing to render: the surface has no extent");
  return {0.5 * (box.min + box.max), unit};
}

TriMesh inRenderFrame(const TriMesh& surface, const RenderFrame& frame) {
  TriMesh mesh = surface;
  for (Vec3& v : mesh.vertices) v = frame.toRender(v);
  return mesh;
}

/// The map's center where it has one, else the origin of the render frame.
Vec3 mapCenter(const VolumeMap& map, const RenderFrame& frame) {
  const Vec3 pole = Vec3::Zero();
  Vec3 center = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  map.inverse({&pole, 1}, {&center, 1});
  return center.allFinite() ? frame.toRender(center) : Vec3(Vec3::Zero());
}

std::vector<Plane> cutPlanes(const std::vector<CutPlane>& cuts, const TriMesh& mesh, const Vec3& center) {
  std::vector<Plane> planes;
  for (const CutPlane& cut : cuts) {
    const Vec3 normal = cut.normal.normalized();
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vec3& v : mesh.vertices) {
      low = std::min(low, normal.dot(v));
      high = std::max(high, normal.dot(v));
    }
    const double middle = normal.dot(center);
    planes.push_back(
        {normal, middle + (cut.offset > 0 ? cut.offset * (high - middle) : cut.offset * (middle - low))});
  }
  return planes;
}

std::vector<Vec3> keptVertices(const CutScene& scene) {
  std::vector<Vec3> kept;
  double extent = 0;
  for (const Vec3& v : scene.surface().vertices) {
    if (scene.cutAway(v)) continue;
    kept.push_back(v);
    extent = std::max(extent, (v - kept.front()).norm());
  }
  if (extent < 1e-6) {
    throw Error(Errc::usage, "the cutting planes leave nothing of the solid; move or turn them");
  }
  return kept;
}

double lowest(const std::vector<Vec3>& points, const Vec3& up) {
  double low = std::numeric_limits<double>::infinity();
  for (const Vec3& p : points) low = std::min(low, up.dot(p));
  return low;
}

/// The key light stands where it shines into the cut; from the left where nothing is cut.
double keySide(const std::vector<CutPlane>& cuts, const Camera& camera) {
  double side = 0;
  for (const CutPlane& cut : cuts) side += cut.normal.normalized().dot(camera.right());
  return side > 0 ? 1 : -1;
}

/// Everything that the tiles share.
struct Stage {
  const VolumeMap& map;
  const RenderOptions& options;
  RenderFrame frame;
  Vec3 center;  ///< of the map
  CutScene scene;
  Camera camera;
  Studio studio;
};

/// One camera sample.
struct Sample {
  Ray ray;
  SolidHit hit;
  double vignette = 0;
  std::uint32_t pixelSeed = 0, index = 0;
  int patch = -1;  ///< the patch that says how the map changes here
};

/// The samples of one pixel that see the same side of the solid share their derivatives: one finite
/// difference of the map along two tangents.
struct Patch {
  HitKind kind = HitKind::none;
  int plane = -1;
  std::size_t base = 0;  ///< of its three points in the batch
  Vec3 first, second;    ///< unit tangents
  double step = 0;       ///< along them; where the step leads out of the solid, the opposite one is taken
};

class Tile {
 public:
  Tile(const Stage& stage, int x0, int y0)
      : stage_(stage),
        x0_(x0),
        y0_(y0),
        x1_(std::min(x0 + kTile, stage.options.width)),
        y1_(std::min(y0 + kTile, stage.options.height)) {}

  void render(Picture& picture) {
    shoot();
    mapPoints();
    shade(picture);
  }
  std::size_t solidSamples() const { return solidSamples_; }
  std::size_t unmappedSamples() const { return unmappedSamples_; }

 private:
  void shoot();
  int patchOf(const SolidHit& hit, const Vec3& toward, std::size_t firstOfPixel);
  std::size_t addPoint(const Vec3& point, const Vec3& fallback);
  std::size_t addSample(const SolidHit& hit, const Vec3& inside);
  Vec3 slope(const Patch& patch, std::size_t neighbour, const Vec3& tangent) const;
  void mapPoints();
  void shade(Picture& picture);
  Vec3f shadeSample(const Sample& sample, std::size_t point);

  const Stage& stage_;
  int x0_, y0_, x1_, y1_;
  std::vector<Sample> samples_;
  std::vector<std::size_t> pointOf_;  ///< of a sample, in the batch
  std::vector<Patch> patches_;
  std::vector<Vec3> points_, fallbacks_, ball_;  ///< mesh units, twice; ball coordinates
  std::vector<std::uint8_t> fellBack_;
  std::size_t solidSamples_ = 0, unmappedSamples_ = 0;
};

/// Offset from a pixel's middle, in pixels: a tent of one pixel's radius, which softens edges a little.
double tent(double u) { return u < 0.5 ? std::sqrt(2 * u) - 1 : 1 - std::sqrt(2 - 2 * u); }

/// Half a pixel below the skin; on a cut, the point itself.
Vec3 below(const SolidHit& hit, double pixel) {
  return hit.kind == HitKind::skin ? Vec3(hit.position - 0.5 * pixel * hit.normal) : hit.position;
}

void Tile::shoot() {
  const RenderOptions& options = stage_.options;
  const double corner = std::hypot(options.width, options.height) / 2;
  for (int y = y0_; y < y1_; ++y) {
    for (int x = x0_; x < x1_; ++x) {
      const std::uint32_t seed =
          hash(static_cast<std::uint32_t>(y) * 0x9e3779b1u + static_cast<std::uint32_t>(x));
      const std::size_t firstPatch = patches_.size();
      for (int i = 0; i < options.samples; ++i) {
        const Eigen::Vector2d u = samplePoint(seed, 0, i);
        const double px = x + 0.5 + 0.8 * tent(u[0]), py = y + 0.5 + 0.8 * tent(u[1]);
        Sample sample;
        sample.ray = stage_.camera.ray(px, py);
        sample.hit = stage_.scene.firstHit(sample.ray);
        sample.vignette = std::hypot(px - 0.5 * options.width, py - 0.5 * options.height) / corner;
        sample.pixelSeed = seed;
        sample.index = static_cast<std::uint32_t>(i);
        std::size_t point = 0;
        if (sample.hit.kind != HitKind::none) {
          sample.patch = patchOf(sample.hit, sample.ray.direction, firstPatch);
          point = addSample(sample.hit, below(sample.hit, stage_.camera.pixelSize(sample.hit.distance)));
        }
        samples_.push_back(sample);
        pointOf_.push_back(point);
      }
    }
  }
}

int Tile::patchOf(const SolidHit& hit, const Vec3& toward, std::size_t firstOfPixel) {
  for (std::size_t i = firstOfPixel; i < patches_.size(); ++i) {
    if (patches_[i].kind == hit.kind && patches_[i].plane == hit.plane) return static_cast<int>(i);
  }
  Patch patch;
  patch.kind = hit.kind;
  patch.plane = hit.plane;
  patch.step = stage_.camera.pixelSize(hit.distance);
  patch.first =
      hit.normal.cross(std::abs(hit.normal.dot(toward)) < 0.99 ? toward : stage_.camera.up()).normalized();
  patch.second = hit.normal.cross(patch.first);
  const Vec3 inside = below(hit, patch.step);
  patch.base = addSample(hit, inside);
  for (const Vec3& tangent : {patch.first, patch.second}) {
    addPoint(inside + patch.step * tangent, inside - patch.step * tangent);
  }
  patches_.push_back(patch);
  return static_cast<int>(patches_.size()) - 1;
}

std::size_t Tile::addPoint(const Vec3& point, const Vec3& fallback) {
  points_.push_back(stage_.frame.toMesh(point));
  fallbacks_.push_back(stage_.frame.toMesh(fallback));
  return points_.size() - 1;
}

std::size_t Tile::addSample(const SolidHit& hit, const Vec3& inside) {
  return addPoint(inside, hit.position + kSecondTry * (stage_.center - hit.position));
}

void Tile::mapPoints() {
  ball_.resize(points_.size());
  fellBack_.resize(points_.size());
  stage_.map.forward(points_, ball_);
  std::vector<Vec3> again, result;
  for (std::size_t i = 0; i < ball_.size(); ++i) {
    fellBack_[i] = !ball_[i].allFinite();
    if (fellBack_[i]) again.push_back(fallbacks_[i]);
  }
  if (again.empty()) return;
  result.resize(again.size());
  stage_.map.forward(again, result);
  std::size_t next = 0;
  for (std::size_t i = 0; i < ball_.size(); ++i) {
    if (fellBack_[i]) ball_[i] = result[next++];
  }
}

Vec3 Tile::slope(const Patch& patch, std::size_t neighbour, const Vec3& tangent) const {
  const Vec3 change =
      (ball_[neighbour] - ball_[patch.base]) / (fellBack_[neighbour] ? -patch.step : patch.step);
  // Where both neighbours lie outside, the unit ball's own derivatives give lines of common width.
  return change.allFinite() ? change : tangent;
}

Vec3f Tile::shadeSample(const Sample& sample, std::size_t point) {
  const RenderOptions& options = stage_.options;
  const LightSample light{samplePoint(sample.pixelSeed, 1, sample.index),
                          samplePoint(sample.pixelSeed, 2, sample.index)};
  const bool studio = options.shading == Shading::studio;
  const SolidHit& hit = sample.hit;
  if (hit.kind == HitKind::none) {
    return studio ? stage_.studio.shadeBackdrop(stage_.scene, sample.ray, sample.vignette, light)
                  : options.palette.background;
  }
  ++solidSamples_;

  PatternValue pattern;
  pattern.albedo = options.palette.unmapped;
  const Patch& patch = patches_[sample.patch];
  if (ball_[point].allFinite()) {
    PatternPoint at;
    at.ball = ball_[point];
    at.pixel = stage_.camera.pixelSize(hit.distance);
    at.lineWidth = options.lineWidth;
    at.alongFirst = slope(patch, patch.base + 1, patch.first);
    at.alongSecond = slope(patch, patch.base + 2, patch.second);
    pattern = hit.kind == HitKind::cut ? cutPattern(at, options.palette) : skinPattern(at, options.palette);
  } else {
    ++unmappedSamples_;
  }
  if (!studio) return pattern.albedo;

  const Vec3 slope = pattern.slopeFirst * patch.first + pattern.slopeSecond * patch.second;
  const Vec3 normal = (hit.shadingNormal - slope).normalized();
  const Material material{pattern.albedo, hit.kind == HitKind::skin ? 1.0f : 0.15f};
  return stage_.studio.shadeSolid(stage_.scene, hit, normal, material, -sample.ray.direction, light);
}

void Tile::shade(Picture& picture) {
  std::size_t next = 0;
  for (int y = y0_; y < y1_; ++y) {
    for (int x = x0_; x < x1_; ++x) {
      Vec3f sum = Vec3f::Zero();
      for (int i = 0; i < stage_.options.samples; ++i, ++next)
        sum += shadeSample(samples_[next], pointOf_[next]);
      const Vec3f mean = sum / static_cast<float>(stage_.options.samples);
      float* pixel = picture.pixel(x, y);
      std::copy_n(mean.data(), 3, pixel);
      pixel[3] = 1;
    }
  }
}

void require(bool holds, const std::string& what) {
  if (!holds) throw Error(Errc::usage, "render: " + what);
}

}  // namespace

void RenderOptions::validate() const {
  require(width >= 1 && height >= 1 && width <= 32768 && height <= 32768,
          "width and height must be 1 to 32768 pixels");
  require(samples >= 1 && samples <= 4096, "samples must be 1 to 4096 a pixel");
  require(viewDirection.allFinite() && viewDirection.norm() > 0, "the view direction must not be zero");
  require(up.allFinite() && up.norm() > 0, "the up direction must not be zero");
  require(viewDirection.normalized().cross(up.normalized()).norm() > 1e-3,
          "the view direction must not be along the up direction");
  require(fieldOfView > 0 && fieldOfView < 2.5, "the field of view must lie between 0 and 2.5 radians");
  require(margin >= 0 && margin <= 0.45, "the margin must lie between 0 and 0.45");
  require(lineWidth > 0 && lineWidth <= 0.1, "the line width must lie between 0 and 0.1");
  require(creaseAngle >= 0 && creaseAngle <= std::numbers::pi, "the crease angle must lie between 0 and pi");
  for (const CutPlane& cut : cuts) {
    require(cut.normal.allFinite() && cut.normal.norm() > 0, "a cutting plane's normal must not be zero");
    require(cut.offset >= -1 && cut.offset <= 1, "a cutting plane's offset must lie between -1 and 1");
  }
}

Rendering renderSolid(const TriMesh& surface, const VolumeMap& map, const RenderOptions& options,
                      Context& context) {
  options.validate();
  const auto start = std::chrono::steady_clock::now();
  const RenderFrame frame = renderFrame(surface);
  TriMesh mesh = inRenderFrame(surface, frame);
  const Vec3 center = mapCenter(map, frame);
  std::vector<Plane> planes = cutPlanes(options.cuts, mesh, center);
  CutScene scene(std::move(mesh), std::move(planes), options.creaseAngle);
  const std::vector<Vec3> kept = keptVertices(scene);
  const Vec3 up = options.up.normalized();
  const Camera camera(options.viewDirection, up, options.fieldOfView, options.width, options.height,
                      options.margin, kept);
  const Studio studio(camera, up, lowest(kept, up), keySide(options.cuts, camera),
                      options.palette.background);
  const Stage stage{map, options, frame, center, std::move(scene), camera, studio};

  Rendering rendering;
  rendering.picture = Picture(options.width, options.height);
  const int across = (options.width + kTile - 1) / kTile, down = (options.height + kTile - 1) / kTile;
  const std::size_t tiles = std::size_t{1} * across * down;
  std::vector<std::array<std::size_t, 2>> counts(tiles);
  std::atomic<std::size_t> done{0};
  const std::thread::id driver = std::this_thread::get_id();
  parallelChunks(tiles, 1, context, [&](std::size_t t, std::size_t) {
    Tile tile(stage, static_cast<int>(t % across) * kTile, static_cast<int>(t / across) * kTile);
    tile.render(rendering.picture);
    counts[t] = {tile.solidSamples(), tile.unmappedSamples()};
    const std::size_t finished = ++done;
    if (std::this_thread::get_id() == driver)
      context.progress("rendering", static_cast<double>(finished) / tiles);
  });
  for (const auto& [solid, unmapped] : counts) {
    rendering.solidSamples += solid;
    rendering.unmappedSamples += unmapped;
  }
  rendering.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return rendering;
}

}  // namespace polestar
