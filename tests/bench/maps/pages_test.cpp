// What the pages conclude from their figures.

#include "pages.h"

#include <gtest/gtest.h>

#include "choices.h"
#include "model.h"
#include "support/scratch_folder.h"

namespace polestar::bench {
namespace {

Json method(const char* name, int inverted, double hex) {
  return {{"method", name}, {"status", "ok"}, {"inverted", inverted}, {"hex", {{"p1", hex}}}};
}

Json comparison(const char* model, std::vector<Json> methods) {
  Json row = failedRow(model, Part::comparison, "ok");
  row["methods"] = std::move(methods);
  return row;
}

TEST(Scores, CountWinsLossesAndTiesWhereBothWereMeasured) {
  const std::vector<Json> rows{
      comparison("a", {method("ours", 0, 0.8), method("other", 3, 0.9)}),
      comparison("b", {method("ours", 0, 0.8), method("other", 0, 0.7)}),
      comparison("c", {method("ours", 5, 0.8), {{"method", "other"}, {"status", "not run"}}}),
      failedRow("d", Part::comparison, "left out: too large")};
  const Score inverted = scoreOf(rows, "ours", "other", {"inverted", "/inverted"});
  EXPECT_EQ(inverted.wins, 1);
  EXPECT_EQ(inverted.losses, 0);
  EXPECT_EQ(inverted.ties, 1);
  const Score hex = scoreOf(rows, "ours", "other", {"hex", "/hex/p1", true});
  EXPECT_EQ(hex.wins, 1);
  EXPECT_EQ(hex.losses, 1);
  EXPECT_EQ(hex.ties, 0);
  const Score turned = scoreOf(rows, "other", "ours", {"hex", "/hex/p1", true});
  EXPECT_EQ(turned.wins, hex.losses);
}

TEST(Pages, SayWhatWasNotMeasuredAndMarkTheBest) {
  const test::ScratchFolder folder;
  Json chosen = failedRow("a.obj", Part::choices, "ok");
  for (const Choice& choice : choices()) {
    const bool best = std::string(choice.name) == "field-line, mixed";
    chosen["choices"].push_back({{"choice", choice.name},
                                 {"boundary", toString(best ? SphereMapKind::conformal : choice.boundary)},
                                 {"mips", {{"mean", best ? 1.25 : 1.5}}}});
  }
  writePages(
      folder.path(),
      {chosen,
       comparison("a.obj", {method("radial cone", 7, 0.5), {{"method", kGalaxyMaps}, {"status", "not run"}}}),
       failedRow("b.obj", Part::comparison, "left out: too large"),
       failedRow("c.obj", Part::map, "failed: not star-shaped")});
  const std::string distortion = test::bytesOf(folder / "bench-distortion.md");
  for (const char* part :
       {"| a.obj | radial cone |", "not run", "b.obj: left out: too large", "**1.250**\\*"})
    EXPECT_NE(distortion.find(part), std::string::npos) << part;
  EXPECT_EQ(distortion.find("**1.500**"), std::string::npos);
  EXPECT_NE(test::bytesOf(folder / "bench-maps.md").find("c.obj: failed: not star-shaped"),
            std::string::npos);
}

TEST(Pages, TellEveryRefusalAndItsReason) {
  const test::ScratchFolder folder;
  MeasureOptions options;
  options.dim = 16;
  Json row =
      measureModel(std::filesystem::path(POLESTAR_VOLUMES_FOLDER) / "cube.obj", {Part::map}, options).front();
  row["verdict"] = "failed";
  row["failure"] = "voxel_cells 3 is over 0";
  row["others"][0]["verdict"] = "sampled";
  row["others"][1]["verdict"] = "failed";
  row["others"][1]["failure"] = "round_trip is over 0.5";
  writePages(folder.path(), {row});
  const std::string page = test::bytesOf(folder / "bench-maps.md");
  for (const char* part :
       {"- cube.obj: voxel_cells 3 is over 0", "- cube.obj (balanced 0.03): round_trip is over 0.5",
        "| failed | sampled | failed |"})
    EXPECT_NE(page.find(part), std::string::npos) << part << " in\n" << page;
}

TEST(Choices, BeginWithTheDefaultsOfMap) {
  const MapOptions defaults;
  EXPECT_EQ(choices().front().boundary, defaults.boundary);
  EXPECT_EQ(choices().front().radius, defaults.radius.value_or(RadiusKind::green));
}

TEST(Model, HasAllItsRows) {
  const std::filesystem::path file = std::filesystem::path(POLESTAR_VOLUMES_FOLDER) / "smooth_star.ply";
  MeasureOptions options;
  options.dim = 24;
  options.mostVertices = 100;
  const std::vector<Json> rows = measureModel(file, {Part::map, Part::choices, Part::comparison}, options);
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].at("status"), "ok") << rows[0].dump();
  EXPECT_NE(rows[0].at("verdict"), "failed") << rows[0].dump();
  EXPECT_EQ(rows[1].at("choices").size(), choices().size());
  for (const Json& choice : rows[1].at("choices")) {
    EXPECT_EQ(choice.at("image_cells_bad"), 0) << choice.dump();
    EXPECT_EQ(choice.at("folded"), 0) << choice.dump();
    EXPECT_GT(choice.at("hex").at("p1").get<double>(), 0.3) << choice.dump();
    EXPECT_LT(choice.at("skew").at("mean").get<double>(), 2) << choice.dump();
  }
  EXPECT_EQ(rows[2].at("status"), "left out: more than 100 vertices");
  for (const Json& row : rows) EXPECT_NE(summaryLine(row).find("smooth_star.ply"), std::string::npos);
}

}  // namespace
}  // namespace polestar::bench
