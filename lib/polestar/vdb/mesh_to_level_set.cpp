#include "polestar/vdb/detail/mesh_to_level_set.h"

#include <openvdb/tools/Prune.h>
#include <openvdb/tools/SignedFloodFill.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "polestar/core/detail/parallel.h"
#include "polestar/vdb/detail/column_crossings.h"
#include "polestar/vdb/detail/triangle_tree.h"

namespace polestar::detail {
namespace {

using openvdb::Coord;
using Leaf = openvdb::FloatTree::LeafNodeType;

constexpr int kLeafSize = static_cast<int>(Leaf::DIM);

// Origins of the leaves that may hold a voxel of the band: blocks of voxels, halved as long as they reach it.
std::vector<Coord> leavesNearSurface(const TriMesh& surface, const TriangleTree& tree, double band,
                                     const Context& context) {
  constexpr int kLargestBlock = 32 * kLeafSize;
  const Box box = boundingBox(surface);
  const auto blockBelow = [](double x) {
    return static_cast<int>(std::floor(x / kLargestBlock)) * kLargestBlock;
  };
  std::vector<Coord> blocks;
  for (int x = blockBelow(box.min.x() - band); x <= box.max.x() + band; x += kLargestBlock) {
    for (int y = blockBelow(box.min.y() - band); y <= box.max.y() + band; y += kLargestBlock) {
      for (int z = blockBelow(box.min.z() - band); z <= box.max.z() + band; z += kLargestBlock) {
        blocks.emplace_back(x, y, z);
      }
    }
  }
  for (int size = kLargestBlock;; size /= 2) {
    std::vector<char> keep(blocks.size());
    parallelChunks(blocks.size(), 8, context, [&](std::size_t begin, std::size_t end) {
      const double half = 0.5 * (size - 1), reach = band + half * std::sqrt(3.0);
      for (std::size_t b = begin; b < end; ++b) {
        const Vec3 center(blocks[b].x() + half, blocks[b].y() + half, blocks[b].z() + half);
        keep[b] = tree.distance(center, reach) < reach;
      }
    });
    std::vector<Coord> next;
    for (std::size_t b = 0; b < blocks.size(); ++b) {
      if (!keep[b]) continue;
      if (size == kLeafSize) {
        next.push_back(blocks[b]);
        continue;
      }
      for (int k = 0; k < 8; ++k) {
        const int half = size / 2;
        next.push_back(blocks[b].offsetBy(k & 4 ? half : 0, k & 2 ? half : 0, k & 1 ? half : 0));
      }
    }
    blocks = std::move(next);
    if (size == kLeafSize) return blocks;
  }
}

// Distances at the voxels of one leaf; `band` where they are not below it.
std::array<double, Leaf::SIZE> leafDistances(const TriangleTree& tree, const Coord& origin, double band) {
  std::array<double, Leaf::SIZE> distances;
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    const Coord local = Leaf::offsetToLocalCoord(i);
    // A neighbour's distance bounds this one's from above, and a tight bound is what makes the query fast.
    double bound = band;
    for (int axis = 0; axis < 3; ++axis) {
      const openvdb::Index stride = 1u << (Leaf::LOG2DIM * (2 - axis));
      if (local[axis] > 0) bound = std::min(bound, (distances[i - stride] + 1) * (1 + 1e-9));
    }
    const Coord at = origin + local;
    distances[i] = tree.distance(Vec3(at.x(), at.y(), at.z()), bound);
  }
  return distances;
}

// Null when no voxel of the leaf is in the band.
std::unique_ptr<Leaf> makeLeaf(const TriangleTree& tree, const ColumnCrossings& crossings,
                               const Coord& origin, double band, double voxelSize) {
  const auto distances = leafDistances(tree, origin, band);
  if (std::none_of(distances.begin(), distances.end(), [&](double d) { return d < band; })) return nullptr;
  const float background = static_cast<float>(band) * static_cast<float>(voxelSize);
  const float largest = std::nextafter(background, 0.f);
  auto leaf = std::make_unique<Leaf>(origin, background);
  for (openvdb::Index i = 0; i < Leaf::SIZE; ++i) {
    if (!(distances[i] < band)) continue;
    const Coord at = leaf->offsetToGlobalCoord(i);
    const float distance = std::min(static_cast<float>(distances[i] * voxelSize), largest);
    // No -0: a voxel on the surface is not inside.
    leaf->setValueOn(i, distance > 0 && crossings.inside(at.x(), at.y(), at.z()) ? -distance : distance);
  }
  return leaf;
}

}  // namespace

openvdb::FloatTree::Ptr meshToLevelSet(const TriMesh& surface, int halfWidth, double voxelSize,
                                       const Context& context) {
  const TriangleTree triangles(surface);
  const ColumnCrossings crossings(surface, context);
  const std::vector<Coord> origins = leavesNearSurface(surface, triangles, halfWidth, context);
  std::vector<std::unique_ptr<Leaf>> leaves(origins.size());
  parallelChunks(origins.size(), 1, context, [&](std::size_t l, std::size_t) {
    leaves[l] = makeLeaf(triangles, crossings, origins[l], halfWidth, voxelSize);
  });

  const auto tree =
      std::make_shared<openvdb::FloatTree>(static_cast<float>(halfWidth) * static_cast<float>(voxelSize));
  for (std::unique_ptr<Leaf>& leaf : leaves) {
    if (leaf) tree->addLeaf(leaf.release());
  }
  // Signs of the band spread to what is not active.
  openvdb::tools::signedFloodFill(*tree);
  openvdb::tools::pruneLevelSet(*tree);
  return tree;
}

}  // namespace polestar::detail
