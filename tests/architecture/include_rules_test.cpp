#include "include_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace polestar::testing {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

TEST(IncludeRules, TheLibraryKeepsItsDirection) {
  std::size_t files = 0;
  EXPECT_THAT(checkTree(POLESTAR_SOURCE_DIR, "lib/polestar", files), IsEmpty());
  EXPECT_GT(files, 10U) << "the sources were not found";
}

TEST(IncludeRules, TheToolUsesPublicHeadersOnly) {
  std::size_t files = 0;
  EXPECT_THAT(checkTree(POLESTAR_SOURCE_DIR, "apps", files), IsEmpty());
  EXPECT_GT(files, 5U) << "the sources were not found";
}

Violations check(const char* file, const char* include) {
  return checkIncludes(file, "#pragma once\n#include <" + std::string(include) + ">\n");
}

TEST(IncludeRules, ArrowsOfTheTableAreAllowedAlsoThroughOthers) {
  EXPECT_THAT(check("lib/polestar/star/a.cpp", "polestar/mesh/tri_mesh.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/map/a.cpp", "polestar/core/types.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/polycube/a.cpp", "polestar/mesh/tri_mesh.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/render/a.cpp", "polestar/vdb/solid_grids.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/morph/a.cpp", "polestar/vdb/solid_grids.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/green/a.cpp", "polestar/core/detail/parallel.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/green/a.cpp", "polestar/green/detail/layer.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/vdb/a.cpp", "openvdb/openvdb.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/vdb/detail/a.h", "openvdb/openvdb.h"), IsEmpty());
  EXPECT_THAT(check("lib/polestar/pipeline.h", "polestar/render/render.h"), IsEmpty());
  EXPECT_THAT(check("apps/main.cpp", "polestar/pipeline.h"), IsEmpty());
}

TEST(IncludeRules, ArrowsAgainstTheDirectionAreFound) {
  EXPECT_THAT(check("lib/polestar/mesh/a.h", "polestar/star/star_shape.h"),
              ElementsAre(HasSubstr(
                  "lib/polestar/mesh/a.h:2 includes polestar/star/star_shape.h: mesh may not use star")));
  EXPECT_THAT(check("lib/polestar/core/a.cpp", "polestar/mesh/tri_mesh.h"),
              ElementsAre(HasSubstr("may not use")));
  EXPECT_THAT(check("lib/polestar/sphere/a.cpp", "polestar/green/green_function.h"),
              ElementsAre(HasSubstr("sphere may not use green")));
  EXPECT_THAT(check("lib/polestar/polycube/a.cpp", "polestar/green/green_function.h"),
              ElementsAre(HasSubstr("polycube may not use green")));
  EXPECT_THAT(check("lib/polestar/vdb/a.cpp", "polestar/map/ball_map.h"),
              ElementsAre(HasSubstr("vdb may not use map")));
  EXPECT_THAT(check("lib/polestar/render/a.cpp", "polestar/morph/morph_path.h"),
              ElementsAre(HasSubstr("render may not use morph")));
  EXPECT_THAT(check("lib/polestar/map/a.cpp", "polestar/pipeline.h"),
              ElementsAre(HasSubstr("above all stages")));
}

TEST(IncludeRules, PrivateAndHeavyHeadersAreFound) {
  EXPECT_THAT(check("lib/polestar/star/a.cpp", "polestar/mesh/detail/ply.h"),
              ElementsAre(HasSubstr("private to mesh")));
  EXPECT_THAT(check("lib/polestar/mesh/a.h", "polestar/mesh/detail/ply.h"),
              ElementsAre(HasSubstr("not installed")));
  EXPECT_THAT(check("apps/main.cpp", "polestar/core/detail/parallel.h"),
              ElementsAre(HasSubstr("private to the library")));
  for (const char* heavy :
       {"openvdb/openvdb.h", "embree3/rtcore.h", "OpenImageIO/imageio.h", "tbb/parallel_for.h",
        "ceres/ceres.h", "boost/graph/adjacency_list.hpp", "nlohmann/json.hpp", "CL/cl.h"}) {
    EXPECT_THAT(check("lib/polestar/vdb/a.h", heavy), ElementsAre(HasSubstr("heavy"))) << heavy;
  }
}

TEST(IncludeRules, TheJudgeSharesNothingWithWhatItJudges) {
  for (const char* include : {"polestar/core/types.h", "polestar/pipeline.h", "cli/text.h", "batch/plan.h",
                              "support/exact.h", "../cmd_info.h", "lib/polestar/core/types.h"}) {
    EXPECT_THAT(check("apps/verify/a.cpp", include), ElementsAre(HasSubstr("shares no code"))) << include;
  }
  for (const char* include :
       {"judge_pmap.h", "openvdb/openvdb.h", "nlohmann/json.hpp", "xxhash.h", "vector"}) {
    EXPECT_THAT(check("apps/verify/a.cpp", include), IsEmpty()) << include;
  }
  for (const char* file : {"lib/polestar/certify/a.cpp", "lib/polestar/pipeline.h", "apps/cmd_verify.cpp"}) {
    for (const char* include :
         {"verify/judge_pmap.h", "../verify/judge_pmap.h", "apps/verify/judge_pmap.h"}) {
      EXPECT_THAT(check(file, include), ElementsAre(HasSubstr("the judge's alone"))) << file;
    }
  }
  std::size_t files = 0;
  EXPECT_THAT(checkTree(POLESTAR_SOURCE_DIR, "apps/verify", files), IsEmpty());
  EXPECT_GT(files, 10U) << "the sources were not found";
}

TEST(IncludeRules, UnknownStagesMustBeEnteredIntoTheTable) {
  EXPECT_THAT(check("lib/polestar/newcomer/a.cpp", "polestar/core/types.h"),
              ElementsAre(HasSubstr("not in the table")));
}

TEST(IncludeRules, EveryFormOfTheLineIsRead) {
  EXPECT_THAT(
      checkIncludes("lib/polestar/core/a.cpp", "  #  include  \"polestar/mesh/tri_mesh.h\"  // why\n"),
      ElementsAre(HasSubstr("a.cpp:1")));
  EXPECT_THAT(checkIncludes("lib/polestar/core/a.cpp", "// #include \"polestar/mesh/tri_mesh.h\"\n"),
              IsEmpty());
}

}  // namespace
}  // namespace polestar::testing
