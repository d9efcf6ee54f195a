#include <polestar/core/version.h>
#include <polestar/mesh/shapes.h>

#include <cstdio>

int main() {
  const polestar::TriMesh ball = polestar::icosphere(2);
  std::printf("polestar %s: %zu vertices\n", polestar::kVersion, ball.vertices.size());
}
