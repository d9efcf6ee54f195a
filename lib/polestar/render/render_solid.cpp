#include "polestar/render/render_solid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

#include "polestar/core/error.h"
#include "polestar/render/detail/aovs.h"
#include "polestar/render/detail/staging.h"
#include "polestar/render/detail/tile_loop.h"

namespace polestar {

using namespace detail;

namespace {

constexpr std::size_t kMostExploding = 4;
constexpr std::size_t kMostObjects = 30000;  // they are counted in 16 bits

void validateCuts(const RenderOptions& options) {
  for (const CutPlane& cut : options.cuts) {
    require(cut.normal.allFinite() && cut.normal.norm() > 0, "a cutting plane's normal must not be zero");
    require(cut.offset >= -1 && cut.offset <= 1, "a cutting plane's offset must lie between -1 and 1");
  }
  if (options.cutMode != CutMode::explode) return;
  require(options.cuts.size() <= kMostExploding, "at most 4 planes can cut the solid into exploded pieces");
  require(options.explode >= 0 && options.explode <= 10, "the explosion must lie between 0 and 10");
}

}  // namespace

std::vector<Vec3> cornersOf(const Box& box) {
  std::vector<Vec3> corners;
  for (int c = 0; c < 8; ++c) {
    corners.emplace_back((c & 1 ? box.max : box.min)[0], (c & 2 ? box.max : box.min)[1],
                         (c & 4 ? box.max : box.min)[2]);
  }
  return corners;
}

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
  require(creaseAngle >= 0 && creaseAngle <= std::numbers::pi, "the crease angle must lie between 0 and pi");
  require(keySize >= 0 && keySize <= 3, "the size of the key light must lie between 0 and 3");
  require(background.allFinite() && background.minCoeff() >= 0, "the background must be a color");
  if (crop) {
    require(crop->x0 >= 0 && crop->y0 >= 0 && crop->x0 < crop->x1 && crop->y0 < crop->y1 &&
                crop->x1 <= width && crop->y1 <= height,
            "the crop must be x0,y0,x1,y1 with x0 < x1 and y0 < y1 inside the picture of " +
                std::to_string(width) + " x " + std::to_string(height) + " pixels");
  }
  require(objects.size() <= kMostObjects, "at most 30,000 objects can stand beside the solid");
  require(objects.empty() || cutMode != CutMode::explode || cuts.empty(),
          "objects do not explode; leave them out, or cut without exploding");
  validateCuts(*this);
}

struct SolidRenderer::Data {
  RenderOptions options;
  const Appearance& appearance;
  RenderFrame frame;
  Vec3 center;  ///< of the appearance, else of the frame; what follows is in the frame, too
  SolidScene scene;
  std::vector<ObjectLook> objectLooks;
  std::vector<Vec3> outline;
  Camera camera;  ///< at turn 0
  double boundSquared = 0;
  StudioSettings settings;

  Data(const TriMesh& surface, const Appearance& look, const RenderOptions& o)
      : options(o),
        appearance(look),
        frame(renderFrame(surface)),
        center(appearance.center().allFinite() ? frame.toRender(appearance.center()) : Vec3(Vec3::Zero())),
        scene(makeScene(surface)),
        outline(shownPoints()),
        camera(cameraPose(options), framedPoints(), options.turns, center) {
    for (const StageObject& object : options.objects) objectLooks.push_back({object.color, object.gloss});
    options.objects.clear();  // the scene has them
    settings.up = options.up.normalized();
    settings.floor = std::numeric_limits<double>::infinity();
    for (const Vec3& p : outline) {
      settings.floor = std::min(settings.floor, settings.up.dot(p));
      boundSquared = std::max(boundSquared, p.squaredNorm());
    }
    settings.hasFloor = options.floor;
    settings.keySide = keySide(options, camera);
    settings.keySize = options.keySize;
    settings.background = options.background;
    settings.transparent = options.transparent;
  }

  SolidScene makeScene(const TriMesh& surface) const {
    SceneParts parts;
    parts.surface = inRenderFrame(surface, frame);
    parts.pieces = cutPieces(options, parts.surface, center);
    parts.hollow = options.hollow;
    for (const StageObject& object : options.objects) {
      TriMesh mesh = inRenderFrame(object.mesh, frame);
      parts.objects.push_back(object.cut && !options.cuts.empty() ? clipped(mesh, parts.pieces[0])
                                                                  : std::move(mesh));
    }
    return SolidScene(std::move(parts), options.creaseAngle);
  }

  std::vector<Vec3> framedPoints() const {
    if (options.framed.empty()) return outline;
    std::vector<Vec3> points;
    for (const Vec3& p : options.framed) points.push_back(frame.toRender(p));
    return points;
  }

  std::vector<Vec3> shownPoints() const {
    std::vector<Vec3> points = scene.outline();
    double extent = 0;
    for (const Vec3& p : points) extent = std::max(extent, (p - points.front()).norm());
    if (extent < 1e-6)
      throw Error(Errc::usage, "the cutting planes leave nothing of the solid; move or turn them");
    return points;
  }
};

SolidRenderer::SolidRenderer(const TriMesh& surface, const Appearance& appearance,
                             const RenderOptions& options) {
  options.validate();
  data_ = std::make_unique<const Data>(surface, appearance, options);
}

SolidRenderer::~SolidRenderer() = default;

Rendering SolidRenderer::render(double turn, Context& context) const {
  const auto start = std::chrono::steady_clock::now();
  const RenderOptions& options = data_->options;
  const Camera camera = data_->camera.around(data_->settings.up, data_->center, turn);
  const Studio studio(camera, data_->settings);
  const Stage stage{data_->scene,
                    data_->appearance,
                    data_->objectLooks,
                    data_->frame,
                    camera,
                    studio,
                    options.width,
                    options.height,
                    options.samples,
                    options.shading == Shading::flat,
                    options.background,
                    options.unmapped,
                    data_->boundSquared};
  Rendering rendering;
  rendering.picture = emptyPicture(options);
  rendering.picture.camera = camera.matrices(data_->frame.origin, data_->frame.unit);
  if (options.aovs) addAovChannels(rendering.picture);
  std::vector<TileCounts> counts(tileCount(rendering.picture));
  forEachTile(options, rendering.picture, "rendering", context, [&](std::size_t number, const PixelBox& box) {
    Tile tile(stage, box.x0, box.y0, box.x1, box.y1);
    copyTile(box, tile.render(), rendering.picture);
    if (options.aovs) fillAovs(stage, box, rendering.picture);
    counts[number] = tile.counts();
  });
  TileCounts total;
  for (const TileCounts& count : counts) total.add(count);
  rendering.primaryRays = total.primaryRays;
  rendering.lightRays = total.lightRays;
  rendering.solidSamples = total.solidSamples;
  rendering.unmappedSamples = total.unmappedSamples;
  rendering.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return rendering;
}

Rendering renderSolid(const TriMesh& surface, const Appearance& appearance, const RenderOptions& options,
                      Context& context) {
  return SolidRenderer(surface, appearance, options).render(0, context);
}

}  // namespace polestar
