// bench_green: our solver beside the methods that others would take, on solids with exact answers, and alone
// on models. What is compared and how: docs/bench-green.md, which this program writes.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <optional>

#include "plan.h"
#include "report.h"
#include "results.h"
#include "run_apart.h"
#include "run_row.h"
#include "tables.h"
#include "targets.h"

namespace polestar::bench {
namespace {

struct Options {
  PlanOptions plan;
  std::string docs;
  int repeat = 1;
  bool missing = false, draw = false, list = false;
};

void declare(CLI::App& app, Options& options) {
  std::vector<std::string> ids;
  for (const Method& m : methods()) ids.push_back(m.id);
  app.add_option("--docs", options.docs,
                 "folder for bench-green.jsonl, .md and the plots; without it rows are only printed")
      ->check(CLI::ExistingDirectory);
  app.add_flag("--quick", options.plan.quick, "small sizes and few models: about a minute");
  app.add_option("--only", options.plan.only, "methods to run; again for more")->check(CLI::IsMember(ids));
  app.add_option("--part", options.plan.part, "exact: against exact answers; models: our solver alone")
      ->check(CLI::IsMember({"exact", "models", "all"}));
  app.add_option("--max-size", options.plan.maxVertices, "largest number of surface vertices");
  app.add_option("--max-dim", options.plan.maxDim, "largest number of voxels along a side");
  app.add_option("--repeat", options.repeat, "runs of every row; the fastest counts")
      ->check(CLI::PositiveNumber);
  app.add_flag("--missing", options.missing, "only rows that bench-green.jsonl lacks or that failed");
  app.add_flag("--draw", options.draw, "measure nothing, make page and plots from bench-green.jsonl");
  app.add_flag("--list", options.list, "print the rows and measure nothing");
}

Json measureApart(const Row& row, const Reference* reference) {
  Json result = toJson(row);
  result.update(runApart([&] { return runRow(row, reference); }));
  return result;
}

Json fastestOf(int repeat, const Row& row, const Reference* reference) {
  Json best = measureApart(row, reference);
  for (int i = 1; i < repeat && best.at("status") == "ok"; ++i) {
    Json next = measureApart(row, reference);
    if (next.at("status") != "ok") return next;
    if (wallSeconds(next) < wallSeconds(best)) best = std::move(next);
  }
  if (best.at("status") == "ok") best["repeats"] = repeat;
  return best;
}

void measure(const Options& options, const std::vector<Row>& rows, Results* results) {
  std::map<std::string, Reference> references;
  for (const Row& row : rows) {
    const Json* earlier = results ? results->find(toJson(row)) : nullptr;
    if (options.missing && earlier && earlier->at("status") == "ok") continue;
    const bool exact = isExactShape(row.shape);
    if (exact && !references.contains(row.shape)) references[row.shape] = referenceFor(row.shape);
    Json result = fastestOf(options.repeat, row, exact ? &references.at(row.shape) : nullptr);
    result["machine"] = machineFacts();
    std::printf("%s\n", summaryLine(result).c_str());
    std::fflush(stdout);
    if (results) results->put(std::move(result));
  }
}

int run(const Options& options) {
  const std::vector<Row> rows = planRows(options.plan);
  if (options.list) {
    for (const Row& row : rows) std::printf("%s\n", toJson(row).dump().c_str());
    return 0;
  }
  std::optional<Results> results;
  if (!options.docs.empty())
    results.emplace(std::filesystem::path(options.docs) / "bench-green.jsonl", rowKeys());
  if (!options.draw) measure(options, rows, results ? &*results : nullptr);
  if (results) writeReport(options.docs, results->all());
  return 0;
}

}  // namespace
}  // namespace polestar::bench

int main(int argc, char** argv) {
  polestar::bench::Options options;
  CLI::App app("Solvers of Green's function side by side: time, memory, error.");
  polestar::bench::declare(app, options);
  CLI11_PARSE(app, argc, argv);
  try {
    return polestar::bench::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_green: %s\n", error.what());
    return 1;
  }
}
