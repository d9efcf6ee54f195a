#include "polestar/texture/detail/ramp.h"

#include "polestar/io/picture.h"

namespace polestar::detail {
namespace {

std::vector<Ramp::Stop> linearStops(std::initializer_list<std::pair<double, std::uint32_t>> stops) {
  std::vector<Ramp::Stop> result;
  for (const auto& [at, rgb] : stops) result.push_back({at, linearFromSrgb(rgb)});
  return result;
}

}  // namespace

Ramp::Ramp(std::vector<Stop> stops) : stops_(std::move(stops)), integral_{Vec3::Zero()} {
  for (std::size_t i = 1; i < stops_.size(); ++i) {
    const Vec3f mean = 0.5f * (stops_[i - 1].color + stops_[i].color);
    integral_.push_back(integral_.back() + (stops_[i].at - stops_[i - 1].at) * mean.cast<double>());
  }
}

Ramp::Ramp(std::initializer_list<std::pair<double, std::uint32_t>> stops) : Ramp(linearStops(stops)) {}

/// The last stop at or before x; 0 when there is none.
std::size_t Ramp::segmentOf(double x) const {
  const auto next = std::upper_bound(stops_.begin() + 1, stops_.end(), x,
                                     [](double value, const Stop& stop) { return value < stop.at; });
  return static_cast<std::size_t>(next - stops_.begin()) - 1;
}

Vec3f Ramp::at(double x, std::size_t i) const {
  if (x <= stops_[i].at || i + 1 == stops_.size()) return stops_[i].color;
  return mix(stops_[i].color, stops_[i + 1].color, (x - stops_[i].at) / (stops_[i + 1].at - stops_[i].at));
}

Vec3 Ramp::integralTo(double x) const {
  const std::size_t i = segmentOf(x);
  return integral_[i] + (x - stops_[i].at) * (0.5f * (stops_[i].color + at(x, i))).cast<double>();
}

Vec3f Ramp::mean(double middle, double width) const {
  // Below, the difference of integrals would be rounding.
  if (width < 1e-7) return at(middle, segmentOf(middle));
  const Vec3 difference = integralTo(middle + width / 2) - integralTo(middle - width / 2);
  return (difference / width).cast<float>();
}

}  // namespace polestar::detail
