#include "polestar/render/detail/aovs.h"

#include <algorithm>
#include <vector>

namespace polestar::detail {
namespace {

enum Channel { kDepth, kNormal, kBall = kNormal + 3, kGreen = kBall + 3, kId };
constexpr float kNowhere = 1e30f;
constexpr int kFirstObject = 10001;  // beyond all pieces and their cuts

void set(Picture& picture, std::size_t pixel, int channel, double value) {
  picture.channels[channel].values[pixel] = static_cast<float>(value);
}

int idOf(const SceneHit& hit) {
  if (hit.object >= 0) return kFirstObject + hit.object;
  return 100 * hit.piece + (hit.skin() ? 1 : 2 + hit.plane);
}

/// One pixel that sees the solid or an object.
struct Seen {
  std::size_t pixel, ray;
};

}  // namespace

void addAovChannels(Picture& picture) {
  picture.channels = solidAovs();
  for (PictureChannel& channel : picture.channels) channel.values.assign(picture.rgba.size() / 4, 0);
  std::fill(picture.channels[kDepth].values.begin(), picture.channels[kDepth].values.end(), kNowhere);
}

void fillAovs(const Stage& stage, const PixelBox& tile, Picture& picture) {
  RayBundle rays;
  const Vec3f origin = stage.camera.position().cast<float>();
  for (int y = tile.y0; y < tile.y1; ++y) {
    for (int x = tile.x0; x < tile.x1; ++x)
      rays.add(origin, stage.camera.direction(x + 0.5, y + 0.5).cast<float>());
  }
  std::vector<SceneHit> hits(rays.size());
  stage.scene.firstHits(rays, hits);

  std::vector<Seen> seen;
  std::vector<Vec3> points;
  std::vector<std::uint8_t> skin;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const int across = tile.x1 - tile.x0;
    const int x = tile.x0 + static_cast<int>(i) % across - picture.x0,
              y = tile.y0 + static_cast<int>(i) / across - picture.y0;
    if (x < 0 || y < 0 || x >= picture.width || y >= picture.height || hits[i].none()) continue;
    seen.push_back(
        {static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) + static_cast<std::size_t>(x),
         i});
    points.push_back(stage.scene.solidPoint(hits[i], stage.camera.position(),
                                            rays.directionOf(i).cast<double>().normalized()));
    skin.push_back(hits[i].skin());
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto [pixel, ray] = seen[i];
    const SceneHit& hit = hits[ray];
    const Vec3 shown = points[i] + stage.scene.shiftOf(hit);
    const Vec3f normal = stage.scene.shadingPoint(hit, origin, rays.directionOf(ray)).shadingNormal;
    set(picture, pixel, kDepth, stage.frame.unit * stage.camera.depth(shown));
    for (int k = 0; k < 3; ++k) set(picture, pixel, kNormal + k, normal[k]);
    set(picture, pixel, kId, idOf(hit));
    points[i] = stage.frame.toMesh(points[i]);
  }
  std::vector<Vec3> ball(points.size());
  std::vector<double> green(points.size());
  stage.appearance.coordinates(points, skin, ball, green);
  for (std::size_t i = 0; i < seen.size(); ++i) {
    for (int k = 0; k < 3; ++k) set(picture, seen[i].pixel, kBall + k, ball[i][k]);
    set(picture, seen[i].pixel, kGreen, green[i]);
  }
}

}  // namespace polestar::detail

namespace polestar {

std::vector<PictureChannel> solidAovs() {
  using Format = PictureChannel::Format;
  return {{"Z", Format::full, {}},      {"N.x", Format::half, {}},    {"N.y", Format::half, {}},
          {"N.z", Format::half, {}},    {"ball.x", Format::full, {}}, {"ball.y", Format::full, {}},
          {"ball.z", Format::full, {}}, {"green", Format::full, {}},  {"id", Format::integer, {}}};
}

}  // namespace polestar
