#pragma once
// Tetrahedral meshes in: legacy VTK (text and binary, versions 2 to 5), Medit .mesh (text), gmsh .msh (2.2
// and 4.1, text and binary) and TetGen's pair .node/.ele.

#include <filesystem>
#include <string>
#include <vector>

#include "polestar/mesh/tet_mesh.h"

namespace polestar {

struct TetMeshFile {
  TetMesh mesh;                    ///< mesh units, vertices and cells in the file's order
  std::string format;              ///< "vtk", "medit", "gmsh" or "tetgen"
  bool binary = false;             ///< numbers in the file are bytes
  std::vector<std::string> left;   ///< what the file holds and the mesh does not, one line each
  std::vector<std::string> notes;  ///< what is odd about the file, though it could be read
};

/// Whether the name's extension is one that readTetMesh knows: .vtk .mesh .msh .node .ele (and .meshb, whose
/// refusal says what to do).
bool isTetMeshName(const std::filesystem::path& path);

/// Reads a mesh of a solid; the name's extension says how. Cells keep their order and the file's labels and
/// data come along: Medit's references as cell and vertex data "medit:ref", gmsh's tags as "gmsh:physical"
/// and "gmsh:geometrical", TetGen's region attribute as "tetgen:ref".
///
/// A .vtk whose corners run from 1 to the number of vertices is read as TetGen 1.5 -gk means it: counted from
/// 1, against the format, with a note. Other linear cells than tetrahedra are kept; cells with curved edges
/// are refused, and so is a mesh without cells. Orientation is not judged here. Memory grows with the size of
/// the file, never with the counts it claims.
/// @throws Error{Errc::io} with file, line or byte, and reason: unreadable, truncated, of another kind, an
/// index out of range, a coordinate that is no finite number.
TetMeshFile readTetMesh(const std::filesystem::path& path);

}  // namespace polestar
