#include "polestar/mesh/detail/orient.h"

#include "polestar/core/detail/edge_table.h"

namespace polestar::detail {

std::vector<char> turnsForAgreement(const TriMesh& mesh) {
  const EdgeTable edges(mesh.triangles, mesh.vertices.size());
  const auto count = static_cast<std::int32_t>(mesh.triangles.size());
  std::vector<char> turn(count, 0), reached(count, 0);
  std::vector<std::int32_t> part;
  for (std::int32_t seed = 0; seed < count; ++seed) {
    if (reached[seed]) continue;
    reached[seed] = 1;
    part.assign(1, seed);
    std::size_t turned = 0;
    for (std::size_t next = 0; next < part.size(); ++next) {
      const std::int32_t t = part[next];
      turned += turn[t];
      for (std::int32_t side = 3 * t; side < 3 * t + 3; ++side) {
        const auto sides = edges.sides(edges.edgeOf(side));
        if (sides.size() != 2) continue;
        const std::int32_t across = sides[0] == side ? sides[1] : sides[0];
        if (reached[across / 3]) continue;
        reached[across / 3] = 1;
        const bool agree = edges.forward(side) != edges.forward(across);
        turn[across / 3] = static_cast<char>(turn[t] ^ (agree ? 0 : 1));
        part.push_back(across / 3);
      }
    }
    if (2 * turned > part.size()) {
      for (const std::int32_t t : part) turn[t] ^= 1;
    }
  }
  return turn;
}

}  // namespace polestar::detail
