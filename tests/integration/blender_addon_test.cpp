// Our add-on in Debian's Blender, headless: installed from its zip, used by its operators.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "integration/kiwi_solid.h"
#include "integration/sample_vdb.h"
#include "support/scratch_folder.h"

namespace polestar::test {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Matcher;

constexpr int kFrames = 3, kShown = 2;
constexpr int kRim = 2;  // pixels beside the cut plane that are neither side's

/// Three frames of a turning kiwi and our pictures of the same cut through them.
struct Sequence {
  KiwiSolid solid{fs::path(POLESTAR_VOLUMES_FOLDER) / "smooth_star.ply"};
  std::vector<std::string> files;
  std::vector<Exr> ours;

  Sequence() {
    for (int frame = 1; frame <= kFrames; ++frame) {
      files.push_back(
          solid.fill("kiwi_000" + std::to_string(frame), {"--rotate", std::to_string(25 * frame) + ",0,0"}));
      ours.push_back(solid.cut(files.back(), Vec3::UnitX()));
    }
  }
};

/// Of the pixels that show the cut in ours: covered are those before the plane alone, as without it.
void expectHalf(const Exr& half, const Exr& whole, const Exr& ours, const Vec3& normal, const CutView& view) {
  const Vec3 middle = view.pointAt(view.width / 2, view.height / 2);
  int kept = 0, gone = 0;
  double change = 0;
  for (int y = 0; y < ours.height; ++y) {
    for (int x = 0; x < ours.width; ++x) {
      const double rim = kRim * (view.pointAt(1, 0) - view.pointAt(0, 0)).norm();
      const double beyond = normal.dot(view.pointAt(x, y) - middle);
      if (!isDeep(ours, x, y, kRim) || std::abs(beyond) < rim) continue;
      const std::size_t pixel = ours.at(x, y);
      if (beyond > 0) {
        EXPECT_EQ(half.alpha[pixel], 0) << x << ' ' << y;
        ++gone;
      } else {
        change += std::abs(static_cast<double>(half.alpha[pixel] - whole.alpha[pixel]));
        ++kept;
      }
    }
  }
  ASSERT_GT(kept, 2000);
  EXPECT_GT(gone, 2000);
  EXPECT_LT(change / kept, kSame);
}

TEST(BlenderAddon, ShowsAFrameOfASequenceInItsColors) {
  POLESTAR_REQUIRE_BLENDER();
  Sequence sequence;
  const Exr& ours = sequence.ours[kShown - 1];
  BlenderJob job = sequence.solid.job(sequence.files.front(),
                                      {{"surface", "FLOAT"}, {"density", "FLOAT"}, {"Cd", "VECTOR_FLOAT"}});
  job.addon = packAddon(job.folder);
  BlenderCut whole;
  whole.out = "whole.exr";
  whole.view = CutView::ofPicture(ours);
  whole.frame = kShown;
  whole.shader = BlenderCut::Shader::imported;
  BlenderCut half = whole;
  half.out = "half.exr";
  const Vec3 normal = (whole.view.axes.col(0) + 0.3 * whole.view.axes.col(1)).normalized();
  half.plane = {whole.view.pointAt(whole.view.width / 2, whole.view.height / 2), normal};
  job.cuts = {whole, half};
  const BlenderOutcome outcome = runBlender(job);
  ASSERT_EQ(outcome.exitCode, 0) << outcome.log;

  const Exr shown = readExr(job.folder / whole.out);
  ASSERT_EQ(shown.color.size(), ours.color.size());
  expectSame(straightColors(shown), ours);
  // The check can fail: other frames are other pictures.
  for (const int other : {1, 3})
    EXPECT_GT(differenceOf(straightColors(shown), sequence.ours[static_cast<std::size_t>(other - 1)]).mean,
              kOther);

  expectHalf(readExr(job.folder / half.out), shown, ours, normal, whole.view);
}

TEST(BlenderAddon, ChangesLookAndPlaceInItsPanel) {
  POLESTAR_REQUIRE_BLENDER();
  const ScratchFolder folder;
  constexpr auto kVector = SampleGrid::Kind::vector;
  writeSample(folder / "full.vdb", {{"density"}, {"Cd", kVector}, {"rest", kVector}});
  writeSample(folder / "bare.vdb", {{"surface"}});
  const BlenderOutcome outcome = runPanel(folder.path(), folder / "full.vdb", folder / "bare.vdb");
  EXPECT_EQ(outcome.exitCode, 0) << outcome.log;
}

TEST(BlenderAddon, SaysWhyItCannotImport) {
  POLESTAR_REQUIRE_BLENDER();
  const ScratchFolder folder;
  constexpr auto kVector = SampleGrid::Kind::vector;
  const auto sample = [&](const std::string& name, const std::vector<SampleGrid>& grids) {
    writeSample(folder / name, grids);
    return (folder / name).string();
  };
  const std::vector<SampleGrid> good{{"density"}, {"Cd", kVector}};
  const std::string file = sample("good.vdb", good);
  const std::string noColors = sample("rest.vdb", {{"density"}, {"rest", kVector}});
  const std::string nothing = sample("nothing.vdb", {{"rest", kVector}});
  const std::string empty =
      sample("empty.vdb", {{"density", SampleGrid::Kind::scalar, true}, {"Cd", kVector}});
  const std::string wrong = sample("wrong.vdb", {{"density"}, {"Cd"}});
  const std::string gap = sample("gap_1.vdb", good);
  sample("gap_2.vdb", good);
  sample("gap_5.vdb", good);
  const std::string late = sample("late_0001.vdb", good);
  sample("late_0002.vdb", {{"density"}, {"Cd", kVector, true}});
  const std::string bytes = bytesOf(file);
  writeBytes(folder / "cut.vdb", bytes.substr(0, bytes.size() - 20));
  writeBytes(folder / "start.vdb", bytes.substr(0, 50));
  writeBytes(folder / "text.vdb", "no volume, just text");
  const auto path = [&](const std::string& name) { return (folder / name).string(); };

  const std::vector<std::pair<AddonImport, Matcher<std::string>>> cases{
      {{{"filepath", file}}, IsEmpty()},
      {{{"filepath", file}, {"allow_gaps", true}}, IsEmpty()},
      {{{"filepath", noColors}}, IsEmpty()},
      {{{"filepath", gap}, {"sequence", false}}, IsEmpty()},
      {{{"filepath", gap}, {"allow_gaps", true}}, IsEmpty()},
      {{{"filepath", gap}}, AllOf(HasSubstr("2 of 5 frames are missing"), HasSubstr(": 3-4"))},
      {{{"filepath", late}}, AllOf(HasSubstr("the grid Cd of"), HasSubstr("late_0002.vdb is empty"))},
      {{{"filepath", path("none.vdb")}}, AllOf(HasSubstr("none.vdb"), HasSubstr("No such file"))},
      {{{"filepath", path("text.vdb")}}, HasSubstr("text.vdb is not a .vdb")},
      {{{"filepath", path("cut.vdb")}}, HasSubstr("cut.vdb is truncated")},
      {{{"filepath", path("start.vdb")}}, HasSubstr("start.vdb is truncated")},
      {{{"filepath", file}, {"look", "marble"}}, HasSubstr("has no rest among density, Cd")},
      {{{"filepath", noColors}, {"look", "colors"}}, HasSubstr("has no colors")},
      {{{"filepath", nothing}}, HasSubstr("neither density nor surface among rest")},
      {{{"filepath", empty}}, HasSubstr("the grid density of")},
      {{{"filepath", wrong}}, HasSubstr("the grid Cd of")},
  };
  std::vector<AddonImport> imports;
  for (const auto& [import, report] : cases) imports.push_back(import);
  const std::vector<std::string> reports = addonReports(folder.path(), imports);
  ASSERT_EQ(reports.size(), cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) EXPECT_THAT(reports[i], cases[i].second) << imports[i];
}

}  // namespace
}  // namespace polestar::test
