// The template against the rules that the schema 2023-09 of the Open Job Description states.

#include "batch/open_job.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

namespace polestar::batch {
namespace {

Plan smallPlan() {
  Plan plan;
  plan.folder = "/jobs";
  plan.output = "out";
  for (const char* name : {"a", "b"})
    plan.tasks.push_back({.step = Step::map,
                          .name = name,
                          .arguments = {"map"},
                          .inputs = {},
                          .outputs = {},
                          .after = {},
                          .log = {}});
  plan.tasks.push_back({.step = Step::render,
                        .name = "k/a",
                        .arguments = {"render"},
                        .inputs = {},
                        .outputs = {},
                        .after = {0},
                        .log = {}});
  return plan;
}

/// Members of `json` are among `allowed`, and all of `required` are there.
void expectMembers(const Json& json, const std::set<std::string>& allowed,
                   const std::set<std::string>& required) {
  for (const auto& [key, value] : json.items()) EXPECT_TRUE(allowed.contains(key)) << key;
  for (const std::string& key : required) EXPECT_TRUE(json.contains(key)) << key;
}

void expectName(const Json& name) {
  const auto text = name.get<std::string>();
  EXPECT_FALSE(text.empty());
  EXPECT_LE(text.size(), 64U);
}

TEST(OpenJob, KeepsTheRulesOfItsSchema) {
  const Json job = openJobTemplate(smallPlan(), {0, 1, 2}, "jobs", "/jobs/out/farm/plan.json");
  expectMembers(job,
                {"specificationVersion", "$schema", "name", "description", "extensions",
                 "parameterDefinitions", "jobEnvironments", "steps"},
                {"specificationVersion", "name", "steps"});
  EXPECT_EQ(job["specificationVersion"], "jobtemplate-2023-09");
  expectName(job["name"]);
  static const std::regex kIdentifier("[A-Za-z_][A-Za-z0-9_]{0,63}");
  std::set<std::string> parameters;
  for (const Json& parameter : job["parameterDefinitions"]) {
    EXPECT_TRUE(std::regex_match(parameter["name"].get<std::string>(), kIdentifier));
    EXPECT_TRUE(parameters.insert(parameter["name"]).second);
    EXPECT_EQ(parameter["type"], "STRING");
    EXPECT_LE(parameter["default"].get<std::string>().size(), 1024U);
  }
  std::set<std::string> steps;
  for (const Json& step : job["steps"]) {
    expectMembers(step,
                  {"name", "description", "dependencies", "stepEnvironments", "hostRequirements",
                   "parameterSpace", "script"},
                  {"name", "script"});
    expectName(step["name"]);
    if (step.contains("dependencies")) {
      ASSERT_FALSE(step["dependencies"].empty());
      // Named before, so there is no circle.
      for (const Json& dependency : step["dependencies"])
        EXPECT_TRUE(steps.contains(dependency.at("dependsOn")));
    }
    EXPECT_TRUE(steps.insert(step["name"]).second);
    const Json& space = step["parameterSpace"]["taskParameterDefinitions"];
    ASSERT_EQ(space.size(), 1U);
    EXPECT_TRUE(std::regex_match(space[0]["name"].get<std::string>(), kIdentifier));
    EXPECT_EQ(space[0]["type"], "INT");
    static const std::regex kRange(R"(\d+(-\d+)?(,\d+(-\d+)?)*)");
    EXPECT_TRUE(std::regex_match(space[0]["range"].get<std::string>(), kRange));
    const Json& run = step["script"]["actions"]["onRun"];
    expectMembers(run, {"command", "args", "timeout", "cancelation"}, {"command"});
    for (const Json& word : run["args"]) EXPECT_TRUE(word.is_string());
  }
  EXPECT_EQ(job["steps"].size(), 2U);
  EXPECT_EQ(job["steps"][1]["parameterSpace"]["taskParameterDefinitions"][0]["range"], "2");
}

TEST(OpenJob, NamesAreCutByCharacters) {
  std::string name;
  for (int i = 0; i < 70; ++i) name += "ü";
  const auto cut = openJobTemplate(smallPlan(), {0}, name, "p").at("name").get<std::string>();
  EXPECT_EQ(cut.size(), 2U * 64);
  EXPECT_EQ(openJobTemplate(smallPlan(), {0}, "\n", "p").at("name"), "polestar");
}

TEST(CommandLines, AreQuotedAndOrdered) {
  const std::string text = commandLines(smallPlan(), {0, 2}, "/jobs/it's here/plan.json");
  EXPECT_EQ(text,
            "# 1 task of map\n"
            "polestar batch '/jobs/it'\\''s here/plan.json' --task 0\n"
            "# 1 task of render, after all of the above\n"
            "polestar batch '/jobs/it'\\''s here/plan.json' --task 2\n");
}

}  // namespace
}  // namespace polestar::batch
