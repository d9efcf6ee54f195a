#include "log_log_plot.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace polestar::bench {
namespace {

constexpr double kPanelWidth = 330, kPanelHeight = 300, kGap = 22;
constexpr double kLeft = 64, kTop = 30, kAxis = 52, kLegendLine = 20, kRight = 16;
constexpr int kLegendColumns = 3;

// Colors that people with color blindness can tell apart [Okabe, Ito 2008].
constexpr std::array<const char*, 6> kColors = {"#0072b2", "#d55e00", "#e69f00",
                                                "#009e73", "#aa3377", "#222222"};

[[gnu::format(printf, 2, 3)]] void append(std::string& text, const char* format, ...) {
  char buffer[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  text += buffer;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return result;
}

/// One axis: decimal exponents from `low` to `high` on `length` pixels.
struct Axis {
  double low = 1e300, high = -1e300, length = 0;

  void include(double value) {
    low = std::min(low, std::log10(value));
    high = std::max(high, std::log10(value));
  }
  void pad() {
    const double margin = std::max(0.12, 0.05 * (high - low));
    low -= margin;
    high += margin;
  }
  double at(double exponent) const { return length * (exponent - low) / (high - low); }
  /// Whether decimals label it well; else powers of ten do.
  bool plain() const { return low > -2.2 && high < 3.2; }
  bool holds(double exponent) const { return exponent >= low && exponent <= high; }
};

struct Axes {
  Axis x, y;
  double px(double exponent) const { return x.at(exponent); }
  double py(double exponent) const { return kPanelHeight - y.at(exponent); }
};

bool drawable(const PlotPoint& p) { return p.x > 0 && p.y > 0 && std::isfinite(p.x) && std::isfinite(p.y); }

/// The label of `digit` times 10^exponent.
std::string tickLabel(int exponent, int digit, bool plain) {
  std::string label;
  if (plain) {
    append(label, "%g", digit * std::pow(10.0, exponent));
  } else {
    if (digit > 1) append(label, "%d&#183;", digit);
    append(label, "10<tspan dy=\"-5\" font-size=\"9\">%d</tspan>", exponent);
  }
  return label;
}

void drawTicks(std::string& svg, const Axes& axes, bool horizontal, bool labels) {
  const Axis& axis = horizontal ? axes.x : axes.y;
  // Few decades: label 2 and 5 as well.
  const bool dense = axis.high - axis.low < 1.8;
  for (int decade = static_cast<int>(std::floor(axis.low)); decade <= static_cast<int>(std::ceil(axis.high));
       ++decade) {
    for (int digit = 1; digit <= 9; ++digit) {
      const double exponent = decade + std::log10(digit);
      if (!axis.holds(exponent)) continue;
      const char* color = digit == 1 ? "#b8b8b8" : "#ebebeb";
      if (horizontal) {
        append(svg, "<path d=\"M%.1f 0V%.1f\" stroke=\"%s\"/>\n", axes.px(exponent), kPanelHeight, color);
      } else {
        append(svg, "<path d=\"M0 %.1fH%.1f\" stroke=\"%s\"/>\n", axes.py(exponent), kPanelWidth, color);
      }
      if (!labels || !(digit == 1 || (dense && (digit == 2 || digit == 5)))) continue;
      const std::string label = tickLabel(decade, digit, axis.plain());
      if (horizontal) {
        append(svg, "<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"middle\">%s</text>\n", axes.px(exponent),
               kPanelHeight + 18, label.c_str());
      } else {
        append(svg, "<text x=\"-7\" y=\"%.1f\" text-anchor=\"end\">%s</text>\n", axes.py(exponent) + 4,
               label.c_str());
      }
    }
  }
}

void drawMarker(std::string& svg, int look, double x, double y) {
  static constexpr std::array<const char*, 6> kShapes = {"m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0z",  // disk
                                                         "m-3.6 -3.6h7.2v7.2h-7.2z",             // square
                                                         "m0 -5l5 5l-5 5l-5 -5z",                // diamond
                                                         "m0 -5l4.6 8.4h-9.2z",                  // triangle
                                                         "m0 5l4.6 -8.4h-9.2z",    // triangle upside down
                                                         "m-4 -4l8 8m0 -8l-8 8"};  // cross
  const bool open = look == 5;
  append(svg, "<path d=\"M%.1f %.1f%s\" fill=\"%s\" stroke=\"%s\" stroke-width=\"%s\"/>\n", x, y,
         kShapes[look], open ? "none" : kColors[look], kColors[look], open ? "2" : "1");
}

void drawSeries(std::string& svg, const Axes& axes, const PlotSeries& series) {
  std::string path;
  for (const PlotPoint& p : series.points) {
    if (!drawable(p)) continue;
    append(path, "%c%.1f %.1f", path.empty() ? 'M' : 'L', axes.px(std::log10(p.x)), axes.py(std::log10(p.y)));
  }
  if (series.joined)
    svg += "<path d=\"" + path + "\" fill=\"none\" stroke-width=\"1.8\" stroke=\"" + kColors[series.look] +
           "\"/>\n";
  for (const PlotPoint& p : series.points) {
    if (drawable(p)) drawMarker(svg, series.look, axes.px(std::log10(p.x)), axes.py(std::log10(p.y)));
  }
}

/// Lines of slope 1, 2, 3 ... through one point near the lower left corner, up to the frame.
void drawGuides(std::string& svg, const Axes& axes, const std::vector<int>& slopes) {
  const double x0 = axes.x.low + 0.04 * (axes.x.high - axes.x.low);
  const double y0 = axes.y.low + 0.04 * (axes.y.high - axes.y.low);
  for (const int slope : slopes) {
    const double x1 = std::min(axes.x.high, x0 + (axes.y.high - y0) / slope);
    const double y1 = y0 + slope * (x1 - x0);
    append(svg, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"#888\" stroke-dasharray=\"5 4\"/>\n", axes.px(x0),
           axes.py(y0), axes.px(x1), axes.py(y1));
    // On the line, a little before its end.
    const double x = axes.px(x0 + 0.93 * (x1 - x0)), y = axes.py(y0 + 0.93 * (y1 - y0));
    append(
        svg,
        "<text x=\"%.1f\" y=\"%.1f\" fill=\"#555\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\" "
        "text-anchor=\"middle\">n<tspan dy=\"-5\" font-size=\"9\">%d</tspan></text>\n",
        x, y + 4, slope);
  }
}

void drawPanel(std::string& svg, const LogLogPlot& plot, std::size_t index, const Axes& axes) {
  const PlotPanel& panel = plot.panels[index];
  append(svg, "<g transform=\"translate(%.1f %.1f)\">\n",
         kLeft + static_cast<double>(index) * (kPanelWidth + kGap), kTop);
  drawTicks(svg, axes, true, true);
  drawTicks(svg, axes, false, index == 0);
  append(svg, "<rect width=\"%g\" height=\"%g\" fill=\"none\" stroke=\"#444\"/>\n", kPanelWidth,
         kPanelHeight);
  drawGuides(svg, axes, plot.slopeGuides);
  for (const PlotSeries& series : panel.series) drawSeries(svg, axes, series);
  append(svg, "<text x=\"%g\" y=\"-10\" text-anchor=\"middle\" font-weight=\"bold\">%s</text>\n",
         kPanelWidth / 2, escaped(panel.title).c_str());
  append(svg, "<text x=\"%g\" y=\"%g\" text-anchor=\"middle\">%s</text>\n", kPanelWidth / 2,
         kPanelHeight + 40, escaped(plot.xLabel).c_str());
  svg += "</g>\n";
}

/// Every name once, in order of looks.
std::vector<PlotSeries> legendOf(const LogLogPlot& plot) {
  std::vector<PlotSeries> legend;
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotSeries& series : panel.series) {
      const bool known = std::any_of(legend.begin(), legend.end(),
                                     [&](const PlotSeries& entry) { return entry.name == series.name; });
      if (!known) legend.push_back({series.name, series.look, {}, series.joined});
    }
  }
  std::stable_sort(legend.begin(), legend.end(), [](auto& a, auto& b) { return a.look < b.look; });
  return legend;
}

}  // namespace

std::string drawSvg(const LogLogPlot& plot) {
  Axes axes;
  for (const PlotPanel& panel : plot.panels) {
    for (const PlotSeries& series : panel.series) {
      for (const PlotPoint& p : series.points) {
        if (drawable(p)) axes.x.include(p.x), axes.y.include(p.y);
      }
    }
  }
  if (axes.x.low > axes.x.high) return {};
  axes.x.pad();
  axes.y.pad();
  axes.x.length = kPanelWidth;
  axes.y.length = kPanelHeight;

  const std::vector<PlotSeries> legend = legendOf(plot);
  const auto panels = static_cast<double>(plot.panels.size());
  const double width = kLeft + panels * kPanelWidth + (panels - 1) * kGap + kRight;
  const int columns = std::min<int>(kLegendColumns, static_cast<int>(plot.panels.size()));
  const int lines = (static_cast<int>(legend.size()) + columns - 1) / columns;
  const double legendTop = kTop + kPanelHeight + kAxis;
  std::string svg;
  append(
      svg,
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%.0f\" height=\"%.0f\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<rect width=\"100%%\" height=\"100%%\" fill=\"#fff\"/>\n",
      width, legendTop + lines * kLegendLine + 8);
  for (std::size_t i = 0; i < plot.panels.size(); ++i) drawPanel(svg, plot, i, axes);
  append(svg, "<text transform=\"translate(16 %.1f) rotate(-90)\" text-anchor=\"middle\">%s</text>\n",
         kTop + kPanelHeight / 2, escaped(plot.yLabel).c_str());
  for (std::size_t i = 0; i < legend.size(); ++i) {
    const double x = kLeft + static_cast<double>(i % columns) * (width - kLeft) / columns;
    const double y = legendTop + static_cast<double>(i / columns) * kLegendLine + 8;
    if (legend[i].joined)
      append(svg, "<path d=\"M%.1f %.1fh30\" stroke-width=\"1.8\" stroke=\"%s\"/>\n", x, y,
             kColors[legend[i].look]);
    drawMarker(svg, legend[i].look, x + 15, y);
    append(svg, "<text x=\"%.1f\" y=\"%.1f\">%s</text>\n", x + 38, y + 4, escaped(legend[i].name).c_str());
  }
  return svg + "</svg>\n";
}

}  // namespace polestar::bench
