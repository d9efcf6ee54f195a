#include "galaxy_maps.h"

#include <cstdlib>
#include <stdexcept>

#include "polestar/mesh/read_tet_mesh.h"
#include "polestar/mesh/tet_orientation.h"
#include "polestar/mesh/write_tet_mesh.h"
#include "run_program.h"
#include "support/scratch_folder.h"

namespace polestar::bench {
namespace {

namespace fs = std::filesystem;

constexpr int kStopped = 124;  // of the program `timeout`

void write(const fs::path& path, const TetMesh& mesh, std::span<const Vec3> at) {
  polestar::TetMesh file;
  file.vertices.assign(at.begin(), at.end());
  for (const auto& t : mesh.tetrahedra) file.addCell(CellShape::tetrahedron, t);
  writeTetMesh(path, file);
}

}  // namespace

std::optional<fs::path> galaxyMapsProgram() {
  const char* given = std::getenv("POLESTAR_GALAXY_MAPS");
  if (!given || !*given) return std::nullopt;
  const fs::path place(given);
  for (const fs::path& program : {place, place / "galaxy_map", place / "build" / "galaxy_map"}) {
    if (fs::is_regular_file(program)) return program;
  }
  return std::nullopt;
}

std::optional<GalaxyMap> repairByGalaxyMaps(const fs::path& program, const TetMesh& mesh,
                                            std::span<const Vec3> image, int seconds) {
  const test::ScratchFolder folder;
  write(folder / "solid.vtk", mesh, mesh.vertices);
  write(folder / "ball.vtk", mesh, image);
  const std::optional<int> status =
      runProgram({"timeout", std::to_string(seconds), program.string(), (folder / "solid.vtk").string(),
                  (folder / "ball.vtk").string(), "-o", (folder / "repaired").string()});
  if (status == kStopped) return std::nullopt;
  if (status != 0) throw std::runtime_error("galaxy_map failed");
  const polestar::TetMesh solid = readTetMesh(folder / "repaired_object.vtk").mesh;
  const polestar::TetMesh ball = readTetMesh(folder / "repaired_parameter.vtk").mesh;
  if (solid.vertices.size() != ball.vertices.size())
    throw std::runtime_error("galaxy_map wrote two meshes that do not belong together");
  return GalaxyMap{{solid.vertices, 0, solid.tetrahedra().corners}, ball.vertices};
}

}  // namespace polestar::bench
