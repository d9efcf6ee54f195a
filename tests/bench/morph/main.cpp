// bench_morph: pairs of solids turned into one another by `polestar morph`'s two paths and by what others
// would take. What is compared and how: docs/bench-morph.md, which this program writes.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <optional>

#include "morph_page.h"
#include "pair.h"
#include "run_apart.h"

namespace polestar::bench {
namespace {

struct Options {
  PairOptions pair;
  std::string docs;
  std::vector<std::string> only;
  bool missing = false, draw = false;
};

void declare(CLI::App& app, Options& options) {
  std::vector<std::string> names;
  for (const Pair& pair : pairs()) names.push_back(pair.name);
  CLI::Option* docs = app.add_option("--docs", options.docs,
                                     "folder for bench-morph.jsonl and .md; without it rows are only printed")
                          ->check(CLI::ExistingDirectory);
  app.add_option("--only", options.only, "pairs; again for more")->check(CLI::IsMember(names));
  app.add_option("--dim", options.pair.dim, "voxels along the longest side")
      ->check(CLI::Range(16, 1024))
      ->capture_default_str();
  app.add_option("--frames", options.pair.frames, "both ends included; the page shows quarters")
      ->check(CLI::Range(2, 1000))
      ->capture_default_str();
  app.add_flag("--missing", options.missing, "only pairs that bench-morph.jsonl lacks or that failed")
      ->needs(docs);
  app.add_flag("--draw", options.draw, "measure nothing, make the page from bench-morph.jsonl")->needs(docs);
}

std::vector<Json> measureApart(const Pair& pair, const PairOptions& options) {
  const Json answer = runApart([&] { return Json{{"status", "ok"}, {"rows", measurePair(pair, options)}}; });
  if (answer.at("status") == "ok") return answer.at("rows");
  return {{{"pair", pair.name}, {"method", "all"}, {"status", answer.at("status")}}};
}

bool isDone(const Results& results, const Pair& pair) {
  const Json* row = results.find({{"pair", pair.name}, {"method", "straight"}});
  return row && row->at("status") == "ok";
}

int run(const Options& options) {
  std::optional<Results> results;
  if (!options.docs.empty())
    results.emplace(std::filesystem::path(options.docs) / "bench-morph.jsonl",
                    std::vector<std::string>{"pair", "method"});
  for (const Pair& pair : pairs()) {
    const bool chosen = options.only.empty() ||
                        std::find(options.only.begin(), options.only.end(), pair.name) != options.only.end();
    if (options.draw || !chosen || (options.missing && isDone(*results, pair))) continue;
    for (Json row : measureApart(pair, options.pair)) {
      row["machine"] = machineFacts();
      std::printf("%s\n", summaryLine(row).c_str());
      std::fflush(stdout);
      if (results) results->put(std::move(row));
    }
  }
  if (results) writeMorphPage(options.docs, results->all());
  return 0;
}

}  // namespace
}  // namespace polestar::bench

int main(int argc, char** argv) {
  polestar::bench::Options options;
  CLI::App app("Morphs of pairs of solids: volumes, surfaces, time; other methods.");
  polestar::bench::declare(app, options);
  CLI11_PARSE(app, argc, argv);
  try {
    return polestar::bench::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_morph: %s\n", error.what());
    return 1;
  }
}
