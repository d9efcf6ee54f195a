#include "polestar/mesh/detail/zero_area.h"

#include <algorithm>
#include <limits>

namespace polestar::detail {
namespace {

class ZeroAreaMender {
 public:
  explicit ZeroAreaMender(TriMesh& mesh) : mesh_(mesh) {
    double largest = 0;
    for (const Vec3& v : mesh.vertices) largest = std::max(largest, v.cwiseAbs().maxCoeff());
    rounding_ = 4 * std::numeric_limits<double>::epsilon() * largest;
  }

  std::size_t run() {
    std::vector<std::int32_t> waiting;
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (isFlat(static_cast<std::int32_t>(t))) waiting.push_back(static_cast<std::int32_t>(t));
    }
    if (waiting.empty()) return 0;
    std::reverse(waiting.begin(), waiting.end());  // taken from the back
    trianglesAt_.resize(mesh_.vertices.size());
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) attach(static_cast<std::int32_t>(t));
    // Every step shortens a longest edge or removes an edge; the bounds are for rounding that undoes it, and
    // for crafted fans of millions of triangles around one vertex.
    std::size_t mended = 0;
    for (std::size_t steps = 16 * waiting.size() + 64; steps > 0 && work_ < kMostWork && !waiting.empty();
         --steps) {
      const std::int32_t t = waiting.back();
      waiting.pop_back();
      if (!isAlive(t) || !isFlat(t)) continue;
      if (collapseShortest(t, waiting) || flipLongest(t, waiting)) ++mended;
    }
    std::erase_if(mesh_.triangles, [](const Triangle& t) { return t[0] < 0; });
    return mended;
  }

 private:
  bool isAlive(std::int32_t t) const { return mesh_.triangles[t][0] >= 0; }
  double sideLength(std::int32_t t, int k) const {
    return (mesh_.corner(t, (k + 1) % 3) - mesh_.corner(t, k)).norm();
  }
  int longestSide(std::int32_t t) const {
    int longest = 0;
    for (int k = 1; k < 3; ++k) {
      if (sideLength(t, k) > sideLength(t, longest)) longest = k;
    }
    return longest;
  }
  bool isFlat(std::int32_t t) const {
    return areaVector(mesh_, t).norm() <= rounding_ * sideLength(t, longestSide(t));
  }

  void attach(std::int32_t t) {
    for (const std::int32_t v : mesh_.triangles[t]) trianglesAt_[v].push_back(t);
  }
  void detach(std::int32_t t) {
    for (const std::int32_t v : mesh_.triangles[t]) {
      work_ += trianglesAt_[v].size();
      std::erase(trianglesAt_[v], t);
    }
  }
  bool has(std::int32_t t, std::int32_t v) const {
    const Triangle& corners = mesh_.triangles[t];
    return corners[0] == v || corners[1] == v || corners[2] == v;
  }
  std::vector<std::int32_t> trianglesOnEdge(std::int32_t a, std::int32_t b) {
    work_ += trianglesAt_[a].size();
    std::vector<std::int32_t> found;
    for (const std::int32_t t : trianglesAt_[a]) {
      if (has(t, b)) found.push_back(t);
    }
    return found;
  }
  std::vector<std::int32_t> neighbours(std::int32_t v) {
    work_ += trianglesAt_[v].size();
    std::vector<std::int32_t> found;
    for (const std::int32_t t : trianglesAt_[v]) {
      for (const std::int32_t w : mesh_.triangles[t]) {
        if (w != v) found.push_back(w);
      }
    }
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }
  static void replace(Triangle& t, std::int32_t from, std::int32_t to) {
    std::replace(t.begin(), t.end(), from, to);
  }

  /// With the longest edge a-c and b between: neighbour (c, a, d) becomes (c, b, d), `t` becomes (b, a, d).
  bool flipLongest(std::int32_t t, std::vector<std::int32_t>& waiting) {
    const int k = longestSide(t);
    const Triangle corners = mesh_.triangles[t];
    const std::int32_t a = corners[k], c = corners[(k + 1) % 3], b = corners[(k + 2) % 3];
    const std::vector<std::int32_t> onEdge = trianglesOnEdge(a, c);
    if (onEdge.size() != 2) return false;
    const std::int32_t n = onEdge[0] == t ? onEdge[1] : onEdge[0];
    const Triangle neighbour = mesh_.triangles[n];
    const std::int32_t d = neighbour[0] ^ neighbour[1] ^ neighbour[2] ^ a ^ c;
    if (d == b || !trianglesOnEdge(b, d).empty()) return false;
    detach(t);
    detach(n);
    mesh_.triangles[t] = mesh_.triangles[n] = neighbour;
    replace(mesh_.triangles[n], a, b);
    replace(mesh_.triangles[t], c, b);
    attach(t);
    attach(n);
    waiting.insert(waiting.end(), {n, t});
    return true;
  }

  /// Only for edges of rounding size, and only where the surface stays one (the link condition).
  bool collapseShortest(std::int32_t t, std::vector<std::int32_t>& waiting) {
    int k = 0;
    for (int i = 1; i < 3; ++i) {
      if (sideLength(t, i) < sideLength(t, k)) k = i;
    }
    if (sideLength(t, k) > rounding_) return false;
    const std::int32_t a = mesh_.triangles[t][k], b = mesh_.triangles[t][(k + 1) % 3];
    const std::int32_t kept = std::min(a, b), gone = std::max(a, b);
    const std::vector<std::int32_t> onEdge = trianglesOnEdge(kept, gone);
    const std::vector<std::int32_t> aroundKept = neighbours(kept), aroundGone = neighbours(gone);
    std::vector<std::int32_t> common;
    std::set_intersection(aroundKept.begin(), aroundKept.end(), aroundGone.begin(), aroundGone.end(),
                          std::back_inserter(common));
    if (onEdge.size() != 2 || common.size() != 2 || aroundKept.size() + aroundGone.size() < 9) return false;
    for (const std::int32_t dead : onEdge) {
      detach(dead);
      mesh_.triangles[dead][0] = -1;
    }
    const std::vector<std::int32_t> moving = trianglesAt_[gone];
    for (const std::int32_t m : moving) {
      detach(m);
      replace(mesh_.triangles[m], gone, kept);
      attach(m);
      waiting.push_back(m);
    }
    return true;
  }

  TriMesh& mesh_;
  static constexpr std::size_t kMostWork = 1'000'000'000;
  double rounding_ = 0;
  std::size_t work_ = 0;  ///< triangles looked at
  std::vector<std::vector<std::int32_t>> trianglesAt_;
};

}  // namespace

std::size_t mendZeroArea(TriMesh& mesh) { return ZeroAreaMender(mesh).run(); }

}  // namespace polestar::detail
