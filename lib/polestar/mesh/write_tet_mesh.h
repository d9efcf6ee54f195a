#pragma once
// Tetrahedral meshes out: legacy VTK 3.0, Medit .mesh and gmsh 2.2, with every bit of the coordinates.

#include <filesystem>
#include <string>
#include <vector>

#include "polestar/mesh/tet_mesh.h"

namespace polestar {

struct TetMeshWriting {
  bool binary = false;  ///< bytes instead of text; VTK alone has that here
  std::string comment;  ///< the title of a .vtk (its first 255 characters), comment lines elsewhere
};

/// Whether writeTetMesh can write to that name: .vtk, .mesh or .msh.
bool isTetMeshOutputName(const std::filesystem::path& path);

/// Writes the mesh as the name's extension says, atomically. Numbers of text files are the shortest decimals
/// that read back as the same double.
///
/// Medit holds one whole number a vertex and cell; gmsh a physical and a geometrical tag a cell, and data of
/// 1, 3 or 9 components; VTK everything but names of groups. Which numbers become tags: those that were tags
/// of that format when read, else of another one, else the first whole numbers there are.
/// @return What of the mesh the file does not hold, one line each.
/// @throws Error{Errc::usage} for another extension, Error{Errc::io} when it cannot be written.
std::vector<std::string> writeTetMesh(const std::filesystem::path& path, const TetMesh& mesh,
                                      const TetMeshWriting& options = {});

/// What writeTetMesh would return, without writing.
std::vector<std::string> lostInTetMeshFile(const std::filesystem::path& path, const TetMesh& mesh);

}  // namespace polestar
