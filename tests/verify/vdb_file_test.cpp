// Reading .vdb files: ours, ours with something missing, and broken ones.
#include "verify/vdb_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openvdb/openvdb.h>

#include "analytic_ball.h"
#include "polestar/mesh/shapes.h"
#include "polestar/vdb/solid_grids.h"
#include "support/scratch_folder.h"
#include "verify/judge_vdb.h"

namespace polestar::testing {
namespace {

using ::testing::HasSubstr;

struct Ball {
  double radius = 1;
  Vec3 offset = Vec3::Zero();
  int dim = 32, padding = 3;
  std::string domain = "ball";
};

/// The exact ball through the library's grids, in world units.
void writeBall(const std::filesystem::path& path, const Ball& ball) {
  const BallFields fields = exactBall(Vec3(0.2, 0.1, 0));
  const auto toUnit = [&](const Vec3& x) { return Vec3((x - ball.offset) / ball.radius); };
  const double h = 2 * ball.radius / ball.dim;
  SolidGrids grids(
      transformed(icosphere(4), [&](const Vec3& p) { return Vec3(ball.radius * p + ball.offset); }),
      {.voxelSize = h, .padding = ball.padding});
  grids.addVector("rest", ValueRole::invariant, [&](const VoxelBatch& batch, std::span<Vec3f> out) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = fields.rest(toUnit(batch.points[i])).cast<float>();
  });
  grids.addScalar("green", [&](const VoxelBatch& batch, std::span<float> out) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      out[i] = static_cast<float>(std::min(fields.green(toUnit(batch.points[i])) / ball.radius, 1 / h));
    }
  });
  grids.setMetadata("polestar:domain", ball.domain);
  grids.setMetadata("polestar:center", Vec3(ball.radius * fields.center + ball.offset));
  grids.setMetadata("polestar:harmonic_radius", fields.harmonicRadius * ball.radius);
  grids.setMetadata("polestar:green_cap", 1 / h);
  grids.setMetadata("polestar:core_radius", 0.0);
  grids.write(path);
}

std::string complaint(const std::filesystem::path& path) {
  try {
    verify::readVdb(path);
  } catch (const verify::Unreadable& error) {
    return error.what();
  }
  return "";
}

std::string reason(const verify::Report& report) { return report.holds() ? "" : report.firstFailure()->name; }

class VdbFile : public ::testing::Test {
 protected:
  verify::Report judged() const { return judgeVdb(verify::readVdb(path_)); }

  /// Reads the grids with OpenVDB, lets them be changed and writes them back.
  void rewrite(const std::function<void(openvdb::GridPtrVec&)>& change) const {
    openvdb::initialize();
    openvdb::io::File in(path_.string());
    in.open(false);
    openvdb::GridPtrVec grids = *in.getGrids();
    in.close();
    change(grids);
    openvdb::io::File(path_.string()).write(grids);
  }
  static openvdb::GridBase::Ptr named(const openvdb::GridPtrVec& grids, const std::string& name) {
    for (const auto& grid : grids) {
      if (grid->getName() == name) return grid;
    }
    throw std::runtime_error("no grid " + name);
  }

  const test::ScratchFolder folder_;
  const std::filesystem::path path_ = folder_ / "ball.vdb";
};

TEST_F(VdbFile, HoldsAtAnyScaleAndPlace) {
  for (const Ball& ball : {Ball{}, Ball{1000, Vec3(1e6, -2e6, 5e5)}, Ball{1e-7, Vec3(1e-6, 0, 0)}}) {
    writeBall(path_, ball);
    const verify::Report report = judged();
    EXPECT_EQ(reason(report), "") << toText(report);
  }
}

TEST_F(VdbFile, PaddingAndDensityAreNobodysConcern) {
  writeBall(path_, {.padding = 0});
  rewrite([](openvdb::GridPtrVec& grids) {
    std::erase_if(grids, [](const auto& grid) { return grid->getName() == "density"; });
    ASSERT_EQ(grids.size(), 3u);
  });
  const verify::Report report = judged();
  EXPECT_EQ(reason(report), "") << toText(report);
}

TEST_F(VdbFile, WhatIsMissingIsNamed) {
  for (const char* name : {"rest", "green", "surface"}) {
    writeBall(path_, {});
    rewrite([&](openvdb::GridPtrVec& grids) {
      std::erase_if(grids, [&](const auto& grid) { return grid->getName() == name; });
    });
    EXPECT_THAT(complaint(path_), HasSubstr(name));
  }
  for (const char* key :
       {"polestar:center", "polestar:harmonic_radius", "polestar:domain", "polestar:green_cap"}) {
    writeBall(path_, {});
    rewrite([&](openvdb::GridPtrVec& grids) {
      for (const auto& grid : grids) grid->removeMeta(key);
    });
    EXPECT_THAT(complaint(path_), HasSubstr(key));
  }
  writeBall(path_, {.domain = "cube"});
  EXPECT_THAT(complaint(path_), HasSubstr("polestar:domain_cell"));
  writeBall(path_, {.domain = "torus"});
  EXPECT_THAT(complaint(path_), HasSubstr("torus"));
}

TEST_F(VdbFile, OneTransformForAll) {
  for (const char* name : {"rest", "density"}) {
    writeBall(path_, {});
    rewrite([&](openvdb::GridPtrVec& grids) { named(grids, name)->transform().postTranslate({0.01, 0, 0}); });
    EXPECT_EQ(reason(judged()), "transform");
  }
  writeBall(path_, {});
  rewrite([&](openvdb::GridPtrVec& grids) {
    for (const auto& grid : grids) grid->transform().postScale({1, 1, 1.5});
  });
  EXPECT_EQ(reason(judged()), "transform");
  writeBall(path_, {});
  rewrite([&](openvdb::GridPtrVec& grids) {
    for (const auto& grid : grids) grid->transform().postScale({1, 1, -1});
  });
  EXPECT_EQ(reason(judged()), "transform");
}

TEST_F(VdbFile, ARotatedTransformIsASimilarityToo) {
  writeBall(path_, {});
  rewrite([&](openvdb::GridPtrVec& grids) {
    for (const auto& grid : grids) {
      grid->transform().postRotate(0.5, openvdb::math::Z_AXIS);
      const auto center = grid->metaValue<openvdb::Vec3d>("polestar:center");
      const double c = std::cos(0.5), s = std::sin(0.5);
      openvdb::Vec3d turned(c * center.x() - s * center.y(), s * center.x() + c * center.y(), center.z());
      // OpenVDB's rotations turn row vectors; one of the two directions is right.
      const openvdb::Vec3d other(c * center.x() + s * center.y(), -s * center.x() + c * center.y(),
                                 center.z());
      const openvdb::Vec3d axis = grid->transform().indexToWorld(openvdb::Vec3d(1, 0, 0)) -
                                  grid->transform().indexToWorld(openvdb::Vec3d(0));
      grid->insertMeta("polestar:center", openvdb::Vec3DMetadata(axis.y() > 0 ? turned : other));
    }
  });
  const verify::Report report = judged();
  EXPECT_EQ(reason(report), "") << toText(report);
}

TEST_F(VdbFile, EveryVoxelInsideHasToHaveValues) {
  writeBall(path_, {});
  rewrite([&](openvdb::GridPtrVec& grids) {
    const auto rest = openvdb::gridPtrCast<openvdb::Vec3SGrid>(named(grids, "rest"));
    rest->tree().setValueOff(openvdb::Coord(10, 16, 16));
  });
  EXPECT_EQ(reason(judged()), "defined");
}

TEST_F(VdbFile, BrokenFilesAreUnreadable) {
  writeBall(path_, {.dim = 16});
  const std::string bytes = test::bytesOf(path_);
  for (std::size_t k = 0; k < 200; ++k) {
    test::writeBytes(path_, bytes.substr(0, k * bytes.size() / 200));
    EXPECT_NE(complaint(path_), "") << k;
  }
  test::writeBytes(path_, "solid of revolution");
  EXPECT_NE(complaint(path_), "");
  EXPECT_NE(complaint(folder_ / "missing.vdb"), "");
  EXPECT_NE(complaint(folder_.path()), "");
}

}  // namespace
}  // namespace polestar::testing
