// libFuzzer entry to the mesh readers, repair and inspection. The first byte picks the file's name, the rest
// is its content. Built with -DPOLESTAR_FUZZERS=ON and clang; run it on a folder of small meshes, each with
// one byte in front.
#include <array>
#include <cstddef>
#include <cstdint>

#include "polestar/core/error.h"
#include "polestar/mesh/closed_surface.h"
#include "polestar/mesh/detail/readers.h"
#include "polestar/mesh/repair.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static constexpr std::array<const char*, 4> kNames{"a.obj", "a.ply", "a.stl", "a.off"};
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  try {
    const polestar::MeshFile file = polestar::detail::parseMesh({kNames[data[0] % kNames.size()], bytes});
    polestar::inspectSurface(polestar::repairMesh(file.mesh).mesh);
  } catch (const polestar::Error& error) {
    if (error.code() != polestar::Errc::io) throw;
  }
  return 0;
}
