#include "integration/cut_view.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polestar::test {
namespace {

// Nearly along parallel lines, as Blender allows: its narrowest angle is 0.37 degrees.
constexpr double kNarrow = 0.03;

}  // namespace

CutView CutView::ofAxis(int axis, const Vec3& center, double across, int pixels) {
  CutView view;
  view.axes << Vec3::Unit((axis + 1) % 3), Vec3::Unit((axis + 2) % 3), -Vec3::Unit(axis);
  view.fieldOfView = kNarrow;
  view.width = view.height = pixels;
  view.depth = 0.5 * across / std::tan(0.5 * kNarrow);
  view.position = center - view.depth * view.axes.col(2);
  return view;
}

CutView CutView::ofPicture(const Exr& picture) {
  CutView view;
  view.width = picture.width;
  view.height = picture.height;
  if (!picture.camera || picture.id.size() != picture.color.size() ||
      picture.depth.size() != picture.id.size()) {
    ADD_FAILURE() << "the picture has no camera, Z or id";
    return view;
  }
  // Row vectors times matrices.
  const auto& toCamera = picture.camera->worldToCamera;
  const auto& toScreen = picture.camera->worldToScreen;
  Vec3 shift, upOverTangent;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k)
      view.axes(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
          static_cast<double>(toCamera[4 * i + k]);
    shift[static_cast<Eigen::Index>(i)] = static_cast<double>(toCamera[12 + i]);
    upOverTangent[static_cast<Eigen::Index>(i)] = static_cast<double>(toScreen[4 * i + 1]);
  }
  view.position = -view.axes * shift;
  view.fieldOfView = 2 * std::atan(1 / upOverTangent.norm());

  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < picture.id.size(); ++i) {
    if (picture.id[i] != kFirstCut) continue;
    sum += static_cast<double>(picture.depth[i]);
    ++count;
  }
  EXPECT_GT(count, 0U) << "the picture shows no cut";
  view.depth = sum / static_cast<double>(count);
  return view;
}

Vec3 CutView::pointAt(int x, int y) const {
  const double pixel = 2 * depth * std::tan(0.5 * fieldOfView) / height;
  return position + axes * Vec3((x + 0.5 - 0.5 * width) * pixel, (0.5 * height - y - 0.5) * pixel, depth);
}

}  // namespace polestar::test
