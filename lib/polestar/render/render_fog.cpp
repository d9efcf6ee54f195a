#include "polestar/render/render_fog.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "polestar/render/detail/fog_march.h"
#include "polestar/render/detail/sampling.h"
#include "polestar/render/detail/staging.h"
#include "polestar/render/detail/tile_loop.h"

namespace polestar {

using namespace detail;

namespace {

constexpr double kShadowStretch = 2;   // of steps towards lights
constexpr float kFilterRadius = 0.8f;  // as the solid's pictures have it

/// Random numbers of a pixel's samples.
struct SampleNumbers {
  std::vector<float> x, y, keyX, keyY, domeX, domeY, scatter, jitter;

  explicit SampleNumbers(std::size_t count)
      : x(count),
        y(count),
        keyX(count),
        keyY(count),
        domeX(count),
        domeY(count),
        scatter(count),
        jitter(count) {}
  void fill(int column, int row) {
    const PixelSamples pixel = pixelSamples(column, row, static_cast<int>(x.size()));
    tentPoints(pixel, 0, x.size(), x.data(), y.data());
    diskPoints(pixel, 1, x.size(), keyX.data(), keyY.data());
    diskPoints(pixel, 2, x.size(), domeX.data(), domeY.data());
    squarePoints(pixel, 3, x.size(), scatter.data(), jitter.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      x[i] = static_cast<float>(column) + 0.5f + kFilterRadius * x[i];
      y[i] = static_cast<float>(row) + 0.5f + kFilterRadius * y[i];
    }
  }
};

/// What the tiles of a picture share.
struct FogStage {
  const RenderOptions& options;
  const FogOptions& look;
  const FogMedium& medium;
  const RenderFrame& frame;
  const Camera& camera;
  const Studio& studio;
  Vec3 eye;  ///< the camera's place, world
};

class FogTile {
 public:
  FogTile(const FogStage& stage, const PixelBox& box)
      : stage_(stage),
        box_(box),
        march_(stage.medium),
        random_(static_cast<std::size_t>(stage.options.samples)) {}

  std::vector<Eigen::Vector4f> render() {
    std::vector<Eigen::Vector4f> pixels;
    for (int y = box_.y0; y < box_.y1; ++y) {
      for (int x = box_.x0; x < box_.x1; ++x) {
        random_.fill(x, y);
        Eigen::Vector4f sum = Eigen::Vector4f::Zero();
        for (std::size_t i = 0; i < random_.x.size(); ++i) sum += sample(i);
        pixels.emplace_back(sum / static_cast<float>(random_.x.size()));
      }
    }
    return pixels;
  }
  const TileCounts& counts() const { return counts_; }

 private:
  Eigen::Vector4f sample(std::size_t i) {
    const Vec3 direction =
        stage_.camera.direction(static_cast<double>(random_.x[i]), static_cast<double>(random_.y[i]));
    const auto jitter = static_cast<double>(random_.jitter[i]);
    const double through = march_.follow(stage_.eye, direction, jitter);
    const auto alpha = static_cast<float>(1 - through);
    ++counts_.primaryRays;
    Eigen::Vector4f result = Eigen::Vector4f::Zero();
    if (alpha > 0) {
      ++counts_.solidSamples;
      result.head<3>() = alpha * scattered(i, direction, jitter);
      result[3] = alpha;
    }
    if (through > 0) result += static_cast<float>(through) * behind(i, direction, jitter);
    return result;
  }

  Vec3f scattered(std::size_t i, const Vec3& direction, double jitter) {
    const Vec3 point =
        stage_.eye + march_.scatterDistance(static_cast<double>(random_.scatter[i])) * direction;
    const Vec3f albedo = stage_.look.albedo.cwiseProduct(march_.probe().color(point));
    if (stage_.options.shading == Shading::flat) return albedo;
    const Vec3f toDome = Studio::sphereDirection({random_.domeX[i], random_.domeY[i]});
    const auto key = static_cast<float>(arriving(point, keyDirection(i), jitter));
    const auto dome = static_cast<float>(arriving(point, toDome.cast<double>(), jitter));
    return albedo.cwiseProduct(stage_.studio.inFog(key, toDome, dome));
  }

  Eigen::Vector4f behind(std::size_t i, const Vec3& direction, double jitter) {
    if (stage_.options.shading == Shading::flat) {
      const Vec3f& color = stage_.options.background;
      return stage_.options.transparent ? Eigen::Vector4f(0, 0, 0, 0)
                                        : Eigen::Vector4f(color[0], color[1], color[2], 1);
    }
    float keyLost = 0, domeLost = 0;
    const Vec3f eye = stage_.camera.position().cast<float>();
    if (const auto floor = stage_.studio.floorPoint(eye, direction.cast<float>())) {
      const Vec3 point = stage_.frame.toMesh(floor->cast<double>());
      const Vec3f toDome =
          Studio::domeDirection(stage_.studio.floorNormal(), {random_.domeX[i], random_.domeY[i]});
      keyLost = static_cast<float>(1 - arriving(point, keyDirection(i), jitter));
      domeLost = static_cast<float>(1 - arriving(point, toDome.cast<double>(), jitter));
    }
    const Eigen::Vector2f middle(0.5f * static_cast<float>(stage_.options.width),
                                 0.5f * static_cast<float>(stage_.options.height));
    const float vignette = (Eigen::Vector2f(random_.x[i], random_.y[i]) - middle).norm() / middle.norm();
    return stage_.studio.backdrop(vignette, keyLost, domeLost);
  }

  Vec3 keyDirection(std::size_t i) const {
    return stage_.studio.keyDirection({random_.keyX[i], random_.keyY[i]}).cast<double>().normalized();
  }

  double arriving(const Vec3& point, const Vec3& direction, double jitter) {
    ++counts_.lightRays;
    return march_.transmittance(point, direction, jitter, kShadowStretch);
  }

  const FogStage& stage_;
  const PixelBox box_;
  FogMarch march_;
  SampleNumbers random_;
  TileCounts counts_;
};

}  // namespace

void FogOptions::validate() const {
  require(meanFreePath > 0 && meanFreePath < 1e6, "the mean free path must be above 0");
  require(albedo.allFinite() && albedo.minCoeff() >= 0 && albedo.maxCoeff() <= 1,
          "the fog's albedo must lie between 0 and 1");
}

struct FogRenderer::Data {
  RenderOptions options;
  FogOptions look;
  FogVolume fog;
  TriMesh corners;  ///< of the fog's blocks; no triangles
  RenderFrame frame;
  FogMedium medium;
  Camera camera;  ///< at turn 0, in the render frame
  StudioSettings settings;

  Data(const FogVolume& volume, const FogOptions& l, const RenderOptions& o)
      : options(o),
        look(l),
        fog(volume),
        corners{volume.outline(), {}},
        frame(frameOf(corners)),
        medium{fog, 1 / (look.meanFreePath * frame.unit), fog.voxelSize(), {}},
        camera(cameraPose(options), shown(), options.turns) {
    for (const Piece& piece : cutPieces(options, inRenderFrame(corners, frame), Vec3::Zero())) {
      if (piece.notched) medium.gone.push_back(inWorld(piece.planes));
      // Slices: what lies beyond any plane is gone.
      for (const Plane& plane : piece.planes)
        if (!piece.notched) medium.gone.push_back(inWorld({{-plane.normal, -plane.offset}}));
    }
    settings.up = options.up.normalized();
    settings.floor = std::numeric_limits<double>::infinity();
    for (const Vec3& p : shown()) settings.floor = std::min(settings.floor, settings.up.dot(p));
    settings.hasFloor = options.floor;
    settings.keySide = keySide(options, camera);
    settings.keySize = options.keySize;
    settings.background = options.background;
    settings.transparent = options.transparent;
  }

  static RenderFrame frameOf(const TriMesh& points) {
    const Box box = boundingBox(points);
    return {0.5 * (box.min + box.max), 0.5 * box.diagonal()};
  }
  std::vector<Vec3> shown() const { return inRenderFrame(corners, frame).vertices; }
  std::vector<Plane> inWorld(const std::vector<Plane>& planes) const {
    std::vector<Plane> result;
    for (const Plane& plane : planes)
      result.push_back({plane.normal, frame.unit * plane.offset + plane.normal.dot(frame.origin)});
    return result;
  }
};

FogRenderer::FogRenderer(const FogVolume& fog, const FogOptions& look, const RenderOptions& options) {
  options.validate();
  look.validate();
  require(options.cutMode != CutMode::explode, "a fog cannot be exploded");
  require(!options.aovs, "a fog has no AOVs");
  data_ = std::make_unique<const Data>(fog, look, options);
}

FogRenderer::~FogRenderer() = default;

Rendering FogRenderer::render(double turn, Context& context) const {
  const auto start = std::chrono::steady_clock::now();
  const Camera camera = data_->camera.around(data_->settings.up, Vec3::Zero(), turn);
  const Studio studio(camera, data_->settings);
  const FogStage stage{data_->options,
                       data_->look,
                       data_->medium,
                       data_->frame,
                       camera,
                       studio,
                       data_->frame.toMesh(camera.position())};
  Rendering rendering;
  rendering.picture = emptyPicture(data_->options);
  rendering.picture.camera = camera.matrices(data_->frame.origin, data_->frame.unit);
  std::vector<TileCounts> counts(tileCount(rendering.picture));
  forEachTile(data_->options, rendering.picture, "marching", context,
              [&](std::size_t number, const PixelBox& box) {
                FogTile tile(stage, box);
                copyTile(box, tile.render(), rendering.picture);
                counts[number] = tile.counts();
              });
  TileCounts total;
  for (const TileCounts& count : counts) total.add(count);
  rendering.primaryRays = total.primaryRays;
  rendering.lightRays = total.lightRays;
  rendering.solidSamples = total.solidSamples;
  rendering.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return rendering;
}

}  // namespace polestar
