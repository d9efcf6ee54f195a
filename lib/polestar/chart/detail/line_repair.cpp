#include "polestar/chart/detail/line_repair.h"

#include <algorithm>
#include <set>

#include "polestar/core/detail/parallel.h"
#include "polestar/core/predicates.h"

namespace polestar::detail {
namespace {

constexpr int kRounds = 12, kWidenAfter = 4;

class Repairer {
 public:
  explicit Repairer(Foliation& foliation) : foliation_(foliation), ring_(foliation.vertexCount) {
    for (const Triangle& t : foliation.triangles) {
      for (int k = 0; k < 3; ++k)
        ring_[t[k]].push_back(t[(k + 1) % 3]);  // closed surface: every neighbour once
    }
  }

  // Mean of the neighbours at every level, shifted as the vertex itself sits within its ring on the surface,
  // a shift that fades with depth.
  void replaceLine(std::int32_t v, const std::vector<char>* without = nullptr) {
    const Foliation& f = foliation_;
    Vec3 surfaceMean;
    double surfaceSpread = 0;
    if (!ringMean(v, 0, without, surfaceMean, surfaceSpread)) return;
    const Vec3 deviation = f.node(0, v) - surfaceMean;
    for (std::size_t level = 1; level < f.levels.size(); ++level) {
      Vec3 mean;
      double spread = 0;
      ringMean(v, level, without, mean, spread);
      // A single neighbour spreads nowhere.
      const double scale = surfaceSpread > 0 ? spread / surfaceSpread : 1;
      const double share = level < 3 ? 0.5 : 0.0;
      foliation_.nodes[f.nodeId(level, v)] = mean + share * scale * deviation;
    }
  }

  void fillFailed(std::span<const std::int32_t> failed) {
    std::vector<char> missing(foliation_.vertexCount, 0);
    for (const std::int32_t v : failed) missing[v] = 1;
    std::vector<std::int32_t> pending(failed.begin(), failed.end());
    while (!pending.empty()) {
      // Only those with a traced neighbour this time; the front moves on.
      std::vector<std::int32_t> ready, later;
      for (const std::int32_t v : pending) {
        const bool hasNeighbour =
            std::any_of(ring_[v].begin(), ring_[v].end(), [&](auto j) { return !missing[j]; });
        (hasNeighbour ? ready : later).push_back(v);
      }
      if (ready.empty()) return;  // no line at all was traced
      for (const std::int32_t v : ready) replaceLine(v, &missing);
      for (const std::int32_t v : ready) missing[v] = 0;
      pending = std::move(later);
    }
  }

  /// Bad cells of every triangle's column.
  std::vector<int> badByTriangle() const {
    const std::size_t triangles = foliation_.triangles.size(), layers = foliation_.layerCount();
    std::vector<int> bad(triangles, 0);
    parallelChunks(triangles, 256, [&](std::size_t begin, std::size_t end) {
      for (std::size_t t = begin; t < end; ++t) {
        for (std::size_t layer = 0; layer <= layers; ++layer) {
          const int cells = layer < layers ? 3 : 1;
          for (int j = 0; j < cells; ++j) {
            const std::size_t id =
                layer < layers ? 3 * (layer * triangles + t) + j : 3 * layers * triangles + t;
            const auto c = foliation_.cell(id);
            bad[t] += orient3d(foliation_.nodes[c[0]], foliation_.nodes[c[1]], foliation_.nodes[c[2]],
                               foliation_.nodes[c[3]]) <= 0;
          }
        }
      }
    });
    return bad;
  }

  /// The corner of every bad triangle with most bad cells around it; all three when `wide`.
  std::set<std::int32_t> suspects(const std::vector<int>& bad, bool wide) const {
    std::vector<int> around(foliation_.vertexCount, 0);
    for (std::size_t t = 0; t < bad.size(); ++t) {
      for (const std::int32_t v : foliation_.triangles[t]) around[v] += bad[t];
    }
    std::set<std::int32_t> result;
    for (std::size_t t = 0; t < bad.size(); ++t) {
      if (bad[t] == 0) continue;
      const Triangle& c = foliation_.triangles[t];
      result.insert(
          *std::max_element(c.begin(), c.end(), [&](auto a, auto b) { return around[a] < around[b]; }));
      if (wide) result.insert(c.begin(), c.end());
    }
    return result;
  }

 private:
  bool ringMean(std::int32_t v, std::size_t level, const std::vector<char>* without, Vec3& mean,
                double& spread) const {
    mean.setZero();
    int count = 0;
    for (const std::int32_t j : ring_[v]) {
      if (without && (*without)[j]) continue;
      mean += foliation_.node(level, j);
      ++count;
    }
    if (count == 0) return false;
    mean /= count;
    spread = 0;
    for (const std::int32_t j : ring_[v]) {
      if (!without || !(*without)[j]) spread += (foliation_.node(level, j) - mean).norm();
    }
    return true;
  }

  Foliation& foliation_;
  std::vector<std::vector<std::int32_t>> ring_;
};

std::size_t total(const std::vector<int>& counts) {
  std::size_t sum = 0;
  for (const int c : counts) sum += static_cast<std::size_t>(c);
  return sum;
}

}  // namespace

void fillLines(Foliation& foliation, std::span<const std::int32_t> failed) {
  if (!failed.empty()) Repairer(foliation).fillFailed(failed);
}

RetracedLines retraceLines(Foliation& foliation, const Retrace& retrace) {
  RetracedLines result;
  const Repairer repairer(foliation);
  std::vector<int> bad = repairer.badByTriangle();
  std::size_t fewest = total(bad);
  for (int attempt = 0; attempt < kRetraces && fewest > 0; ++attempt) {
    const std::vector<Vec3> before = foliation.nodes;
    const std::set<std::int32_t> lines = repairer.suspects(bad, false);
    retrace(lines, attempt);
    result.touched.insert(lines.begin(), lines.end());
    std::vector<int> now = repairer.badByTriangle();
    if (total(now) < fewest) {
      fewest = total(now);
      bad = std::move(now);
      result.kept += lines.size();
    } else {
      foliation.nodes = before;
    }
  }
  return result;
}

ReplacedLines replaceLines(Foliation& foliation) {
  ReplacedLines result;
  Repairer repairer(foliation);
  std::vector<int> bad = repairer.badByTriangle();
  std::size_t fewest = total(bad);
  std::vector<Vec3> best = foliation.nodes;
  std::set<std::int32_t> touched;
  for (int round = 0; round < kRounds && fewest > 0; ++round) {
    const std::set<std::int32_t> lines = repairer.suspects(bad, round >= kWidenAfter);
    if (lines.empty()) break;
    for (const std::int32_t v : lines) repairer.replaceLine(v);
    touched.insert(lines.begin(), lines.end());
    bad = repairer.badByTriangle();
    if (total(bad) < fewest) {
      fewest = total(bad);
      best = foliation.nodes;
      result.lines = touched;
    }
  }
  foliation.nodes = std::move(best);
  result.badCells = fewest;
  return result;
}

}  // namespace polestar::detail
