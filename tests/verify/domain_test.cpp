// Maps onto cubes and polycubes: what the library makes holds, and every part of it can be refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "polestar/mesh/shapes.h"
#include "polestar/pipeline.h"
#include "support/scratch_folder.h"
#include "support/solids.h"
#include "verify/domain.h"
#include "verify/judge_pmap.h"
#include "verify/judge_vdb.h"
#include "verify/report.h"
#include "verify/vdb_file.h"

namespace polestar::testing {
namespace {

using verify::Domain;

TEST(JudgedDomain, GaugeIsTheShareOfTheWayOut) {
  const Domain ball;
  EXPECT_DOUBLE_EQ(ball.gauge({0.3, 0, 0.4}), 0.5);
  const Domain cells("0 0 0;1:2 0 0; 0 0 1", 0.5);
  EXPECT_EQ(cells.cellCount(), 4u);
  EXPECT_EQ(cells.defect(), "");
  EXPECT_DOUBLE_EQ(cells.volume(), 0.5);
  EXPECT_DOUBLE_EQ(cells.gauge({0, 0, 0}), 0);
  EXPECT_DOUBLE_EQ(cells.gauge({1.25, 0, 0}), 1);
  EXPECT_DOUBLE_EQ(cells.gauge({-0.125, 0, 0}), 0.5);
  EXPECT_DOUBLE_EQ(cells.gauge({0.5, 0.2, 0}), 0.8);  // leaves through the side y = 1/4
  EXPECT_DOUBLE_EQ(cells.gauge({0.5, 0, 0.5}), 2);    // at the reentrant edge (1/4, 1/4) already
}

TEST(JudgedDomain, CellsThatAreNotJoinedTowardsTheCenterAreNamed) {
  EXPECT_THAT(Domain("0 0 0;2 0 0", 1).defect(), ::testing::HasSubstr("(2, 0, 0)"));
  EXPECT_THAT(Domain("0 0 0;1 1 0;1 0 0", 1).defect(), ::testing::HasSubstr("(1, 1, 0)"));
  EXPECT_THAT(Domain("1 0 0", 1).defect(), ::testing::HasSubstr("(0, 0, 0)"));
}

TEST(JudgedDomain, TextThatIsNoListOfCellsIsUnreadable) {
  for (const char* text :
       {"", "0 0", "0 0 0 0", "a b c", "1:0 0 0", "0 0 9999999", "0 0 0;1.5 0 0", "0:99999 0 0"})
    EXPECT_THROW(Domain(text, 1), verify::Unreadable) << text;
  EXPECT_THROW(Domain("0 0 0", 0), verify::Unreadable);
}

const StarShape& shape() {
  static const StarShape star = starShape(smoothStar(3));
  return star;
}

DomainMap mapped(SphereMapKind boundary) {
  MapOptions options;
  options.boundary = boundary;
  const Polycube cells = verifyPolycube({{0, 0, 0}, {1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}});
  return mapToDomain(mapToBall(shape(), options), placePolycube(shape(), cells), options);
}

const DomainMap& byRotation() {
  static const DomainMap map = mapped(SphereMapKind::fieldLine);
  return map;
}

verify::PmapContents contentsOf(const DomainMap& map) {
  const test::ScratchFolder folder;
  writeMapFile(folder / "map.pmap", map);
  return verify::readPmap(folder / "map.pmap");
}

std::string reason(const verify::Report& report) { return report.holds() ? "" : report.firstFailure()->name; }

TEST(JudgedDomain, PmapsHold) {
  const verify::Report report = judgePmap(contentsOf(byRotation()));
  EXPECT_TRUE(report.holds()) << toText(report);
}

TEST(JudgedDomain, EveryPartOfAPmapCanBeRefused) {
  const verify::PmapContents good = contentsOf(byRotation());
  const std::size_t n = good.domain->map.vertices.size();
  const struct {
    const char* reason;
    std::function<void(verify::PmapContents&)> spoil;
  } cases[] = {
      {"cells_solid",
       [](auto& m) { std::swap(m.nodes[m.vertices.size() + 7], m.nodes[2 * m.vertices.size() + 7]); }},
      {"domain", [](auto& m) { m.domain->shape = Domain("0 0 0;2 0 0", m.domain->shape.side()); }},
      {"domain_cells_solid",
       [n](auto& m) { std::swap(m.domain->map.nodes[n + 7], m.domain->map.nodes[2 * n + 7]); }},
      {"domain_cells_ball",
       [n](auto& m) { std::swap(m.domain->map.ball[n + 7], m.domain->map.ball[2 * n + 7]); }},
      {"domain_cells", [](auto& m) { m.domain->shape = Domain("0 0 0;1 0 0", m.domain->shape.side()); }},
      {"motion_rotation",
       [](auto& m) { m.domain->motion.rotation[0] = 1.01 * m.domain->motion.rotation[0]; }},
      {"motion_core", [](auto& m) { m.domain->motion.coreRadius = 1.5; }},
      {"motion_pull", [](auto& m) {
         m.domain->motion.pull = {0, 1, 0};
       }}};
  for (const auto& one : cases) {
    verify::PmapContents bad = good;
    one.spoil(bad);
    EXPECT_EQ(reason(judgePmap(bad)), one.reason);
  }
}

TEST(JudgedDomain, TablesBetweenTheBallsAreJudged) {
  const verify::PmapContents good = contentsOf(mapped(SphereMapKind::conformal));
  ASSERT_FALSE(good.domain->motion.from.empty());
  EXPECT_TRUE(judgePmap(good).holds()) << toText(judgePmap(good));
  verify::PmapContents bad = good;
  std::swap(bad.domain->motion.to[3], bad.domain->motion.to[4000]);
  EXPECT_EQ(reason(judgePmap(bad)), "motion_turns");
  bad = good;
  for (verify::Vec3& v : bad.domain->motion.from) v.x = -v.x;
  EXPECT_EQ(reason(judgePmap(bad)), "motion_from");
  bad = good;
  bad.domain->motion.triangles.pop_back();
  EXPECT_EQ(reason(judgePmap(bad)), "motion_closed");
}

class JudgedDomainGrids : public ::testing::Test {
 protected:
  static SolidGrids grids() {
    return gridsOf(byRotation(), {.voxelSize = voxelSizeFor(shape().surface().mesh(), 48)});
  }
  verify::VoxelSolid read(const SolidGrids& made) const {
    made.write(folder_ / "map.vdb");
    return verify::readVdb(folder_ / "map.vdb");
  }
  test::ScratchFolder folder_;
};

TEST_F(JudgedDomainGrids, Hold) {
  const verify::Report report = judgeVdb(read(grids()));
  EXPECT_TRUE(report.holds()) << toText(report);
  EXPECT_EQ(report.find("field_lines"), nullptr);
  EXPECT_FALSE(report.notJudged.empty());
}

TEST_F(JudgedDomainGrids, WhatIsSpoiledIsRefused) {
  const verify::VoxelSolid good = read(grids());
  const struct {
    const char* reason;
    std::function<void(verify::VoxelSolid&)> spoil;
  } cases[] = {
      {"domain", [](auto& s) { s.domain = Domain("0 0 0;2 0 0", 0.6); }},
      {"range",
       [](auto& s) {
         s.rest[s.count() / 2] = {5, 5, 5};
       }},
      {"degree",
       [](auto& s) {
         for (auto& y : s.rest) y.x = -y.x;
       }},
      {"boundary",
       [](auto& s) {
         for (auto& y : s.rest) y = {0.8F * y.x, 0.8F * y.y, 0.8F * y.z};
       }},
      {"cells", [](auto& s) {
         // Two neighbours deep inside change places.
         const std::int32_t middle = s.slot[s.boxIndex(s.size[0] / 2, s.size[1] / 2, s.size[2] / 2)],
                            other = s.slot[s.boxIndex(s.size[0] / 2 + 2, s.size[1] / 2, s.size[2] / 2)];
         std::swap(s.rest[static_cast<std::size_t>(middle)], s.rest[static_cast<std::size_t>(other)]);
       }}};
  for (const auto& one : cases) {
    verify::VoxelSolid bad = good;
    one.spoil(bad);
    const verify::Report report = judgeVdb(bad);
    EXPECT_FALSE(report.holds());
    const verify::Check* check = report.find(one.reason);
    ASSERT_NE(check, nullptr) << one.reason;
    EXPECT_FALSE(check->passed) << one.reason;
  }
}

}  // namespace
}  // namespace polestar::testing
