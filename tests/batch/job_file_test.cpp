// Job files: what they mean, and what is said of those that mean nothing.

#include "batch/job_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "polestar/core/error.h"
#include "support/scratch_folder.h"

namespace polestar::batch {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

class JobFileTest : public ::testing::Test {
 protected:
  JobFile read(const std::string& text) const {
    test::writeBytes(folder_ / "jobs.toml", text);
    return readJobFile(folder_ / "jobs.toml");
  }

  std::string refusal(const std::string& text) const {
    try {
      read(text);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), Errc::usage) << error.what();
      return error.what();
    }
    ADD_FAILURE() << "taken: " << text;
    return "";
  }

  test::ScratchFolder folder_;
};

TEST_F(JobFileTest, OptionsBecomeWordsOfACommandLine) {
  const JobFile job = read(R"(
[render]
cut = ["x", "-y"]
view = [-0.5, 0.7, 1]
samples = 8
size = "64x48"
flat = true
no-floor = false
[transfer]
set = { seeds = 0.5, rings = 3 }
[targets]
a = "a.obj"
)");
  const auto& render = job.defaults.of(Step::render);
  EXPECT_THAT(render.at("cut").words, ElementsAre("--cut=x", "--cut=-y"));
  EXPECT_THAT(render.at("view").words, ElementsAre("--view=-0.5,0.7,1"));
  EXPECT_THAT(render.at("samples").words, ElementsAre("--samples=8"));
  EXPECT_THAT(render.at("size").words, ElementsAre("--size=64x48"));
  EXPECT_THAT(render.at("flat").words, ElementsAre("--flat"));
  EXPECT_TRUE(render.at("no-floor").words.empty());
  EXPECT_THAT(job.defaults.of(Step::transfer).at("set").words,
              ElementsAre("--set=rings=3", "--set=seeds=0.5"));
}

TEST_F(JobFileTest, NamesAreData) {
  const JobFile job = read(R"(
[textures]
"it's $(rm -rf ~); kiwi" = "kiwi"
[targets]
"größe 1" = { mesh = "a b/\"c\".obj" }
)");
  EXPECT_EQ(job.textures.at(0).name, "it's $(rm -rf ~); kiwi");
  EXPECT_EQ(job.targets.at(0).name, "größe 1");
  EXPECT_EQ(job.targets.at(0).path, "a b/\"c\".obj");
}

TEST_F(JobFileTest, EntriesKeepTheOrderOfTheFile) {
  const JobFile job = read("[targets]\nzebra = \"z.obj\"\nant = \"a.obj\"\nmole = \"m.obj\"\n");
  EXPECT_EQ(job.targets.at(0).name, "zebra");
  EXPECT_EQ(job.targets.at(1).name, "ant");
  EXPECT_EQ(job.targets.at(2).name, "mole");
}

TEST_F(JobFileTest, FilesThatMatchAreTargets) {
  for (const char* name : {"b.obj", "a.obj", "c.ply"}) test::writeBytes(folder_ / name, "");
  const JobFile job = read("meshes = [\"*.obj\", \"c.*\"]\n");
  ASSERT_EQ(job.targets.size(), 3U);
  EXPECT_EQ(job.targets[0].name, "a");
  EXPECT_EQ(job.targets[0].path, "a.obj");
  EXPECT_EQ(job.targets[2].path, "c.ply");
}

TEST_F(JobFileTest, WithoutTexturesThereIsNothingToTransfer) {
  const JobFile job = read("[targets]\na = \"a.obj\"\n");
  EXPECT_THAT(job.steps, ElementsAre(Step::map, Step::render));
}

TEST_F(JobFileTest, MistakesAreToldByLine) {
  const std::string target = "\n[targets]\na = \"a.obj\"\n";
  EXPECT_THAT(refusal("output = \"x\"\ntexturs = 1" + target),
              HasSubstr("jobs.toml:2: there is no key texturs"));
  EXPECT_THAT(refusal("output = 3" + target), HasSubstr("jobs.toml:1: output wants text"));
  EXPECT_THAT(refusal("output = \"x" + target), HasSubstr("jobs.toml:1: "));
  EXPECT_THAT(refusal("steps = [\"map\", \"bake\"]" + target), HasSubstr("jobs.toml:1: steps are of"));
  EXPECT_THAT(refusal("frames = \"9-1\"" + target), HasSubstr("jobs.toml:1: the frames 9-1 end"));
  EXPECT_THAT(refusal("frames-per-task = 0" + target), HasSubstr("from 1 on"));
  EXPECT_THAT(refusal("meshes = \"none/*.obj\"\n"), HasSubstr("no file matches none/*.obj"));
  EXPECT_THAT(refusal("[render]\nframes = \"1-2\"" + target),
              HasSubstr("jobs.toml:2: the batch itself sets --frames"));
  EXPECT_THAT(refusal("[render]\n--cut = \"x\"" + target), HasSubstr("without dashes in front"));
  EXPECT_THAT(refusal("[render]\ncut = [\"x\", 1]" + target), HasSubstr("mixes"));
  EXPECT_THAT(refusal("[slurm]\narray = \"1-2\"" + target), HasSubstr("--array of sbatch"));
  EXPECT_THAT(refusal("[textures]\nk = { texture = \"kiwi\", bake = 1 }" + target),
              HasSubstr("there is no key bake"));
  EXPECT_THAT(refusal("[targets]\n"), HasSubstr("there is no target"));
  EXPECT_THAT(refusal("[targets]\na = {}\n"), HasSubstr("wants a mesh"));
}

TEST_F(JobFileTest, NamesThatNoFileCanHaveAreRefused) {
  for (const char* name : {"a/b", "..", ".hidden", "", "shot_####", "a%04d", "a\\nb"})
    EXPECT_THAT(refusal("[targets]\n\"" + std::string(name) + "\" = \"a.obj\"\n"), HasSubstr("name")) << name;
}

TEST_F(JobFileTest, TwoTargetsOfOneNameAreRefused) {
  test::writeBytes(folder_ / "a.obj", "");
  EXPECT_THAT(refusal("meshes = \"a.obj\"\n[targets]\na = \"other.obj\"\n"), HasSubstr("a target a already"));
}

TEST_F(JobFileTest, AFileThatIsNotThereIsSaid) {
  try {
    readJobFile(folder_ / "none.toml");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), Errc::io);
  }
}

}  // namespace
}  // namespace polestar::batch
