#pragma once
// Log-log plots as self-contained SVG.

#include <array>
#include <string>
#include <vector>

namespace polestar::bench {

struct PlotPoint {
  double x, y;  ///< points that are not positive are left out
};

struct PlotSeries {
  std::string name;
  int look = 0;  ///< color and marker; the same number looks the same everywhere
  std::vector<PlotPoint> points;
  bool joined = true;  ///< by a line
};

struct PlotPanel {
  std::string title;
  std::vector<PlotSeries> series;
};

/// Panels side by side on the same axes, one legend for all.
struct LogLogPlot {
  std::string xLabel, yLabel;    ///< with units
  std::vector<int> slopeGuides;  ///< exponents of dashed lines to compare slopes with
  std::vector<PlotPanel> panels;
};

/// Empty when no panel has a point.
std::string drawSvg(const LogLogPlot& plot);

}  // namespace polestar::bench
