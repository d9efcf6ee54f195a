#include "polestar/vdb/detail/mesh_to_volume.h"

#include <openvdb/tools/MeshToVolume.h>

#include <vector>

#include "polestar/core/detail/parallel.h"

namespace polestar::detail {
namespace {

/// What OpenVDB's tools ask whether to go on.
struct Interrupter {
  const Context& context;

  void start(const char* = nullptr) {}
  void end() {}
  bool wasInterrupted(int = -1) const { return context.cancelled(); }
};

/// A mesh as meshToVolume reads it, without a copy in single precision.
struct MeshAdapter {
  const TriMesh& mesh;

  std::size_t polygonCount() const { return mesh.triangles.size(); }
  std::size_t pointCount() const { return mesh.vertices.size(); }
  std::size_t vertexCount(std::size_t) const { return 3; }
  void getIndexSpacePoint(std::size_t triangle, std::size_t k, openvdb::Vec3d& point) const {
    const Vec3& corner = mesh.corner(triangle, static_cast<int>(k));
    point = {corner.x(), corner.y(), corner.z()};
  }
};

// The tool works in index space, since OpenVDB refuses transforms of small voxels.
void scaleValues(openvdb::FloatTree& tree, double factor) {
  const auto by = static_cast<float>(factor);
  auto tile = tree.beginValueAll();
  tile.setMaxDepth(openvdb::FloatTree::ValueAllIter::LEAF_DEPTH - 1);
  for (; tile; ++tile) tile.setValue(*tile * by);
  std::vector<openvdb::FloatTree::LeafNodeType*> leaves;
  tree.getNodes(leaves);
  parallelChunks(leaves.size(), 64, [&](std::size_t begin, std::size_t end) {
    for (std::size_t l = begin; l < end; ++l) {
      float* values = leaves[l]->buffer().data();
      for (openvdb::Index i = 0; i < openvdb::FloatTree::LeafNodeType::SIZE; ++i) values[i] *= by;
    }
  });
  tree.root().setBackground(tree.background() * by, /*updateChildNodes=*/false);
}

}  // namespace

openvdb::FloatTree::Ptr meshToVolume(const TriMesh& surface, int halfWidth, double voxelSize,
                                     const Context& context) {
  Interrupter interrupter{context};
  const auto width = static_cast<float>(halfWidth);
  const auto grid = openvdb::tools::meshToVolume<openvdb::FloatGrid>(
      interrupter, MeshAdapter{surface}, *openvdb::math::Transform::createLinearTransform(), width, width);
  context.throwIfCancelled();
  scaleValues(grid->tree(), voxelSize);
  return grid->treePtr();
}

}  // namespace polestar::detail
