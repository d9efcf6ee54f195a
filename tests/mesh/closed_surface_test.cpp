#include "polestar/mesh/closed_surface.h"
#include <gtest/gtest.h>
#include <cstdio>
#include "polestar/core/error.h"
#include "polestar/mesh/read_mesh.h"
#include "polestar/mesh/repair.h"
#include "support/meshes.h"
namespace polestar {
TEST(X, All) {
  for (const auto& e : testing::manifest()) {
    try {
      MeshFile f = readMesh(e.path);
      RepairedMesh r = repairMesh(f.mesh);
      SurfaceReport s = inspectSurface(r.mesh);
      std::printf("%s [%s c%d g%d n%d] %zu %zu poly %zu -> %zu %zu | %s | valid %d comp %d genus %d be %zu nm %zu mv %zu | %s\n", e.path.filename().c_str(),
                  e.star.c_str(), e.closed, e.genus.value_or(-9), e.components, f.mesh.vertices.size(), f.mesh.triangles.size(), f.polygons, s.vertices, s.triangles,
                  r.report.summary().c_str(), s.valid, s.components, s.genus, s.boundaryEdges, s.nonManifoldEdgeCount, s.nonManifoldVertexCount, s.defect.c_str());
    } catch (const Error& x) {
      std::printf("%s [%s] ERROR %s\n", e.path.filename().c_str(), e.star.c_str(), x.what());
    }
  }
}
}
