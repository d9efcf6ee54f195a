#include "plan.h"

#include <algorithm>
#include <map>

#include "exact_solid.h"
#include "support/meshes.h"

namespace polestar::bench {
namespace {

struct Sizes {
  std::vector<int> full, quick;
};

/// Sizes on exact shapes, as far as a method gets on a desktop machine.
const Sizes& sizesOf(const std::string& methodId) {
  static const std::map<std::string, Sizes> table = {
      {"layer", {{2500, 10000, 41000, 164000, 1000000}, {2500, 10000}}},
      {"mfs", {{640, 2500, 10000}, {640}}},
      {"mfs-best", {{640, 2500, 10000}, {640}}},
      {"openvdb", {{32, 64, 128, 256}, {32, 64}}},
      {"openvdb-cut", {{32, 64, 128, 256}, {32, 64}}},
      {"fem", {{640, 2500, 10000, 41000}, {640, 2500}}},
  };
  return table.at(methodId);
}

std::vector<Row> exactRows(bool quick) {
  std::vector<Row> rows;
  for (const ExactSolid& solid : exactSolids()) {
    for (const Method& m : methods()) {
      const Sizes& sizes = sizesOf(m.id);
      for (const int size : quick ? sizes.quick : sizes.full)
        rows.push_back({.method = m.id, .shape = solid.name, .size = size});
    }
  }
  return rows;
}

std::vector<Row> modelRows(bool quick) {
  std::vector<Row> rows;
  const std::vector<int> sizes =
      quick ? std::vector<int>{10000} : std::vector<int>{10000, 41000, 164000, 1000000};
  for (const std::string& shape : scalingShapes()) {
    for (const int size : sizes) rows.push_back({.method = "layer", .shape = shape, .size = size});
    for (const Goal& goal : goals()) {
      if (quick) continue;
      rows.push_back({.method = "layer", .shape = shape, .size = goal.size, .tolerance = goal.tolerance});
    }
  }
  if (!testing::meshFolder()) return rows;
  for (const testing::ManifestEntry& entry : testing::manifest()) {
    const std::string file = entry.path.filename().string();
    const bool wanted = quick ? file == "castalia.obj" || file == "psyche.obj" : entry.star == "yes";
    if (wanted) rows.push_back({.method = "layer", .shape = file});
  }
  return rows;
}

}  // namespace

const std::vector<Goal>& goals() {
  static const std::vector<Goal> table = {{10000, 0.8, 1e-3}, {41000, 3, 3e-4}, {164000, 13, 1e-4}};
  return table;
}

bool isExactShape(const std::string& shape) {
  const auto& solids = exactSolids();
  return std::any_of(solids.begin(), solids.end(), [&](const ExactSolid& s) { return s.name == shape; });
}

const std::vector<std::string>& scalingShapes() {
  static const std::vector<std::string> shapes = {"head", "asteroid"};
  return shapes;
}

std::vector<Row> planRows(const PlanOptions& options) {
  std::vector<Row> rows;
  auto append = [&](std::vector<Row> more) {
    auto onSurface = [](const Row& row) {
      return method(row.method).voxels ? row.size * row.size : row.size;
    };
    std::stable_sort(more.begin(), more.end(),
                     [&](const Row& a, const Row& b) { return onSurface(a) < onSurface(b); });
    rows.insert(rows.end(), more.begin(), more.end());
  };
  if (options.part != "models") append(exactRows(options.quick));
  if (options.part != "exact") append(modelRows(options.quick));
  std::erase_if(rows, [&](const Row& row) {
    const bool chosen = options.only.empty() ||
                        std::find(options.only.begin(), options.only.end(), row.method) != options.only.end();
    return !chosen || row.size > (method(row.method).voxels ? options.maxDim : options.maxVertices);
  });
  return rows;
}

}  // namespace polestar::bench
