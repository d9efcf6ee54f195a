// polestar eval: ball coordinates, Green's function and its gradient at given points.

#include <cmath>
#include <limits>

#include "cli/dry_run.h"
#include "cli/map_input.h"
#include "cli/points.h"
#include "cli/solid_input.h"
#include "cli/text.h"
#include "commands.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

/// NaN where a point lies outside.
struct Values {
  std::vector<Vec3> ball;
  std::vector<Vec3> domain;    ///< empty where the ball is the domain
  std::vector<double> green;   ///< 1/mesh unit; +infinity at the center
  std::vector<Vec3> gradient;  ///< 1/mesh unit^2
};

Json numberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(); }
Json pointOrNull(const Vec3& point) { return point.allFinite() ? toJson(point) : Json(); }

void fillAnswer(const std::vector<Vec3>& points, const Values& values, Session& session) {
  Json& json = session.json();
  const bool ofDomain = !values.domain.empty();
  for (const char* name : {"points", "ball", "green", "gradient"}) json[name] = Json::array();
  if (ofDomain) json["domain"] = Json::array();
  std::string& text = session.text();
  text = "# x y z  ball_x ball_y ball_z  green  gradient_x gradient_y gradient_z";
  text += ofDomain ? "  domain_x domain_y domain_z\n" : "\n";
  const auto append = [&](const Vec3& vector) {
    for (int axis = 0; axis < 3; ++axis) text += (axis ? " " : "") + exactNumber(vector[axis]);
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (session.options().json) {
      json["points"].push_back(toJson(points[i]));
      json["ball"].push_back(pointOrNull(values.ball[i]));
      json["green"].push_back(numberOrNull(values.green[i]));
      json["gradient"].push_back(pointOrNull(values.gradient[i]));
      if (ofDomain) json["domain"].push_back(pointOrNull(values.domain[i]));
      continue;
    }
    append(points[i]);
    text += "  ";
    append(values.ball[i]);
    text += "  " + exactNumber(values.green[i]) + "  ";
    append(values.gradient[i]);
    if (ofDomain) {
      text += "  ";
      append(values.domain[i]);
    }
    text += "\n";
  }
}

class EvalCommand final : public Command {
 public:
  Description description() const override {
    return {"eval", "Ball coordinates, Green's function and its gradient at points of a solid",
            "Write the answer to FILE instead of standard output",
            "polestar eval asteroid.obj --points points.txt --json"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("INPUT", input_, "A mesh, or a map: a .pmap, or the .vdb beside it")
        ->required()
        ->type_name("");
    app.add_option("--points", pointsFile_,
                   "File of lines \"x y z\" (blanks or commas), mesh units; - is standard input")
        ->required()
        ->type_name("FILE");
    addMapOptions(app, choices_);
    app.add_flag("--table", table_,
                 "Ball coordinates from the map's table, as the grids have them, instead of tracing a field "
                 "line from every point");
  }

  void run(Session& session) override {
    session.addInput(input_);
    session.addInput(pointsFile_);
    session.sendAnswerToOutput();
    if (session.options().dryRun) return describePlan(session);
    const std::vector<Vec3> points = readPoints(pointsFile_, session.context());
    if (points.empty())
      throw Error(Errc::io, pointsFile_.string() + " holds no points; give lines such as 0.5 -1 2e-3");
    fillAnswer(points, evaluate(points, session), session);
  }

 private:
  Values evaluate(const std::vector<Vec3>& points, Session& session) const {
    std::optional<DomainMap> domain;
    const BallMap table = load(domain, session);
    return session.timed("evaluate", [&] {
      Values values{std::vector<Vec3>(points.size()), std::vector<Vec3>(domain ? points.size() : 0),
                    std::vector<double>(points.size()), std::vector<Vec3>(points.size())};
      if (domain) domain->forward(points, values.domain);
      if (table_) {
        table.forward(points, values.ball);
      } else {
        TracedBallMap(table).forward(points, values.ball);
      }
      const GreenFunction& green = table.chart().green();
      const Frame& frame = green.shape().frame();
      std::vector<Vec3> inner(points.size());
      for (std::size_t i = 0; i < points.size(); ++i) inner[i] = frame.toInner(points[i]);
      green.evaluate(inner, values.green, values.gradient);
      for (std::size_t i = 0; i < points.size(); ++i) {
        values.green[i] /= frame.unit;
        values.gradient[i] /= frame.unit * frame.unit;
        if (values.ball[i].allFinite()) continue;
        values.green[i] = std::numeric_limits<double>::quiet_NaN();
        values.gradient[i].setConstant(values.green[i]);
      }
      return values;
    });
  }

  BallMap load(std::optional<DomainMap>& domain, Session& session) const {
    if (!isMapName(input_)) return makeMap(input_, choices_, session);
    MapFile file = loadMapFile(input_, session);
    domain = std::move(file.domain);
    return std::move(file.map);
  }

  std::filesystem::path input_, pointsFile_;
  MapChoices choices_;
  bool table_ = false;
};

}  // namespace

std::unique_ptr<Command> makeEvalCommand() { return std::make_unique<EvalCommand>(); }

}  // namespace polestar::cli
