// One stored number changed at random, a thousand times: what inverts a cell is never certified.
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "pmap_maps.h"
#include "polestar/chart/foliation.h"
#include "polestar/map/map_file.h"
#include "support/exact.h"
#include "support/scratch_folder.h"
#include "verify/judge_pmap.h"

namespace polestar::testing {
namespace {

/// The judge's judge: cells by the library's own table, signs by rational numbers.
class Oracle {
 public:
  explicit Oracle(const Foliation& foliation) : foliation_(foliation), cellsAt_(foliation.nodes.size()) {
    for (std::size_t id = 0; id < foliation.cellCount(); ++id) {
      for (const std::uint32_t node : foliation.cell(id)) cellsAt_[node].push_back(id);
    }
  }

  /// Whether a cell around the node is not positive.
  bool inverts(const std::vector<Vec3>& nodes, std::size_t node) const {
    if (!nodes[node].allFinite()) return true;
    for (const std::size_t id : cellsAt_[node]) {
      const auto n = foliation_.cell(id);
      const Rational3 origin = exact(nodes[n[0]]);
      if (determinant(difference(exact(nodes[n[1]]), origin), difference(exact(nodes[n[2]]), origin),
                      difference(exact(nodes[n[3]]), origin)) <= 0) {
        return true;
      }
    }
    return false;
  }

  /// Whether any cell is not positive over these triangles.
  bool inverts(const std::vector<Triangle>& triangles, const std::vector<Vec3>& nodes) const {
    Foliation changed = foliation_;
    changed.triangles = triangles;
    changed.nodes = nodes;
    return countCells(changed).bad() > 0;
  }

 private:
  const Foliation& foliation_;
  std::vector<std::vector<std::size_t>> cellsAt_;
};

template <class Row>
std::vector<Row> rows(const PmapBytes& file, const std::string& name) {
  for (const PmapBytes::Array& array : file.arrays) {
    if (array.name != name) continue;
    std::vector<Row> result(array.count / 3);
    std::memcpy(static_cast<void*>(result.data()), file.data.data() + array.offset,
                result.size() * sizeof(Row));
    return result;
  }
  ADD_FAILURE() << name << " is missing";
  return {};
}

double mutated(double x, std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  switch (random() % 6) {
    case 0:
      return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) ^ (std::uint64_t{1} << random() % 64));
    case 1:
      return -x;
    case 2:
      return 0;
    case 3:
      return x + uniform(random);
    default:
      return x + std::pow(10.0, -8 + 8 * std::abs(uniform(random))) * uniform(random);
  }
}

/// Changes one number; returns its array and its place there.
std::pair<std::string, std::size_t> mutate(PmapBytes& file, std::mt19937_64& random) {
  // The places of nodes matter most; half of the changes go there.
  const std::string wanted = random() % 2 ? "" : random() % 2 ? "nodes_inner" : "ball";
  const PmapBytes::Array* array = nullptr;
  while (!array || array->count == 0)
    array = &file.arrays[random() % file.arrays.size()];  // lists may be empty
  for (const PmapBytes::Array& candidate : file.arrays) {
    if (candidate.name == wanted) array = &candidate;
  }
  const std::size_t at = random() % array->count;
  if (array->type == "int32") {
    char* place = file.data.data() + array->offset + 4 * at;
    std::int32_t value = 0;
    std::memcpy(&value, place, sizeof value);
    value = random() % 2 ? value ^ (1 << random() % 31) : static_cast<std::int32_t>(random() % 162);
    std::memcpy(place, &value, sizeof value);
  } else {
    char* place = file.data.data() + array->offset + 8 * at;
    double value = 0;
    std::memcpy(&value, place, sizeof value);
    value = mutated(value, random);
    std::memcpy(place, &value, sizeof value);
  }
  return {array->name, at};
}

TEST(Mutation, WhatInvertsACellIsNeverCertified) {
  const test::ScratchFolder folder;
  writeMapFile(folder / "map.pmap", smallMap());
  const PmapBytes original(folder / "map.pmap");
  const Oracle oracle(smallMap().chart().foliation());
  const auto triangles = rows<Triangle>(original, "triangles");
  const auto nodes = rows<Vec3>(original, "nodes_inner");
  std::mt19937_64 random(20240607);
  int inverted = 0, certified = 0, refused = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    PmapBytes file = original;
    const auto [name, at] = mutate(file, random);
    bool inverts = false;
    if (name == "nodes_inner" || name == "ball") {
      inverts = oracle.inverts(rows<Vec3>(file, name), at / 3);
    } else if (name == "triangles") {
      const auto changed = rows<Triangle>(file, name);
      const std::int32_t vertex = changed[at / 3][static_cast<std::size_t>(at % 3)];
      inverts = vertex < 0 ||
                vertex >= static_cast<std::int32_t>(smallMap().chart().foliation().vertexCount) ||
                oracle.inverts(changed, nodes);
    }
    file.write(folder / "mutated.pmap");
    bool holds = false;
    try {
      holds = judgePmap(verify::readPmap(folder / "mutated.pmap")).holds();
    } catch (const verify::Unreadable&) {
    }
    EXPECT_FALSE(holds && inverts) << "trial " << trial << ": " << name << ", number " << at;
    inverted += inverts;
    certified += holds;
    refused += !holds && !inverts;
  }
  // The trials are of all kinds: otherwise they would show little.
  EXPECT_GT(inverted, 150);
  EXPECT_GT(certified, 150);
  EXPECT_GT(refused, 20) << "off the surface or the sphere, not finite, no closed surface";
  RecordProperty("inverted", inverted);
  RecordProperty("certified", certified);
}

}  // namespace
}  // namespace polestar::testing
