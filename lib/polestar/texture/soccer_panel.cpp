#include "polestar/texture/soccer_panel.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace polestar {
namespace {

constexpr int kPanels = 32;
constexpr double kRoll = 0.35, kTilt = 0.12;  // of the ball, radians

/// Face normals over face distances of the truncated icosahedron, scaled to edge length 1: a ray from the
/// center along u leaves through the face with the largest u . (n / d).
std::array<Vec3, kPanels> panelForms() {
  const double g = std::numbers::phi;
  const double pentagonDistance = 0.5 * std::sqrt((125 + 41 * std::sqrt(5.0)) / 10);
  const double hexagonDistance = std::sqrt(1.5 * (7 + 3 * std::sqrt(5.0))) / 2;
  std::array<Vec3, kPanels> forms;
  int next = 0;
  // Pentagons face the icosahedron's vertices, hexagons those of the dual dodecahedron.
  for (int axis = 0; axis < 3; ++axis) {
    for (const double a : {-1.0, 1.0}) {
      for (const double b : {-g, g}) {
        Vec3 n = Vec3::Zero();
        n[(axis + 1) % 3] = a;
        n[(axis + 2) % 3] = b;
        forms[next++] = n.normalized() / pentagonDistance;
      }
    }
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 n(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    forms[next++] = n.normalized() / hexagonDistance;
  }
  for (int axis = 0; axis < 3; ++axis) {
    for (const double a : {-g, g}) {
      for (const double b : {-1 / g, 1 / g}) {
        Vec3 n = Vec3::Zero();
        n[(axis + 1) % 3] = a;
        n[(axis + 2) % 3] = b;
        forms[next++] = n.normalized() / hexagonDistance;
      }
    }
  }
  // Turned so that a hexagon looks along -y, where the faces of many models are, and no mirror plane lies in
  // a coordinate plane, where people like to cut: a seam within a cut has no width to draw.
  const Eigen::Quaterniond turn = Eigen::AngleAxisd(kTilt, Vec3::UnitX()) *
                                  Eigen::AngleAxisd(kRoll, Vec3::UnitY()) *
                                  Eigen::Quaterniond::FromTwoVectors(Vec3::Ones(), -Vec3::UnitY());
  for (Vec3& form : forms) form = turn * form;
  return forms;
}

}  // namespace

SoccerPanel soccerPanel(const Vec3& direction) {
  static const std::array<Vec3, kPanels> forms = panelForms();
  SoccerPanel panel;
  std::array<double, kPanels> score;
  for (int i = 0; i < kPanels; ++i) {
    score[i] = direction.dot(forms[i]);
    if (score[i] > score[panel.index]) panel.index = i;
  }
  const double length = std::max(direction.norm(), 1e-300);
  panel.seamDistance = 1;
  for (int i = 0; i < kPanels; ++i) {
    // Panels on the other side of the ball are no neighbours; their score is far off.
    if (i == panel.index || score[i] < 0.5 * score[panel.index]) continue;
    const Vec3 form = forms[panel.index] - forms[i];
    const double formLength = form.norm();
    const double distance = (score[panel.index] - score[i]) / (formLength * length);
    if (distance < panel.seamDistance) {
      panel.seamDistance = distance;
      panel.seamNormal = form / formLength;
      panel.neighbour = i;
    }
  }
  return panel;
}

}  // namespace polestar
