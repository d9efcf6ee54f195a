#include "polestar/vdb/detail/mesh_to_level_set.h"

#include <openvdb/tools/MeshToVolume.h>
#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include "polestar/core/detail/parallel.h"
#include "polestar/vdb/detail/column_crossings.h"

namespace polestar::detail {
namespace {

// What OpenVDB's mesh tool asks of a mesh. Its ready-made adapter holds floats; ours hands out the doubles we
// have.
struct MeshAdapter {
  const TriMesh& mesh;

  std::size_t polygonCount() const { return mesh.triangles.size(); }
  std::size_t pointCount() const { return mesh.vertices.size(); }
  std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t triangle, std::size_t corner, openvdb::Vec3d& point) const {
    const Vec3& p = mesh.corner(triangle, static_cast<int>(corner));
    point = {p.x(), p.y(), p.z()};
  }
};

struct Interrupter {
  const Context& context;

  void start(const char* = nullptr) {}
  void end() {}
  bool wasInterrupted(int = -1) { return context.cancelled(); }
};

}  // namespace

openvdb::FloatTree::Ptr meshToLevelSet(const TriMesh& surface, int halfWidth, double voxelSize,
                                       const Context& context) {
  // Unsigned distances: the tool's signed mode floods the outside, which takes thin gaps for solid, and its
  // renormalization moves values off the exact distance.
  const auto band = static_cast<float>(halfWidth);
  Interrupter interrupter{context};
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(interrupter, MeshAdapter{surface},
                                                                     openvdb::math::Transform(), band, band,
                                                                     openvdb::tools::UNSIGNED_DISTANCE_FIELD);
  context.throwIfCancelled();

  const ColumnCrossings crossings(surface, context);
  const openvdb::FloatTree::Ptr tree = grid->treePtr();
  std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
  tree->getNodes(leaves);
  const auto scale = static_cast<float>(voxelSize);
  parallelChunks(leaves.size(), 16, context, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      for (auto voxel = leaves[l]->beginValueOn(); voxel; ++voxel) {
        const openvdb::Coord at = voxel.getCoord();
        const float distance = *voxel * scale;
        // No -0: a voxel on the surface is not inside.
        voxel.setValue(distance > 0 && crossings.inside(at.x(), at.y(), at.z()) ? -distance : distance);
      }
    }
  });

  // Signs of the band spread to what is not active.
  tree->root().setBackground(band * scale, /*updateChildNodes=*/false);
  openvdb::tools::signedFloodFill(*tree);
  openvdb::tools::pruneLevelSet(*tree);
  return tree;
}

}  // namespace polestar::detail
