#include "polestar/map/iso_geometry.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "polestar/core/error.h"

namespace polestar {
namespace {

constexpr double kRadians = std::numbers::pi / 180;
constexpr int kCirclePieces = 32;                   // of a circle at first: 11 degrees
constexpr int kSheetRows = 24, kSheetColumns = 48;  // along the radius and from pole to pole

const TriMesh& surfaceOf(const BallMap& map) { return map.chart().green().shape().surface().mesh(); }

std::string levelName(const char* what, double level) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, level).ptr;
  return std::string(what) + "_" + std::string(digits, end);
}

/// Colatitude and longitude, radians.
Vec3 onSphere(double colatitude, double longitude) {
  return {std::sin(colatitude) * std::cos(longitude), std::sin(colatitude) * std::sin(longitude),
          std::cos(colatitude)};
}

/// Longitudes from pole to pole, and latitudes between the poles, on the sphere of a radius.
std::vector<DomainCurve> graticuleCurves(double radius, double degrees) {
  std::vector<DomainCurve> curves;
  const int meridians = std::max(1, static_cast<int>(std::lround(360 / degrees)));
  for (int m = 0; m < meridians; ++m) {
    const double longitude = 2 * std::numbers::pi * m / meridians;
    curves.push_back({[=](double t) -> Vec3 { return radius * onSphere(std::numbers::pi * t, longitude); },
                      kCirclePieces / 2});
  }
  const int bands = std::max(2, static_cast<int>(std::lround(180 / degrees)));
  for (int b = 1; b < bands; ++b) {
    const double colatitude = std::numbers::pi * b / bands;
    curves.push_back(
        {[=](double t) -> Vec3 { return radius * onSphere(colatitude, 2 * std::numbers::pi * t); },
         kCirclePieces});
  }
  return curves;
}

/// Collects points with their data.
class Builder {
 public:
  explicit Builder(const BallMap& map) : map_(map) {}

  PolyPart& part(std::string name) {
    data_.parts.emplace_back();
    data_.parts.back().name = std::move(name);
    return data_.parts.back();
  }

  /// Returns the first one's number.
  std::int32_t points(std::span<const Vec3> domain, std::span<const Vec3> solid) {
    const std::size_t first = data_.points.size();
    if (first + solid.size() > static_cast<std::size_t>(std::numeric_limits<std::int32_t>::max()))
      throw Error(Errc::usage, "iso-surfaces and curves of more than 2^31 points; ask for fewer");
    data_.points.insert(data_.points.end(), solid.begin(), solid.end());
    domain_.insert(domain_.end(), domain.begin(), domain.end());
    arc_.resize(data_.points.size(), 0.0);
    return static_cast<std::int32_t>(first);
  }

  void curve(PolyPart& part, const SolidCurve& curve) {
    const std::int32_t first = points(curve.domain, curve.solid);
    std::vector<std::int32_t> line(curve.solid.size());
    for (std::size_t i = 0; i < line.size(); ++i) {
      line[i] = first + static_cast<std::int32_t>(i);
      if (i > 0) arc_[line[i]] = arc_[line[i] - 1] + (curve.solid[i] - curve.solid[i - 1]).norm();
    }
    part.lines.push_back(std::move(line));
  }

  PolyData finish() {
    std::vector<Vec3> unused(data_.points.size());
    std::vector<double> green(data_.points.size());
    map_.sample(data_.points, unused, green);
    double largest = 0;
    for (const double g : green) {
      if (std::isfinite(g)) largest = std::max(largest, g);
    }
    MeshData radius, ball, potential, arc;
    radius.name = "radius";
    potential.name = "green";
    ball.name = "ball";
    arc.name = "arc";
    ball.components = 3;
    for (const Vec3& b : domain_) {
      radius.values.push_back(b.norm());
      ball.values.insert(ball.values.end(), b.data(), b.data() + 3);
    }
    for (const double g : green) potential.values.push_back(std::isfinite(g) ? g : largest);
    arc.values = std::move(arc_);
    data_.pointData = {std::move(radius), std::move(potential), std::move(ball), std::move(arc)};
    return std::move(data_);
  }

 private:
  const BallMap& map_;
  PolyData data_;
  std::vector<Vec3> domain_;
  std::vector<double> arc_;
};

std::vector<Vec3> scaled(std::span<const Vec3> directions, double level) {
  std::vector<Vec3> points(directions.begin(), directions.end());
  for (Vec3& point : points) point *= level;
  return points;
}

/// Half a disk of the ball, of constant longitude: rows of quads along the radius, triangles at the center.
void addSheet(const BallMap& map, int number, int count, Builder& builder) {
  const double longitude = 2 * std::numbers::pi * number / count;
  const DomainGrid grid{[=](double u, double v) -> Vec3 {
                          const double radius = (1 + v * (kSheetRows - 1)) / kSheetRows;
                          return radius * onSphere(std::numbers::pi * u, longitude);
                        },
                        kSheetColumns, kSheetRows - 1};
  const SolidCurve sheet = traceGrid(map, grid);
  PolyPart& part = builder.part("sheet_" + std::to_string(number));
  const Vec3 pole = Vec3::Zero(), center = pointsOfSolid(map, {&pole, 1})[0];
  const std::int32_t middle = builder.points({&pole, 1}, {&center, 1});
  const std::int32_t first = builder.points(sheet.domain, sheet.solid);
  for (int column = 0; column < grid.columns; ++column) {
    part.triangles.push_back({middle, first + column, first + column + 1});
    for (int row = 0; row < grid.rows; ++row) {
      const std::int32_t at = first + row * (grid.columns + 1) + column;
      part.quads.push_back({at, at + grid.columns + 1, at + grid.columns + 2, at + 1});
    }
  }
}

}  // namespace

void IsoOptions::validate() const {
  for (const double level : levels) {
    if (!(level > 0 && level <= 1))
      throw Error(Errc::usage, "levels of the ball radius lie above 0, up to 1");
  }
  if (lines < 0 || sheets < 0) throw Error(Errc::usage, "numbers of lines and sheets must not be negative");
  if (graticule != 0 && !(graticule >= 1 && graticule <= 90))
    throw Error(Errc::usage, "a graticule's step is 1 to 90 degrees");
  if (graticule != 0 && levels.empty())
    throw Error(Errc::usage, "a graticule is drawn on levels, and there are none");
  if (!(tolerance > 0 && tolerance < 1)) throw Error(Errc::usage, "the tolerance lies between 0 and 1");
}

std::vector<Vec3> evenDirections(std::size_t count) {
  const double golden = std::numbers::pi * (3 - std::sqrt(5.0));
  std::vector<Vec3> directions;
  for (std::size_t i = 0; i < count; ++i) {
    const double z = 1 - (2 * static_cast<double>(i) + 1) / static_cast<double>(count);
    directions.push_back(onSphere(std::acos(z), golden * static_cast<double>(i)));
  }
  return directions;
}

TriMesh levelSurface(const BallMap& map, double level) {
  TriMesh mesh;
  mesh.triangles = map.chart().foliation().triangles;
  mesh.vertices = level == 1 ? surfaceOf(map).vertices : pointsOfLevel(map, map.sphere().directions, level);
  return mesh;
}

std::vector<Vec3> pointsOfLevel(const VolumeMap& map, std::span<const Vec3> directions, double level) {
  return pointsOfSolid(map, scaled(directions, level));
}

std::vector<SolidCurve> radialLines(const VolumeMap& map, std::span<const Vec3> directions, double from,
                                    double tolerance, Context& context) {
  std::vector<DomainCurve> radii;
  for (const Vec3& direction : directions) radii.push_back(domainPolyline({from * direction, direction}));
  return traceCurves(map, radii, {.tolerance = tolerance}, context);
}

PolyData isoGeometry(const BallMap& map, const IsoOptions& options, Context& context) {
  options.validate();
  const double tolerance = options.tolerance * boundingBox(surfaceOf(map)).diagonal();
  Builder builder(map);
  for (const double level : options.levels) {
    context.throwIfCancelled();
    const TriMesh mesh = levelSurface(map, level);
    PolyPart& part = builder.part(levelName("level", level));
    const std::int32_t first = builder.points(scaled(map.sphere().directions, level), mesh.vertices);
    for (const Triangle& t : mesh.triangles)
      part.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  }
  if (options.graticule > 0) {
    for (const double level : options.levels) {
      PolyPart& part = builder.part(levelName("graticule", level));
      for (const SolidCurve& curve :
           traceCurves(map, graticuleCurves(level, options.graticule), {.tolerance = tolerance}, context))
        builder.curve(part, curve);
    }
  }
  if (options.lines > 0) {
    PolyPart& part = builder.part("field_lines");
    const std::vector<Vec3> directions = evenDirections(static_cast<std::size_t>(options.lines));
    for (const SolidCurve& curve : radialLines(map, directions, 0, tolerance, context))
      builder.curve(part, curve);
  }
  for (int k = 0; k < options.sheets; ++k) addSheet(map, k, options.sheets, builder);
  return builder.finish();
}

}  // namespace polestar
