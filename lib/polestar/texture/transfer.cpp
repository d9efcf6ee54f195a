#include "polestar/texture/transfer.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <atomic>
#include <cctype>
#include <functional>
#include <sstream>

#include "polestar/core/error.h"
#include "polestar/texture/detail/leaf_images.h"
#include "polestar/texture/line_integral.h"

namespace polestar {

std::vector<std::string> gridsOfColor(ColorNames names) {
  switch (names) {
    case ColorNames::houdini:
      return {"Cd"};
    case ColorNames::blender:
      return {"color"};
    case ColorNames::both:
      break;
  }
  return {"Cd", "color"};
}

namespace {

using detail::LeafImager;
using detail::LeafImages;

/// One quantity of the texture, and the grids of the target that show it.
struct Output {
  std::vector<std::string> names;
  bool vector = true;
  ValueRole role = ValueRole::invariant;
  bool half = false;
  bool color = false;
};

/// Values of one output at the voxels of a leaf.
struct OutputValues {
  std::vector<Vec3f> values;  ///< scalars in the first coordinate
  std::vector<std::uint8_t> active;
};

using Look = std::function<void(const LeafImages&, std::size_t output, OutputValues&)>;

void copyOut(const OutputValues& from, const Output& output, std::size_t first, AttributeValues& to) {
  for (std::size_t n = 0; n < output.names.size(); ++n) {
    const std::size_t attribute = first + n;
    std::copy(from.active.begin(), from.active.end(), to.active(attribute).begin());
    if (output.vector) {
      std::copy(from.values.begin(), from.values.end(), to.vectors(attribute).begin());
    } else {
      std::transform(from.values.begin(), from.values.end(), to.scalars(attribute).begin(),
                     [](const Vec3f& value) { return value.x(); });
    }
  }
}

/// Makes colors darker and lighter along the fibers at the voxels of a leaf.
using Shade = std::function<void(const VoxelBatch&, OutputValues&)>;

/// Passes over the voxels of one solid, each with some of the outputs.
class Filler {
 public:
  Filler(const TextureRoute& route, const TransferOptions& options, Context& context)
      : route_(route), options_(options), context_(context), result_{start(), {}} {
    result_.report.voxels = result_.grids.activeVoxels();
  }

  const TriMesh& surface() const { return route_.target().chart().green().shape().surface().mesh(); }

  void pass(const std::vector<Output>& outputs, bool jacobians, const Look& look, const Shade& shade = {}) {
    std::vector<Attribute> attributes;
    std::vector<std::size_t> firstOf;
    for (const Output& output : outputs) {
      firstOf.push_back(attributes.size());
      for (const std::string& name : output.names)
        attributes.push_back({name, output.vector, output.role, output.half});
    }
    const LeafImager imager(route_, jacobians, options_.mapped.get());
    std::atomic<std::size_t> unanswered{0};
    result_.grids.add(
        attributes,
        [&](const VoxelBatch& batch, AttributeValues& values) {
          LeafImages images;
          imager.locate(batch, images);
          unanswered +=
              static_cast<std::size_t>(std::count_if(images.places.begin(), images.places.end(),
                                                     [](const Vec3& place) { return !place.allFinite(); }));
          OutputValues some;
          for (std::size_t o = 0; o < outputs.size(); ++o) {
            some.values.assign(batch.points.size(), Vec3f::Zero());
            some.active.assign(batch.points.size(), 1);
            look(images, o, some);
            if (shade && outputs[o].color) shade(batch, some);
            copyOut(some, outputs[o], firstOf[o], values);
          }
        },
        true, context_);
    result_.report.unanswered = std::max<std::size_t>(result_.report.unanswered, unanswered);
    result_.report.blocks += imager.blocks();
    result_.report.interpolated += imager.interpolatedBlocks();
  }

  /// By the grid `fiber` of a pass before.
  Shade fibers() const {
    const double diagonal = boundingBox(surface()).diagonal();
    const LineIntegralOptions drawing{.length = options_.fibers.length * diagonal,
                                      .thickness = options_.fibers.thickness * diagonal};
    const auto grid = std::make_shared<const SampledGrid>(*result_.grids.lookUp().find("fiber", true));
    const FiberField field = [grid](std::span<const Vec3> points, std::span<Vec3> directions) {
      std::vector<Vec3f> values(points.size());
      std::vector<float> weights(points.size());
      grid->sample(points, {}, values, weights);
      for (std::size_t i = 0; i < points.size(); ++i) directions[i] = values[i].cast<double>();
    };
    const auto strength = static_cast<float>(options_.fibers.strength);
    return [=](const VoxelBatch& batch, OutputValues& colors) {
      std::vector<float> streaks(batch.points.size());
      lineIntegral(batch.points, field, drawing, streaks);
      for (std::size_t i = 0; i < streaks.size(); ++i) colors.values[i] *= 1 + strength * streaks[i];
    };
  }

  /// Adds the target's own ball coordinates, as `map` writes them.
  void addRest() {
    result_.grids.addVector(
        "rest", ValueRole::invariant,
        [&](const VoxelBatch& batch, std::span<Vec3f> rest) {
          std::vector<Vec3> ball(batch.points.size());
          std::vector<double> green(batch.points.size());
          route_.target().sample(batch.points, ball, green);
          for (std::size_t i = 0; i < ball.size(); ++i) rest[i] = ball[i].cast<float>();
        },
        true, context_);
  }

  Transfer& result() { return result_; }

 private:
  SolidGrids start() const {
    if (!options_.mapped) return {surface(), options_.grids, context_};
    return options_.mapped->sharing(options_.rest ? std::vector<std::string>{"rest"}
                                                  : std::vector<std::string>{});
  }

  const TextureRoute& route_;
  const TransferOptions& options_;
  Context& context_;
  Transfer result_;
};

/// The grain first, where fibers are drawn along it; else all at once.
Transfer fill(const TextureRoute& route, const std::vector<Output>& outputs, const Look& look,
              const TransferOptions& options, Context& context) {
  options.fibers.validate();
  const auto needsJacobian = [](const Output& output) {
    return output.role != ValueRole::invariant && output.role != ValueRole::position;
  };
  const auto anyJacobian = [&](const std::vector<Output>& some) {
    return std::any_of(some.begin(), some.end(), needsJacobian);
  };
  Filler filler(route, options, context);
  const auto fiber = std::find_if(outputs.begin(), outputs.end(), [](const Output& output) {
    return output.names.front() == "fiber" && output.role == ValueRole::contravariant;
  });
  if (options.fibers.strength > 0) {
    if (fiber == outputs.end())
      throw Error(Errc::usage, "no fibers can be drawn: the texture has no grain, no vectors named fiber");
    const auto number = static_cast<std::size_t>(fiber - outputs.begin());
    filler.pass({*fiber}, true, [&](const LeafImages& images, std::size_t, OutputValues& values) {
      look(images, number, values);
    });
    std::vector<Output> others = outputs;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(number));
    filler.pass(
        others, anyJacobian(others),
        [&](const LeafImages& images, std::size_t o, OutputValues& values) {
          look(images, o < number ? o : o + 1, values);
        },
        filler.fibers());
  } else {
    filler.pass(outputs, anyJacobian(outputs), look);
  }
  if (options.rest && !options.mapped) filler.addRest();
  return std::move(filler.result());
}

std::string lowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

bool isColorName(const std::string& name) {
  return name == "Cd" || name == "color" || name == "Color" || name == "cd";
}

/// Three scalars that are one color, in the order of `names`.
const std::vector<std::array<const char*, 3>>& colorTriples() {
  static const std::vector<std::array<const char*, 3>> triples = {{"r", "g", "b"},
                                                                  {"red", "green", "blue"},
                                                                  {"cd.x", "cd.y", "cd.z"},
                                                                  {"cd_x", "cd_y", "cd_z"},
                                                                  {"cd.r", "cd.g", "cd.b"},
                                                                  {"cd_r", "cd_g", "cd_b"},
                                                                  {"color.r", "color.g", "color.b"},
                                                                  {"color_r", "color_g", "color_b"},
                                                                  {"color.x", "color.y", "color.z"},
                                                                  {"color_x", "color_y", "color_z"}};
  return triples;
}

const SampledGrid* findScalar(const SampledGrids& file, const std::string& lower) {
  for (const SampledGrid& grid : file.grids()) {
    if (!grid.isVector() && lowerCase(grid.name()) == lower) return &grid;
  }
  return nullptr;
}

void requireFinite(const SampledGrid& grid) {
  const SampledGrid::NotFinite bad = grid.notFinite();
  if (bad.count == 0) return;
  std::ostringstream message;
  message << "the grid " << grid.name() << " has " << bad.count
          << " values that are no numbers, the first near (" << bad.first.x() << ", " << bad.first.y() << ", "
          << bad.first.z() << "): mend it where it was made";
  throw Error(Errc::io, message.str());
}

bool isOfTheSolid(const std::string& name) {
  return name == "surface" || name == "density" || name == "rest" || name == "green";
}

std::string namesIn(const SampledGrids& file) {
  std::string text;
  for (const SampledGrid& grid : file.grids()) text += (text.empty() ? "" : ", ") + grid.name();
  for (const LeftOutGrid& grid : file.leftOut())
    text += (text.empty() ? "" : ", ") + grid.name + " (" + grid.type + ", not carried)";
  return text.empty() ? "no grid" : text;
}

std::string howCarried(const SampledGrid& grid) {
  if (!grid.isVector()) return "filtered";
  switch (grid.role()) {
    case ValueRole::contravariant:
      return "filtered, as vectors by the inverse Jacobian";
    case ValueRole::covariant:
      return "filtered, as covectors by the transposed Jacobian";
    case ValueRole::covariantNormalized:
      return "filtered, as covectors by the transposed Jacobian, normalized";
    case ValueRole::position:
      return "filtered, as positions by the way back";
    case ValueRole::invariant:
      break;
  }
  return "filtered";
}

/// Values of the source's world in the target's.
void turnVectors(const TextureRoute& route, ValueRole role, const LeafImages& images, OutputValues& values) {
  if (role == ValueRole::invariant) return;
  if (role == ValueRole::position) {
    std::vector<Vec3> before(values.values.size()), after(values.values.size());
    for (std::size_t i = 0; i < before.size(); ++i) before[i] = values.values[i].cast<double>();
    route.inverse(before, after);
    for (std::size_t i = 0; i < before.size(); ++i) {
      if (!after[i].allFinite()) values.active[i] = 0;
      values.values[i] = values.active[i] ? Vec3f(after[i].cast<float>()) : Vec3f(Vec3f::Zero());
    }
    return;
  }
  for (std::size_t i = 0; i < values.values.size(); ++i) {
    const Mat3& jacobian = images.jacobians[i];
    Vec3 vector = values.values[i].cast<double>();
    vector = role == ValueRole::contravariant ? Vec3(jacobian.inverse() * vector)
                                              : Vec3(jacobian.transpose() * vector);
    if (role == ValueRole::covariantNormalized && vector.norm() > 0) vector.normalize();
    if (!vector.allFinite()) values.active[i] = 0;
    values.values[i] = values.active[i] ? Vec3f(vector.cast<float>()) : Vec3f(Vec3f::Zero());
  }
}

void lookUp(const CarriedGrid& grid, const LeafImages& images, OutputValues& values) {
  std::vector<float> weights(images.places.size());
  std::vector<Vec3f> part(images.places.size());
  for (std::size_t s = 0; s < grid.sources.size(); ++s) {
    grid.sources[s].sample(images.places, images.footprints, part, weights);
    for (std::size_t i = 0; i < part.size(); ++i) {
      if (grid.sources.size() == 1) {
        values.values[i] = part[i];
      } else {
        values.values[i][static_cast<Eigen::Index>(s)] = part[i].x();
      }
      if (!(weights[i] > 0)) values.active[i] = 0;
    }
  }
}

/// Grids that lie nowhere in the body belong to another one.
void requireOverlap(const TextureRoute& route, const CarriedGrid& grid) {
  const Box body = boundingBox(route.source()->chart().green().shape().surface().mesh());
  const Box box = grid.sources.front().activeBox();
  const bool apart = (box.min.array() > body.max.array()).any() || (box.max.array() < body.min.array()).any();
  if (!apart) return;
  std::ostringstream message;
  message << "the grid " << grid.sources.front().name()
          << " lies outside of the source's solid: it reaches from (" << box.min.x() << ", " << box.min.y()
          << ", " << box.min.z() << ") to (" << box.max.x() << ", " << box.max.y() << ", " << box.max.z()
          << "), the solid from (" << body.min.x() << ", " << body.min.y() << ", " << body.min.z() << ") to ("
          << body.max.x() << ", " << body.max.y() << ", " << body.max.z()
          << "); is it of another body, or in other units?";
  throw Error(Errc::usage, message.str());
}

}  // namespace

void DrawnFibers::validate() const {
  if (!(strength >= 0 && strength <= 1))
    throw Error(Errc::usage, "the strength of fibers must lie in [0, 1]");
  if (!(thickness > 0 && thickness < 1 && length > 0 && length < 1))
    throw Error(Errc::usage,
                "the thickness and length of fibers are shares of the box's diagonal, in (0, 1)");
}

Transfer transferTexture(const TextureRoute& route, const SolidTexture& texture,
                         const TransferOptions& options, Context& context) {
  if (route.source()) throw Error(Errc::usage, "a texture of the ball has no body of its own");
  std::vector<Output> outputs{
      {gridsOfColor(options.colorNames), true, ValueRole::invariant, options.halfColors, true}};
  if (texture.hasFiber()) outputs.push_back({{"fiber"}, true, ValueRole::contravariant, options.halfColors});

  const Look look = [&](const LeafImages& images, std::size_t output, OutputValues& values) {
    const std::size_t count = images.places.size();
    if (output == 0) {
      std::vector<TexturePoint> points(count);
      std::vector<TextureSample> samples(count);
      for (std::size_t i = 0; i < count; ++i) {
        values.active[i] = images.places[i].allFinite();
        if (values.active[i]) points[i] = {images.places[i], images.footprints[i]};
      }
      texture.sample(points, samples);
      for (std::size_t i = 0; i < count; ++i) {
        if (values.active[i]) values.values[i] = samples[i].color;
      }
      return;
    }
    std::vector<Vec3> ball(count), direction(count);
    for (std::size_t i = 0; i < count; ++i)
      ball[i] = images.places[i].allFinite() ? images.places[i] : Vec3(Vec3::Zero());
    texture.fiber(ball, direction);
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 carried = images.jacobians[i].inverse() * direction[i];
      const double length = carried.norm();
      values.active[i] = images.places[i].allFinite() && carried.allFinite() && length > 0;
      if (values.active[i]) values.values[i] = (carried / length).cast<float>();
    }
  };
  Transfer result = fill(route, outputs, look, options, context);
  for (const std::string& name : outputs[0].names) result.report.grids.push_back({name, "", "filtered", ""});
  if (texture.hasFiber())
    result.report.grids.push_back({"fiber", "", "by the inverse Jacobian, normalized", ""});
  return result;
}

std::vector<CarriedGrid> chooseGrids(const SampledGrids& file, const std::vector<std::string>& names) {
  std::vector<CarriedGrid> chosen;
  std::vector<std::string> inTriple;
  const auto addTriple = [&](const std::array<const char*, 3>& triple) {
    CarriedGrid color{.sources = {}, .name = "Cd", .color = true};
    for (const char* name : triple) {
      const SampledGrid* grid = findScalar(file, name);
      if (!grid) return;
      color.sources.push_back(*grid);
    }
    for (const char* name : triple) inTriple.emplace_back(name);
    chosen.push_back(std::move(color));
  };
  if (names.empty()) {
    const bool hasColor = std::any_of(file.grids().begin(), file.grids().end(), [](const SampledGrid& grid) {
      return grid.isVector() && isColorName(grid.name());
    });
    for (const auto& triple : colorTriples()) {
      if (!hasColor && chosen.empty()) addTriple(triple);
    }
  }
  bool colorTaken = !chosen.empty();
  for (const SampledGrid& grid : file.grids()) {
    const bool named = std::find(names.begin(), names.end(), grid.name()) != names.end();
    const bool part = std::find(inTriple.begin(), inTriple.end(), lowerCase(grid.name())) != inTriple.end();
    if (names.empty() ? isOfTheSolid(grid.name()) || part : !named) continue;
    // `Cd` and `color` of one file are the same color twice.
    const bool color = grid.isVector() && isColorName(grid.name());
    if (color && colorTaken) continue;
    colorTaken |= color;
    chosen.push_back({{grid}, grid.name(), color});
  }
  for (const std::string& name : names) {
    const bool found = std::any_of(file.grids().begin(), file.grids().end(),
                                   [&](const SampledGrid& grid) { return grid.name() == name; });
    if (!found)
      throw Error(Errc::usage, "there is no grid " + name + " to carry; the file has " + namesIn(file));
  }
  if (chosen.empty()) {
    throw Error(Errc::io,
                "there is no grid to carry: colors are looked for in Cd or color, or in three grids r, g "
                "and b; the file has " +
                    namesIn(file));
  }
  for (const CarriedGrid& grid : chosen) {
    for (const SampledGrid& source : grid.sources) requireFinite(source);
  }
  return chosen;
}

Transfer transferGrids(const TextureRoute& route, const std::vector<CarriedGrid>& grids,
                       const TransferOptions& options, Context& context) {
  if (!route.source()) throw Error(Errc::usage, "the grids' own body has no map");
  std::vector<Output> outputs;
  for (const CarriedGrid& grid : grids) {
    requireOverlap(route, grid);
    const SampledGrid& first = grid.sources.front();
    Output output{
        {grid.name}, first.isVector() || grid.sources.size() == 3, first.role(), first.savedAsHalf()};
    if (grid.color) {
      output.names = gridsOfColor(options.colorNames);
      output.half = options.halfColors;
      output.color = true;
    }
    outputs.push_back(std::move(output));
  }
  const Look look = [&](const LeafImages& images, std::size_t o, OutputValues& values) {
    lookUp(grids[o], images, values);
    turnVectors(route, outputs[o].role, images, values);
  };
  Transfer result = fill(route, outputs, look, options, context);
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    for (const std::string& name : outputs[o].names) {
      const SampledGrid& source = grids[o].sources.front();
      result.report.grids.push_back(
          {name, source.name(), howCarried(source),
           source.isLevelSet() ? "a level set is no distance any more: written as class unknown" : ""});
    }
  }
  return result;
}

}  // namespace polestar
