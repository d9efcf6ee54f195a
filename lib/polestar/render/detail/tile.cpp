#include "polestar/render/detail/tile.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "polestar/render/detail/sampling.h"

namespace polestar::detail {
namespace {

constexpr std::size_t kBatch = 16384;  // samples at once: their data stay in the cache's second level
constexpr float kRayOffset = 1e-4f;    // of shadow rays
constexpr float kSteepest = 0.05f;     // cosine at which a pixel's length on the solid stops growing
constexpr float kReach = 2;            // of a patch, pixels
constexpr float kFilterRadius =
    0.8f;  // of the tent that pixels are averaged by, which softens edges a little; pixels
constexpr double kTapShare = 0.55;  // of a pixel's length that a quarter of its samples stands for

/// Does a ray from outside meet the ball around the origin?
bool meetsBall(const Vec3f& origin, const Vec3f& direction, float radiusSquared) {
  const float along = -origin.dot(direction);
  const float outside = origin.squaredNorm() - radiusSquared;
  return outside <= 0 || (along > 0 && along * along > outside);
}

}  // namespace

Tile::Tile(const Stage& stage, int x0, int y0, int x1, int y1)
    : stage_(stage),
      x0_(x0),
      y0_(y0),
      x1_(x1),
      y1_(y1),
      pixels_(static_cast<std::size_t>(x1 - x0) * static_cast<std::size_t>(y1 - y0)) {}

const std::vector<Eigen::Vector4f>& Tile::render() {
  const std::size_t step = std::max<std::size_t>(1, kBatch / stage_.samples);
  for (std::size_t first = 0; first < pixels_.size(); first += step) {
    renderPixels(first, std::min(pixels_.size(), first + step));
  }
  return pixels_;
}

void Tile::renderPixels(std::size_t first, std::size_t last) {
  firstPixel_ = first;
  shoot(first, last);
  gather();
  look();
  if (!stage_.flat) light();
  const auto samples = static_cast<std::size_t>(stage_.samples);
  for (std::size_t p = first; p < last; ++p) {
    Eigen::Vector4f sum = Eigen::Vector4f::Zero();
    for (std::size_t i = 0; i < samples; ++i) sum += sampleColor((p - first) * samples + i);
    pixels_[p] = sum / static_cast<float>(samples);
  }
}

Eigen::Vector2i Tile::cornerOf(std::size_t pixel) const {
  const int across = x1_ - x0_;
  return {x0_ + static_cast<int>(pixel) % across, y0_ + static_cast<int>(pixel) / across};
}

void Tile::shoot(std::size_t first, std::size_t last) {
  const auto samples = static_cast<std::size_t>(stage_.samples);
  for (std::vector<float>* values : {&x_, &y_, &keyX_, &keyY_, &domeX_, &domeY_})
    values->resize((last - first) * samples);
  for (std::size_t p = first; p < last; ++p) {
    const Eigen::Vector2i corner = cornerOf(p);
    const PixelSamples pixel = pixelSamples(corner[0], corner[1], stage_.samples);
    const std::size_t at = (p - first) * samples;
    tentPoints(pixel, 0, samples, &x_[at], &y_[at]);
    diskPoints(pixel, 1, samples, &keyX_[at], &keyY_[at]);
    diskPoints(pixel, 2, samples, &domeX_[at], &domeY_[at]);
    for (std::size_t i = at; i < at + samples; ++i) {
      x_[i] = static_cast<float>(corner[0]) + 0.5f + kFilterRadius * x_[i];
      y_[i] = static_cast<float>(corner[1]) + 0.5f + kFilterRadius * y_[i];
    }
  }
  stage_.camera.rays(x_, y_, rays_);
  hits_.resize(rays_.size());
  stage_.scene.firstHits(rays_, hits_);
  counts_.primaryRays += rays_.size();
}

/// Sorts the samples of each pixel into patches, and those of each patch into taps.
void Tile::gather() {
  patches_.clear();
  taps_.clear();
  tapOf_.assign(hits_.size(), kMissed);
  const auto samples = static_cast<std::size_t>(stage_.samples);
  for (std::size_t begin = 0; begin < hits_.size(); begin += samples) {
    const std::size_t firstPatch = patches_.size(), firstTap = taps_.size();
    for (std::size_t i = begin; i < begin + samples; ++i) {
      if (!hits_[i].none()) gatherSample(i, firstPatch, firstTap);
    }
  }
  counts_.solidSamples += static_cast<std::size_t>(
      std::count_if(hits_.begin(), hits_.end(), [](const SceneHit& hit) { return !hit.none(); }));
}

void Tile::gatherSample(std::size_t sample, std::size_t firstPatch, std::size_t firstTap) {
  const SceneHit& hit = hits_[sample];
  const Vec3f position = rays_.originOf(sample) + hit.distance * rays_.directionOf(sample);
  std::size_t patch = firstPatch;
  Vec3f offset = Vec3f::Zero();
  for (; patch < patches_.size(); ++patch) {
    const Patch& p = patches_[patch];
    if (p.piece != hit.piece || p.plane != hit.plane || p.object != hit.object) continue;
    const Vec3f d = position - p.base;
    offset = {d.dot(p.first), d.dot(p.second), d.dot(p.normal)};
    if (std::abs(offset[0]) <= kReach * p.pixelFirst && std::abs(offset[1]) <= kReach * p.pixelSecond &&
        std::abs(offset[2]) <= kReach * p.pixelFirst) {
      break;
    }
  }
  if (patch == patches_.size()) {
    patches_.push_back(makePatch(sample));
    offset = Vec3f::Zero();
  }
  const Eigen::Vector2f corner =
      cornerOf(firstPixel_ + sample / static_cast<std::size_t>(stage_.samples)).cast<float>();
  const int quarter = (x_[sample] < corner[0] + 0.5f ? 0 : 1) + (y_[sample] < corner[1] + 0.5f ? 0 : 2);
  std::size_t tap = firstTap;
  while (tap < taps_.size() && (taps_[tap].patch != patch || taps_[tap].quarter != quarter)) ++tap;
  if (tap == taps_.size()) taps_.push_back({static_cast<std::uint32_t>(patch), quarter});
  taps_[tap].first += offset[0];
  taps_[tap].second += offset[1];
  ++taps_[tap].samples;
  tapOf_[sample] = static_cast<std::int32_t>(tap);
}

/// Around a sample's hit; the pixel's shape on the solid is that of its ellipse, along and across the line of
/// sight.
Tile::Patch Tile::makePatch(std::size_t sample) const {
  const SceneHit& hit = hits_[sample];
  const Vec3f origin = rays_.originOf(sample), direction = rays_.directionOf(sample);
  Patch patch;
  patch.piece = hit.piece;
  patch.plane = hit.plane;
  patch.object = hit.object;
  patch.base = origin + hit.distance * direction;
  patch.normal = stage_.scene.shadingPoint(hit, origin, direction).normal;
  const float facing = std::abs(patch.normal.dot(direction));
  patch.first =
      patch.normal.cross(facing < 0.999f ? direction : stage_.camera.up().cast<float>()).normalized();
  patch.second = patch.normal.cross(patch.first);
  patch.pixelFirst =
      static_cast<float>(stage_.camera.pixelSize(stage_.camera.depth(patch.base.cast<double>())));
  patch.pixelSecond = patch.pixelFirst / std::max(facing, kSteepest);

  const RenderFrame& frame = stage_.frame;
  patch.surface.point = frame.toMesh(
      stage_.scene.solidPoint(hit, origin.cast<double>(), direction.cast<double>().normalized()));
  // Outward, from whichever side it is seen.
  patch.surface.normal =
      hit.skin() ? stage_.scene.faceNormal(hit.triangle) : patch.normal.cast<double>().eval();
  patch.surface.first = patch.first.cast<double>();
  patch.surface.second = patch.second.cast<double>();
  patch.surface.pixelFirst = frame.unit * static_cast<double>(patch.pixelFirst);
  patch.surface.pixelSecond = frame.unit * static_cast<double>(patch.pixelSecond);
  patch.surface.skin = hit.skin();
  return patch;
}

SurfaceLook Tile::lookOfObject(const Tap& tap) const {
  const ObjectLook& object = stage_.objects[patches_[tap.patch].object];
  SurfaceLook look;
  look.color = object.color;
  look.gloss = object.gloss;
  look.known = true;
  return look;
}

void Tile::look() {
  looks_.assign(taps_.size(), SurfaceLook());
  // The appearance is asked for the solid alone.
  std::vector<SurfacePatch> patches;
  std::vector<std::uint32_t> patchNumber(patches_.size());
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    patchNumber[i] = static_cast<std::uint32_t>(patches.size());
    if (patches_[i].object < 0) patches.push_back(patches_[i].surface);
  }
  std::vector<SurfaceTap> taps;
  std::vector<std::size_t> tapNumber;
  for (std::size_t i = 0; i < taps_.size(); ++i) {
    const Tap& tap = taps_[i];
    if (patches_[tap.patch].object >= 0) {
      looks_[i] = lookOfObject(tap);
      continue;
    }
    const double unit = stage_.frame.unit / tap.samples;
    taps.push_back({patchNumber[tap.patch], unit * static_cast<double>(tap.first),
                    unit * static_cast<double>(tap.second)});
    tapNumber.push_back(i);
  }
  if (taps.empty()) return;
  std::vector<SurfaceLook> looks(taps.size());
  stage_.appearance.look(patches, taps, stage_.samples >= 4 ? kTapShare : 1, looks);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    SurfaceLook& look = looks_[tapNumber[i]];
    look = looks[i];
    if (look.known) continue;
    look = {};
    look.color = stage_.unmapped;
    counts_.unmappedSamples += static_cast<std::size_t>(taps_[tapNumber[i]].samples);
  }
}

void Tile::prepareSolid(std::size_t sample) {
  const Vec3f direction = rays_.directionOf(sample);
  const ShadingPoint point = stage_.scene.shadingPoint(hits_[sample], rays_.originOf(sample), direction);
  const SurfaceLook& look = looks_[tapOf_[sample]];
  const Patch& patch = patches_[taps_[tapOf_[sample]].patch];
  Lit& lit = lit_[sample];
  lit.normal =
      (point.shadingNormal - look.slopeFirst * patch.first - look.slopeSecond * patch.second).normalized();
  lit.toViewer = -direction;
  lit.seen.toKey = stage_.studio.keyDirection({keyX_[sample], keyY_[sample]});
  lit.seen.toDome = Studio::domeDirection(lit.normal, {domeX_[sample], domeY_[sample]});
  const Vec3f origin = point.shadowOrigin + kRayOffset * point.normal;
  if (lit.normal.dot(lit.seen.toKey) > 0 && point.normal.dot(lit.seen.toKey) > 0) {
    lit.keyRay = keyCount_;
    keyRays_.set(static_cast<std::size_t>(keyCount_++), origin, lit.seen.toKey);
  }
  if (point.normal.dot(lit.seen.toDome) > 0) {
    lit.domeRay = domeCount_;
    domeRays_.set(static_cast<std::size_t>(domeCount_++), origin, lit.seen.toDome);
  }
}

void Tile::prepareFloor(std::size_t sample) {
  const auto point = stage_.studio.floorPoint(rays_.originOf(sample), rays_.directionOf(sample));
  if (!point) return;
  const auto bound = static_cast<float>(stage_.boundSquared);
  Lit& lit = lit_[sample];
  const Vec3f toKey = stage_.studio.keyDirection({keyX_[sample], keyY_[sample]});
  if (meetsBall(*point, toKey, bound)) {
    lit.keyRay = keyCount_;
    keyRays_.set(static_cast<std::size_t>(keyCount_++), *point, toKey);
  }
  const Vec3f toDome = Studio::domeDirection(stage_.studio.floorNormal(), {domeX_[sample], domeY_[sample]});
  if (meetsBall(*point, toDome, bound)) {
    lit.domeRay = domeCount_;
    domeRays_.set(static_cast<std::size_t>(domeCount_++), *point, toDome);
  }
}

void Tile::light() {
  lit_.assign(hits_.size(), Lit());
  keyRays_.resize(hits_.size());
  domeRays_.resize(hits_.size());
  keyCount_ = domeCount_ = 0;
  for (std::size_t i = 0; i < hits_.size(); ++i) {
    tapOf_[i] == kMissed ? prepareFloor(i) : prepareSolid(i);
  }
  keyRays_.resize(static_cast<std::size_t>(keyCount_));
  domeRays_.resize(static_cast<std::size_t>(domeCount_));
  keyBlocked_.resize(keyRays_.size());
  domeBlocked_.resize(domeRays_.size());
  stage_.scene.occluded(keyRays_, true, keyBlocked_);
  stage_.scene.occluded(domeRays_, false, domeBlocked_);
  counts_.lightRays += keyRays_.size() + domeRays_.size();
}

float Tile::vignette(std::size_t sample) const {
  const Eigen::Vector2f middle(0.5f * static_cast<float>(stage_.width),
                               0.5f * static_cast<float>(stage_.height));
  return (Eigen::Vector2f(x_[sample], y_[sample]) - middle).norm() / middle.norm();
}

Eigen::Vector4f Tile::sampleColor(std::size_t sample) const {
  Eigen::Vector4f result(0, 0, 0, 1);
  if (tapOf_[sample] == kMissed) {
    if (stage_.flat) {
      result.head<3>() = stage_.background;
      return result;
    }
    const Lit& lit = lit_[sample];
    const float keyLost = lit.keyRay != kMissed && keyBlocked_[lit.keyRay] ? 1.0f : 0.0f;
    const float domeLost = lit.domeRay != kMissed && domeBlocked_[lit.domeRay] ? 1.0f : 0.0f;
    return stage_.studio.backdrop(vignette(sample), keyLost, domeLost);
  }
  const SurfaceLook& look = looks_[tapOf_[sample]];
  if (stage_.flat) {
    result.head<3>() = look.color;
    return result;
  }
  Lit lit = lit_[sample];
  lit.seen.key = lit.keyRay != kMissed && !keyBlocked_[lit.keyRay];
  lit.seen.dome = lit.domeRay != kMissed && !domeBlocked_[lit.domeRay];
  const SolidLight light = stage_.studio.onSolid(lit.normal, lit.toViewer, lit.seen);
  result.head<3>() = look.color.cwiseProduct(light.diffuse) + Vec3f::Constant(look.gloss * light.sheen);
  return result;
}

}  // namespace polestar::detail
