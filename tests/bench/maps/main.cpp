// bench_maps: every star-shaped model of the mesh folder through `map`, through all choices of boundary and
// radius, and beside other methods. Writes docs/bench-maps.md and docs/bench-distortion.md.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <optional>
#include <set>

#include "model.h"
#include "pages.h"
#include "run_apart.h"
#include "support/meshes.h"

namespace polestar::bench {
namespace {

struct Options {
  MeasureOptions measure;
  std::string docs, part = "all";
  std::vector<std::string> models;
  bool missing = false, draw = false;
};

void declare(CLI::App& app, Options& options) {
  app.add_option("MODEL", options.models,
                 "names of files in POLESTAR_MESHES; none: all that MANIFEST.tsv calls star-shaped")
      ->type_name("");
  CLI::Option* docs =
      app.add_option(
             "--docs", options.docs,
             "folder for bench-maps.jsonl, .md and bench-distortion.md; without it rows are only printed")
          ->check(CLI::ExistingDirectory);
  app.add_option(
         "--part", options.part,
         "map: default options and their certificate; choices: boundaries and radii; comparison: other "
         "methods")
      ->check(CLI::IsMember({"map", "choices", "comparison", "all"}));
  app.add_option("--dim", options.measure.dim, "voxels along the longest side; the pages have 128")
      ->check(CLI::Range(4, 2048))
      ->excludes(docs);
  app.add_option("--most-vertices", options.measure.mostVertices,
                 "largest surface that is filled with tetrahedra to compare methods")
      ->capture_default_str();
  app.add_option("--galaxy-seconds", options.measure.galaxySeconds, "after which Galaxy Maps is stopped")
      ->capture_default_str();
  app.add_flag("--missing", options.missing, "only rows that bench-maps.jsonl lacks or that failed")
      ->needs(docs);
  app.add_flag("--draw", options.draw, "measure nothing, make the pages from bench-maps.jsonl")->needs(docs);
}

/// A model's rows. Copies of an earlier model's body, told by the manifest's source, are only mapped: they
/// test reading and repair.
struct Plan {
  std::filesystem::path file;
  std::vector<Part> parts;
};

std::vector<Plan> plan(const Options& options) {
  std::vector<Plan> plans;
  std::set<std::string> sources;
  for (const testing::ManifestEntry& entry : testing::manifest()) {
    if (entry.star != "yes") continue;
    const bool copy = !sources.insert(entry.source).second;
    const std::string name = entry.path.filename().string();
    if (!options.models.empty() &&
        std::find(options.models.begin(), options.models.end(), name) == options.models.end())
      continue;
    Plan plan{entry.path, {}};
    for (const Part part : kParts) {
      if ((options.part == "all" || options.part == toString(part)) && !(copy && part != Part::map))
        plan.parts.push_back(part);
    }
    plans.push_back(std::move(plan));
  }
  return plans;
}

std::vector<Json> measureApart(const Plan& plan, const MeasureOptions& options) {
  const Json answer = runApart([&] {
    return Json{{"status", "ok"}, {"rows", measureModel(plan.file, plan.parts, options)}};
  });
  if (answer.at("status") == "ok") return answer.at("rows");
  std::vector<Json> rows;
  for (const Part part : plan.parts)
    rows.push_back(failedRow(plan.file.filename().string(), part, answer.at("status")));
  return rows;
}

void measure(const Options& options, Results* results) {
  for (Plan plan : plan(options)) {
    if (options.missing) {
      std::erase_if(plan.parts, [&](Part part) {
        const Json* earlier = results->find(failedRow(plan.file.filename().string(), part, ""));
        return earlier && !earlier->at("status").get<std::string>().starts_with("failed");
      });
    }
    if (plan.parts.empty()) continue;
    for (Json row : measureApart(plan, options.measure)) {
      row["machine"] = machineFacts();
      std::printf("%s\n", summaryLine(row).c_str());
      std::fflush(stdout);
      if (results) results->put(std::move(row));
    }
  }
}

int run(const Options& options) {
  if (!testing::meshFolder() && !options.draw)
    throw std::runtime_error("POLESTAR_MESHES does not name a folder of meshes");
  std::optional<Results> results;
  if (!options.docs.empty())
    results.emplace(std::filesystem::path(options.docs) / "bench-maps.jsonl",
                    std::vector<std::string>{"model", "part"});
  if (!options.draw) measure(options, results ? &*results : nullptr);
  if (results) writePages(options.docs, results->all());
  return 0;
}

}  // namespace
}  // namespace polestar::bench

int main(int argc, char** argv) {
  polestar::bench::Options options;
  CLI::App app("Maps of star-shaped models: certificates, distortion, other methods.");
  polestar::bench::declare(app, options);
  CLI11_PARSE(app, argc, argv);
  try {
    return polestar::bench::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_maps: %s\n", error.what());
    return 1;
  }
}
