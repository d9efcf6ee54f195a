// generate_volumes FOLDER: writes the shapes of this folder and its texture.

#include <cstdio>
#include <exception>
#include <filesystem>

#include "polestar/mesh/write_mesh.h"
#include "volumes/volumes.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: generate_volumes FOLDER\n");
    return 2;
  }
  try {
    for (const polestar::Volume& volume : polestar::shippedVolumes()) {
      const std::filesystem::path path = std::filesystem::path(argv[1]) / volume.file;
      const polestar::TriMesh mesh = volume.make();
      polestar::writeMesh(path, mesh, volume.comment);
      std::printf("%s: %zu vertices, %zu triangles\n", path.c_str(), mesh.vertices.size(),
                  mesh.triangles.size());
    }
    const std::filesystem::path sample = std::filesystem::path(argv[1]) / polestar::kSampleTexture;
    polestar::sampleTexture().write(sample);
    std::printf("%s\n", sample.c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "generate_volumes: %s\n", error.what());
    return 3;
  }
  return 0;
}
