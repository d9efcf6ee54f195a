#include "row.h"

#include <algorithm>
#include <stdexcept>

#include "exact_solid.h"

namespace polestar::bench {

const std::vector<Method>& methods() {
  static const std::vector<Method> all = {
      {"layer", "polestar, single layer", false},
      {"mfs", "MFS of the paper", false},
      {"mfs-best", "MFS at its best", false},
      {"openvdb", "OpenVDB Poisson", true},
      {"openvdb-cut", "OpenVDB Poisson, cut cells", true},
      {"fem", "cotangent Laplacian, TetGen", false},
  };
  return all;
}

const Method& method(const std::string& id) {
  const auto found =
      std::find_if(methods().begin(), methods().end(), [&](const Method& m) { return m.id == id; });
  if (found == methods().end()) throw std::out_of_range("no method " + id);
  return *found;
}

Json toJson(const Row& row) {
  return {{"method", row.method}, {"shape", row.shape}, {"size", row.size}, {"tolerance", row.tolerance}};
}

Row rowOf(const Json& result) {
  return {result.at("method"), result.at("shape"), result.at("size"), result.at("tolerance")};
}

const std::vector<std::string>& rowKeys() {
  static const std::vector<std::string> keys{"method", "shape", "size", "tolerance"};
  return keys;
}

Reference referenceFor(const std::string& exactShape) {
  const ExactSolid& solid = exactSolid(exactShape);
  Reference reference;
  reference.points = probes(solid, 2000);
  for (const Vec3& x : reference.points) reference.green.push_back(solid.green(x));
  return reference;
}

}  // namespace polestar::bench
