#include "polestar/mesh/detail/duplicates.h"

#include <algorithm>
#include <tuple>

namespace polestar::detail {

std::vector<std::int32_t> duplicateTriangles(const TriMesh& mesh) {
  // Into buckets by the smallest vertex, then each small bucket in order of the two others.
  struct Entry {
    std::int32_t middle, largest, triangle;
    bool operator<(const Entry& other) const {
      return std::tie(middle, largest, triangle) < std::tie(other.middle, other.largest, other.triangle);
    }
  };
  std::vector<std::int32_t> bucket(mesh.vertices.size() + 1, 0);
  for (const Triangle& t : mesh.triangles) ++bucket[*std::min_element(t.begin(), t.end()) + 1];
  for (std::size_t v = 0; v + 1 < bucket.size(); ++v) bucket[v + 1] += bucket[v];
  std::vector<std::int32_t> filled(bucket.begin(), bucket.end() - 1);
  std::vector<Entry> entries(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Triangle sorted = mesh.triangles[t];
    std::sort(sorted.begin(), sorted.end());
    entries[filled[sorted[0]]++] = {sorted[1], sorted[2], static_cast<std::int32_t>(t)};
  }
  std::vector<std::int32_t> again;
  for (std::size_t v = 0; v + 1 < bucket.size(); ++v) {
    std::sort(entries.begin() + bucket[v], entries.begin() + bucket[v + 1]);
    for (std::int32_t i = bucket[v] + 1; i < bucket[v + 1]; ++i) {
      const Entry &a = entries[i - 1], &b = entries[i];
      if (a.middle == b.middle && a.largest == b.largest) again.push_back(b.triangle);
    }
  }
  return again;
}

}  // namespace polestar::detail
