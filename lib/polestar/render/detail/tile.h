#pragma once
// A tile of the picture, from rays to pixels. Rays and light go by the sample; looks, which are the dear
// part, by the patch: what a pixel sees of one side of the solid.

#include <cstdint>
#include <vector>

#include "polestar/io/picture.h"
#include "polestar/render/appearance.h"
#include "polestar/render/detail/camera.h"
#include "polestar/render/detail/solid_scene.h"
#include "polestar/render/detail/studio.h"

namespace polestar::detail {

/// Mesh units <-> the renderer's own frame: the box's middle is the origin, half its diagonal the unit.
/// Embree computes in single precision, so a far-away or tiny mesh must not reach it.
struct RenderFrame {
  Vec3 origin = Vec3::Zero();
  double unit = 1;
  Vec3 toRender(const Vec3& mesh) const { return (mesh - origin) / unit; }
  Vec3 toMesh(const Vec3& render) const { return origin + unit * render; }
};

/// What an object looks like, all over.
struct ObjectLook {
  Vec3f color;
  float gloss;
};

/// Everything that the tiles of a picture share.
struct Stage {
  const SolidScene& scene;
  const Appearance& appearance;
  const std::vector<ObjectLook>& objects;  ///< of the scene
  const RenderFrame& frame;
  const Camera& camera;
  const Studio& studio;
  int width, height;  ///< of the full picture
  int samples;        ///< a pixel
  bool flat;          ///< looks alone, no light
  Vec3f background, unmapped;
  double boundSquared;  ///< of the ball around the origin that holds all that is shown
};

struct TileCounts {
  std::size_t primaryRays = 0, lightRays = 0, solidSamples = 0, unmappedSamples = 0;
  void add(const TileCounts& other) {
    primaryRays += other.primaryRays;
    lightRays += other.lightRays;
    solidSamples += other.solidSamples;
    unmappedSamples += other.unmappedSamples;
  }
};

constexpr int kTile = 32;

/// Pixels [x0, x1) x [y0, y1) of the full picture, row by row.
class Tile {
 public:
  Tile(const Stage& stage, int x0, int y0, int x1, int y1);

  /// Premultiplied RGBA of the tile's pixels, row by row.
  const std::vector<Eigen::Vector4f>& render();
  const TileCounts& counts() const { return counts_; }

 private:
  static constexpr std::int32_t kMissed = -1;
  /// As SurfacePatch, but as shown and in the render frame.
  struct Patch {
    SurfacePatch surface;
    Vec3f base, normal, first, second;
    float pixelFirst, pixelSecond;
    std::int16_t piece, plane, object;
  };

  struct Tap {
    std::uint32_t patch;
    int quarter;  ///< of the pixel
    float first = 0, second = 0;
    int samples = 0;
  };

  /// What light needs to know of a sample.
  struct Lit {
    Vec3f normal, toViewer;
    LightSeen seen;
    std::int32_t keyRay = kMissed, domeRay = kMissed;
  };

  void renderPixels(std::size_t first, std::size_t last);
  void shoot(std::size_t first, std::size_t last);
  void gather();
  void gatherSample(std::size_t sample, std::size_t firstPatch, std::size_t firstTap);
  Patch makePatch(std::size_t sample) const;
  void look();
  SurfaceLook lookOfObject(const Tap& tap) const;
  void light();
  void prepareSolid(std::size_t sample);
  void prepareFloor(std::size_t sample);
  Eigen::Vector4f sampleColor(std::size_t sample) const;
  float vignette(std::size_t sample) const;
  Eigen::Vector2i cornerOf(std::size_t pixel) const;

  const Stage& stage_;
  const int x0_, y0_, x1_, y1_;
  std::vector<Eigen::Vector4f> pixels_;
  TileCounts counts_;

  // Of the pixels that are rendered at once; samples of a pixel are consecutive.
  std::size_t firstPixel_ = 0;
  RayBundle rays_, keyRays_, domeRays_;
  std::int32_t keyCount_ = 0, domeCount_ = 0;       ///< of light rays that are in use
  std::vector<float> x_, y_;                        ///< of samples, in the picture
  std::vector<float> keyX_, keyY_, domeX_, domeY_;  ///< of samples: random points of the unit disk
  std::vector<SceneHit> hits_;
  std::vector<std::int32_t> tapOf_;  ///< of samples; -1 where the solid is missed
  std::vector<Patch> patches_;
  std::vector<Tap> taps_;
  std::vector<SurfaceLook> looks_;  ///< of taps
  std::vector<Lit> lit_;            ///< of samples
  std::vector<std::uint8_t> keyBlocked_, domeBlocked_;
};

}  // namespace polestar::detail
