#pragma once
// The two trees of the fast multipole method: one over the charges, one over the places where their potential
// is wanted, both cut from the same cube, and who acts on whom how.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "polestar/core/types.h"
#include "polestar/green/detail/solid_harmonics.h"
#include "polestar/green/detail/translations.h"

namespace polestar::detail {

struct Cube {
  Vec3 low;
  double side;
};
/// A cube a little larger than the points.
Cube enclosingCube(std::span<const Vec3> points);

/// A box of an octree: a cell of the cube's grid of 2^level cells a side.
struct OctreeBox {
  std::array<std::uint32_t, 3> cell{};
  std::uint32_t level = 0;
  std::uint32_t begin = 0, end = 0;              ///< its points, in the tree's order
  std::uint32_t firstChild = 0, childCount = 0;  ///< children are neighbours in the list of boxes

  bool isLeaf() const { return childCount == 0; }
  std::uint32_t count() const { return end - begin; }
  /// Place within the parent, as Translations counts: bit k is the upper half along axis k.
  int octant() const { return static_cast<int>((cell[0] & 1) | ((cell[1] & 1) << 1) | ((cell[2] & 1) << 2)); }
};

ExpansionFrame frameOf(const Cube& cube, const OctreeBox& box);

/// Points sorted along a space-filling curve, so that each box of any level holds a range of them.
class SortedPoints {
 public:
  SortedPoints() = default;
  SortedPoints(std::span<const Vec3> points, const Cube& cube);

  static constexpr std::uint32_t kMaxLevel = 20;

  std::size_t size() const { return order_.size(); }
  /// order()[i]: the given index of the i-th sorted point.
  std::span<const std::uint32_t> order() const { return order_; }
  PointView view(std::uint32_t begin, std::uint32_t end) const {
    return {x_.data() + begin, y_.data() + begin, z_.data() + begin, end - begin};
  }
  /// The first level on which point i and the one before it lie in different boxes; kMaxLevel + 1 if there is
  /// none, 0 for the first point.
  std::uint32_t levelApart(std::size_t i) const;
  /// Appends the children of a box that hold points.
  void split(const OctreeBox& box, std::vector<OctreeBox>& children) const;

 private:
  std::vector<std::uint64_t> keys_;
  std::vector<std::uint32_t> order_;
  std::vector<double> x_, y_, z_;
};

/// The charges' tree: boxes of more than `leafSize` points are split.
class SourceTree {
 public:
  SourceTree(std::span<const Vec3> points, const Cube& cube, std::uint32_t leafSize);

  const Cube& cube() const { return cube_; }
  const SortedPoints& points() const { return points_; }
  std::span<const OctreeBox> boxes() const { return boxes_; }
  /// Boxes of level l: levelStart()[l] .. levelStart()[l + 1].
  std::span<const std::uint32_t> levelStart() const { return levelStart_; }

 private:
  Cube cube_;
  SortedPoints points_;
  std::vector<OctreeBox> boxes_;
  std::vector<std::uint32_t> levelStart_;
};

/// The targets' tree with its lists.
///
/// A target box sees every charge once: through the local expansions of the boxes above it and its own (boxes
/// of its size and two or more away: `translations`; single charges of larger leaves that do not touch it:
/// `singles`) or, in leaves, charge by charge (`near`).
class TargetTree {
 public:
  /// For given targets: a box is split while its targets times its near charges exceed `work`. Here and
  /// below, charges of leaves do not count: splitting the targets further would turn them into single ones,
  /// which is dear.
  TargetTree(const SourceTree& sources, std::span<const Vec3> points, double work);
  /// For targets anywhere in the cube: a box is split while more than `nearCharges` are near, down to
  /// `finest` times the cube's side.
  TargetTree(const SourceTree& sources, std::uint32_t nearCharges, double finest);

  struct Range {
    std::uint32_t begin, end;
  };
  /// Translations by one offset, for boxes of one chunk.
  struct Group {
    std::array<int, 3> offset;
    Range pairs;
  };
  /// Boxes that are worked on together: of one level, neighbours in the list.
  struct Chunk {
    Range boxes, groups;
  };

  const SortedPoints& points() const { return points_; }
  std::span<const OctreeBox> boxes() const { return boxes_; }
  std::span<const std::uint32_t> levelStart() const { return levelStart_; }
  std::span<const Chunk> chunks(std::uint32_t level) const {
    return std::span(chunks_).subspan(chunkStart_[level], chunkStart_[level + 1] - chunkStart_[level]);
  }
  std::span<const Group> groups(const Chunk& chunk) const { return slice(groups_, chunk.groups); }
  std::span<const Translations::Pair> pairs(const Group& group) const { return slice(pairs_, group.pairs); }
  /// Source boxes whose charges go into the local expansion of a box one by one.
  std::span<const std::uint32_t> singles(std::uint32_t box) const { return slice(singles_, singlesOf_[box]); }
  /// Ranges of sorted charges that act directly on the points of a leaf.
  std::span<const Range> near(std::uint32_t leaf) const { return slice(near_, nearOf_[leaf]); }
  /// The leaf around a point of the cube. O(depth).
  std::uint32_t locate(const Cube& cube, const Vec3& point) const;

 private:
  template <class T>
  static std::span<const T> slice(const std::vector<T>& all, const Range& range) {
    return std::span(all).subspan(range.begin, range.end - range.begin);
  }
  template <class Split>
  void build(const SourceTree& sources, Split&& split);
  void sortPairs(std::vector<std::array<std::uint32_t, 3>>& found);

  SortedPoints points_;
  std::vector<OctreeBox> boxes_;
  std::vector<std::uint32_t> levelStart_;
  std::vector<Chunk> chunks_;
  std::vector<std::uint32_t> chunkStart_;
  std::vector<Group> groups_;
  std::vector<Translations::Pair> pairs_;
  std::vector<std::uint32_t> singles_;
  std::vector<Range> singlesOf_, near_, nearOf_;
};

}  // namespace polestar::detail
