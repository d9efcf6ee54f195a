#include "targets.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "plan.h"

namespace polestar::bench {
namespace {

template <class... Values>
std::string text(const char* format, Values... values) {
  char buffer[256];
  std::snprintf(buffer, sizeof buffer, format, values...);
  return buffer;
}

double number(const Json& result, const char* key) {
  const Json value = result.value(key, Json());
  return value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
}

const Json* find(const std::vector<Json>& results, const Row& row) {
  const auto found = std::find_if(results.begin(), results.end(),
                                  [&](const Json& r) { return succeeded(r) && rowOf(r) == row; });
  return found == results.end() ? nullptr : &*found;
}

double largestBoundaryError(const Json& result) {
  const double solver = number(result, "boundary_error"), check = number(result, "boundary_check");
  return std::isnan(solver) || solver > check ? solver : check;
}

Target sizeTarget(const std::vector<Json>& results, const std::string& shape, const Goal& goal) {
  Target target{text("%s, %dk vertices: %g s, boundary error %.0e", shape.c_str(), goal.size / 1000,
                     goal.seconds, goal.tolerance),
                "", std::nullopt};
  const Json* r =
      find(results, {.method = "layer", .shape = shape, .size = goal.size, .tolerance = goal.tolerance});
  if (!r) return target;
  const double error = largestBoundaryError(*r);
  target.measured = text("%.2f s, %.1e", wallSeconds(*r), error);
  target.met = wallSeconds(*r) <= goal.seconds && error <= goal.tolerance;
  return target;
}

Target millionTarget(const std::vector<Json>& results, const std::string& shape) {
  Target target{shape + ", 1M vertices: under 90 s and 8 GB", "", std::nullopt};
  const Json* r = find(results, {.method = "layer", .shape = shape, .size = 1000000});
  if (!r) return target;
  const double gigabytes = number(*r, "peak_bytes") / 1e9;
  target.measured = text("%.1f s, %.2f GB", wallSeconds(*r), gigabytes);
  target.met = wallSeconds(*r) < 90 && gigabytes < 8;
  return target;
}

Target exponentTarget(const std::vector<Json>& results, const std::string& shape) {
  Target target{shape + ": exponent of time from 10k to 1M vertices at most 1.15", "", std::nullopt};
  const std::optional<Exponent> exponent = timeExponent(results, shape);
  if (!exponent) return target;
  target.measured = text("%.2f from %zu to %zu", exponent->value, exponent->from, exponent->to);
  if (exponent->to > 900000) target.met = exponent->value <= 1.15;
  return target;
}

/// Both solve for the solid that the triangles bound, so the true error is what they leave on those
/// triangles: by the maximum principle it bounds the error inside.
Target mfsTarget(const std::vector<Json>& results, const std::string& shape) {
  Target target{shape + ", 10k vertices: 50 times faster than the paper's MFS, smaller boundary error", "",
                std::nullopt};
  const Json* ours = find(results, {.method = "layer", .shape = shape, .size = 10000});
  const Json* paper = find(results, {.method = "mfs", .shape = shape, .size = 10000});
  if (!ours || !paper) return target;
  const double ratio = wallSeconds(*paper) / wallSeconds(*ours);
  const double error = largestBoundaryError(*ours), paperError = largestBoundaryError(*paper);
  target.measured = text("%.1f times faster, %.1e against %.1e", ratio, error, paperError);
  target.met = ratio >= 50 && error < paperError;
  return target;
}

/// The fastest row of ours that is 100 times more accurate than the opponent at 256^3; else the most
/// accurate.
Target voxelTarget(const std::vector<Json>& results, const std::string& opponent) {
  Target target{"ball: faster than " + method(opponent).title + " at 256^3 and 100 times more accurate", "",
                std::nullopt};
  const Json* theirs = find(results, {.method = opponent, .shape = "ball", .size = 256});
  if (!theirs) return target;
  const double goal = number(*theirs, "error_max") / 100;
  const Json* best = nullptr;
  for (const Json& r : results) {
    if (!succeeded(r) || r.at("method") != "layer" || r.at("shape") != "ball") continue;
    const bool better = best && (number(*best, "error_max") <= goal
                                     ? number(r, "error_max") <= goal && wallSeconds(r) < wallSeconds(*best)
                                     : number(r, "error_max") < number(*best, "error_max"));
    if (!best || better) best = &r;
  }
  if (!best) return target;
  target.measured = text("n = %.0f: %.1f s against %.1f s, error %.1e against %.1e", number(*best, "surface"),
                         wallSeconds(*best), wallSeconds(*theirs), number(*best, "error_max"),
                         number(*theirs, "error_max"));
  target.met = wallSeconds(*best) < wallSeconds(*theirs) && number(*best, "error_max") <= goal;
  return target;
}

/// Names the models that miss it.
Target modelsTarget(const std::vector<Json>& results) {
  Target target{
      "every star-shaped model, default options: boundary error at most 1e-3, charge within 1e-4 of -1", "",
      std::nullopt};
  int models = 0;
  std::string misses;
  for (const Json& r : results) {
    const Row row = rowOf(r);
    if (row.size != 0) continue;
    ++models;
    const double error = largestBoundaryError(r), charge = number(r, "charge") + 1;
    if (succeeded(r) && error <= 1e-3 && std::abs(charge) <= 1e-4) continue;
    misses += (misses.empty() ? "; all but " : ", ") + row.shape +
              (succeeded(r)
                   ? text(" (%.1e, charge + 1 = %.0e, ", error, charge) + r.value("stop", std::string()) + ")"
                   : " (" + r.at("status").get<std::string>() + ")");
  }
  if (models == 0) return target;
  target.measured = text("%d models", models) + misses;
  target.met = misses.empty();
  return target;
}

}  // namespace

bool succeeded(const Json& result) { return result.at("status") == "ok"; }

double wallSeconds(const Json& result) {
  return result.at("setup").at("wall").get<double>() + result.at("solve").at("wall").get<double>();
}

double cpuSeconds(const Json& result) {
  return result.at("setup").at("cpu").get<double>() + result.at("solve").at("cpu").get<double>();
}

std::optional<Exponent> timeExponent(const std::vector<Json>& results, const std::string& shape) {
  std::vector<std::pair<double, double>> points;  // ln n, ln time
  for (const Json& r : results) {
    const Row row = rowOf(r);
    if (!succeeded(r) || row.method != "layer" || row.shape != shape || row.tolerance != 0 ||
        row.size < 10000)
      continue;
    points.emplace_back(std::log(number(r, "surface")), std::log(wallSeconds(r)));
  }
  if (points.size() < 2) return std::nullopt;
  double meanX = 0, meanY = 0, xx = 0, xy = 0;
  for (const auto& [x, y] : points) {
    meanX += x / static_cast<double>(points.size());
    meanY += y / static_cast<double>(points.size());
  }
  for (const auto& [x, y] : points) {
    xx += (x - meanX) * (x - meanX);
    xy += (x - meanX) * (y - meanY);
  }
  const auto [low, high] = std::minmax_element(points.begin(), points.end());
  return Exponent{xy / xx, static_cast<std::size_t>(std::lround(std::exp(low->first))),
                  static_cast<std::size_t>(std::lround(std::exp(high->first)))};
}

std::vector<Target> judgeTargets(const std::vector<Json>& results) {
  std::vector<Target> targets;
  for (const std::string& shape : scalingShapes()) {
    for (const Goal& goal : goals()) targets.push_back(sizeTarget(results, shape, goal));
    targets.push_back(millionTarget(results, shape));
    targets.push_back(exponentTarget(results, shape));
  }
  for (const char* shape : {"ball", "half ball", "cube"}) targets.push_back(mfsTarget(results, shape));
  for (const char* opponent : {"openvdb", "openvdb-cut"}) targets.push_back(voxelTarget(results, opponent));
  targets.push_back(modelsTarget(results));
  return targets;
}

}  // namespace polestar::bench
