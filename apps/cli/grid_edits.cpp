#include "cli/grid_edits.h"

#include <algorithm>
#include <map>

#include "cli/text.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

constexpr int kDefaultDim = 128;
constexpr double kFogLevel = 0.5;

CLI::Option* addNames(CLI::App& app, const std::string& option, std::vector<std::string>& names,
                      const std::string& help) {
  return app.add_option(option, names, help)
      ->delimiter(',')
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->type_name("NAMES");
}

void warn(const std::vector<std::string>& notes, Session& session) {
  for (const std::string& note : notes) session.context().log(LogLevel::warning, note);
}

}  // namespace

void GridEdits::addOptions(CLI::App& app) {
  static const std::map<std::string, UpAxis> kUp{{"y", UpAxis::y}, {"z", UpAxis::z}};
  static const std::map<std::string, VdbCompression> kCompressions{
      {"blosc", VdbCompression::blosc}, {"zip", VdbCompression::zip}, {"none", VdbCompression::none}};
  addNames(app, "--pick", pick_, "Keep these grids only, separated by commas");
  addNames(app, "--drop", drop_, "Leave these grids out");
  addNames(app, "--rename", rename_, "Give grids other names")->type_name("OLD=NEW");
  addNames(app, "--as", as_,
           "Of surface and density, those to be there: the level set is made of the fog, or the fog of the "
           "level set, and one that is not named goes. Of a mesh both by default");
  app.add_option("--iso", iso_,
                 "The surface lies where a grid has this value; default 0 of level sets, 0.5 of fogs")
      ->type_name("VALUE");
  app.add_option("--half-width", halfWidth_, "Of the band of a level set that is made, voxels")
      ->check(CLI::Range(2, 64).description(""))
      ->capture_default_str()
      ->type_name("N");
  size_.addOptions(app, "the input's", kDefaultDim);
  app.add_option("--up", up_,
                 "Turn the data so that y or z points up: z turns a scene with y up, y one with z up. For a "
                 ".usda: which axis points up in its data")
      ->transform(CLI::CheckedTransformer(kUp).description(""))
      ->type_name("y|z");
  app.add_flag("--half", half_,
               "Save numbers as half floats, except in rest, position and green and where they would not do");
  app.add_option(
         "--prune", prune_,
         "Make one tile of blocks of voxels whose values differ by at most T (default 0: that are equal)")
      ->expected(0, 1)
      ->default_str("0")
      ->check(CLI::NonNegativeNumber.description(""))
      ->type_name("[T]");
  app.add_option("--compression", compression_, "Of a .vdb: blosc (default), zip or none")
      ->transform(CLI::CheckedTransformer(kCompressions).description(""))
      ->type_name("KIND");
}

void GridEdits::prepare() {
  for (const std::string& name : as_) {
    if (name == "surface" || name == "density") continue;
    throw Error(Errc::usage, "--as makes surface, density or surface,density; found \"" + name + "\"");
  }
  for (const std::string& pair : rename_) {
    const auto equals = pair.find('=');
    if (equals == std::string::npos || equals == 0 || equals + 1 == pair.size())
      throw Error(Errc::usage, "--rename wants old=new, such as Cd=color; found \"" + pair + "\"");
  }
}

bool GridEdits::wants(const std::string& grid) const {
  return as_.empty() || std::find(as_.begin(), as_.end(), grid) != as_.end();
}

void GridEdits::renameAll(GridSet& grids) const {
  for (const std::string& pair : rename_) {
    const auto equals = pair.find('=');
    grids.rename(pair.substr(0, equals), pair.substr(equals + 1));
  }
}

double GridEdits::newVoxel(const GridSet& grids) const {
  const SampledGrids old = grids.lookUp();
  const SampledGrid* reference = old.solidGrid();
  if (!reference && !old.grids().empty()) reference = &old.grids().front();
  return size_.voxelSize(reference ? reference->activeBox() : Box{Vec3::Zero(), Vec3::Ones()});
}

void GridEdits::apply(GridSet& grids, bool sized, Session& session) const {
  if (!pick_.empty()) grids.pick(pick_);
  if (!drop_.empty()) grids.drop(drop_);
  if (asked())
    grids.provide(wants("surface"), wants("density"), iso_.value_or(kFogLevel), halfWidth_,
                  session.context());
  if (!sized && size_.given()) {
    session.timed("resample", [&] {
      warn(grids.resample(newVoxel(grids), session.context()), session);
      return 0;
    });
  }
  if (up_) warn(grids.turn(*up_), session);
  renameAll(grids);
  if (half_) warn(grids.halve(), session);
  if (prune_) grids.prune(*prune_);
}

}  // namespace polestar::cli
