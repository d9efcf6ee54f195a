#include "cli/domain_input.h"

#include <map>

#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/map/ball_motion.h"
#include "polestar/map/composed_map.h"
#include "polestar/map/distortion.h"
#include "polestar/map/shell_map.h"
#include "polestar/polycube/polycube_text.h"

namespace polestar::cli {
namespace {

PolycubeFit chooseDomain(const StarShape& shape, const DomainChoices& choices, Session& session) {
  PolycubeOptions options;
  if (choices.cells) options.cells = *choices.cells;
  options.overlap = choices.overlap;
  if (choices.axes) options.rotation = rotationXyz(*choices.axes);
  return session.timed("polycube", [&] {
    if (choices.domain == DomainChoice::cube)
      return placePolycube(shape, cubeDomain(), options, session.context());
    if (!choices.polycube.empty())
      return placePolycube(shape, readPolycube(choices.polycube), options, session.context());
    return fitPolycube(shape, options, session.context());
  });
}

Json describeBands(const std::vector<DistortionBand>& bands) {
  Json list = Json::array();
  for (const DistortionBand& band : bands) {
    list.push_back({{"from", band.from},
                    {"to", std::isfinite(band.to) ? Json(band.to) : Json()},
                    {"points", band.distortion.points},
                    {"folded", band.distortion.folded},
                    {"mips_mean", band.distortion.mipsMean},
                    {"mips_p99", band.distortion.mipsP99},
                    {"volume_p5", band.distortion.volumeP5},
                    {"volume_p95", band.distortion.volumeP95}});
  }
  return list;
}

Json describeMotion(const VolumeMap& motion) {
  if (const auto* shells = dynamic_cast<const ShellMap*>(&motion)) {
    return {{"kind", "table"},
            {"triangles", shells->table().triangles.size()},
            {"largest_dilatation", shells->largestDilatation()}};
  }
  return {{"kind", "moebius"}, {"pull", dynamic_cast<const BallMotion&>(motion).pull().norm()}};
}

}  // namespace

void DomainChoices::validate() const {
  const auto onlyFor = [&](bool given, const char* option, bool fits, const char* whose) {
    if (given && !fits)
      throw Error(Errc::usage, std::string(option) + " has no effect here; it is for " + whose);
  };
  const bool found = domain == DomainChoice::polycube && polycube.empty();
  onlyFor(cells.has_value(), "--cells", found, "--domain polycube without --polycube");
  onlyFor(overlap.has_value(), "--overlap", found, "--domain polycube without --polycube");
  onlyFor(!polycube.empty(), "--polycube", domain == DomainChoice::polycube, "--domain polycube");
  onlyFor(axes.has_value(), "--domain-axes", domain != DomainChoice::ball, "--domain cube and polycube");
}

void addDomainOptions(CLI::App& app, DomainChoices& choices) {
  static const std::map<std::string, DomainChoice> kDomains{
      {"ball", DomainChoice::ball}, {"cube", DomainChoice::cube}, {"polycube", DomainChoice::polycube}};
  app.add_option(
         "--domain", choices.domain,
         "Where the coordinates live: ball (default), cube ([-1, 1]^3), or polycube, cells of a cubic "
         "lattice that resemble the solid")
      ->transform(CLI::CheckedTransformer(kDomains).description(""))
      ->type_name("KIND");
  app.add_option("--cells", choices.cells,
                 "Of a polycube: cells along the solid's longest side, 1 to 64; default 8")
      ->type_name("K");
  app.add_option("--overlap", choices.overlap,
                 "Of a polycube: the one with the fewest corners, up to --cells, that overlaps the solid by "
                 "this share (volume of the intersection over that of the union), such as 0.8")
      ->type_name("SHARE");
  app.add_option("--polycube", choices.polycube,
                 "A polycube by hand: a file of cells \"i j k\", or rows of them \"-2:2 0 0\"; cell 0 0 0 "
                 "holds the center")
      ->type_name("FILE");
  addPointOption(app, "--domain-axes", choices.axes,
                 "Turn the lattice by these degrees about x, then y, then z; default the best of many, 0,0,0 "
                 "leaves it along the mesh's axes")
      ->type_name("ax,ay,az");
}

std::optional<DomainMap> makeDomainMap(const BallMap& map, const MapChoices& mapChoices,
                                       const DomainChoices& choices, Session& session) {
  if (choices.domain == DomainChoice::ball) return std::nullopt;
  const PolycubeFit fit = chooseDomain(map.chart().green().shape(), choices, session);
  MapTimings timings;
  DomainMap domain = mapToDomain(map, fit, toMapOptions(mapChoices), session.context(), &timings);
  session.noteSeconds("domain_green", timings.green);
  session.noteSeconds("domain_trace", timings.trace);
  session.noteSeconds("domain_sphere", timings.sphere);
  const std::vector<DistortionBand> bands =
      session.timed("distortion", [&] { return distortionByEdges(domain); });
  const DomainShape& shape = domain.shape();
  const BallMap& ball = domain.domain();
  session.json()["domain"] = {
      {"kind", shape.kind},
      {"cells", fit.polycube.cells().size()},
      {"cell_side", shape.cellSide},
      {"corners", fit.polycube.corners()},
      {"margin_cells", fit.polycube.margin()},
      {"overlap", shape.overlap},
      {"axes",
       {toJson(Vec3(shape.axes.col(0))), toJson(Vec3(shape.axes.col(1))), toJson(Vec3(shape.axes.col(2)))}},
      {"unit", shape.unit},
      {"vertices", ball.chart().foliation().vertexCount},
      {"boundary_error", ball.chart().green().boundaryError().max},
      {"motion", describeMotion(domain.motion())},
      {"distortion_by_edge_distance", describeBands(bands)}};
  return domain;
}

}  // namespace polestar::cli
