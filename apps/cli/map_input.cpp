#include "cli/map_input.h"

#include <map>

namespace polestar::cli {

void addMapOptions(CLI::App& app, MapChoices& choices) {
  static const std::map<std::string, SphereMapKind> kBoundaries{{"conformal", SphereMapKind::conformal},
                                                                {"radial", SphereMapKind::radial}};
  static const std::map<std::string, Core> kCores{{"smooth", Core::smooth}, {"paper", Core::paper}};
  app.add_option("--boundary", choices.boundary,
                 "How the surface goes onto the sphere: conformal (default) or radial")
      ->transform(CLI::CheckedTransformer(kBoundaries).description(""))
      ->type_name("KIND");
  app.add_option(
         "--core", choices.core,
         "Near the center: smooth (default) turns into a rotation there, paper keeps field lines throughout")
      ->transform(CLI::CheckedTransformer(kCores).description(""))
      ->type_name("KIND");
  app.add_option("--solver", choices.solver, "For Green's function: layer (default)")
      ->check(CLI::IsMember({"layer"}).description(""))
      ->type_name("KIND");
  addCenterOption(app, choices.center);
}

bool isMapName(const std::filesystem::path& path) {
  return path.extension() == ".pmap" || path.extension() == ".vdb";
}

std::filesystem::path mapFileBeside(const std::filesystem::path& path) {
  return std::filesystem::path(path).replace_extension(".pmap");
}

}  // namespace polestar::cli
