#include "cli/conversion_end.h"

#include <cctype>

#include "cli/outputs.h"
#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"
#include "polestar/io/slice_stack.h"
#include "polestar/mesh/write_mesh.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;
using Kind = ConversionEnd::Kind;

std::string lowerCase(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string extensionOf(const fs::path& path, const std::string& declared) {
  if (!declared.empty()) return "." + lowerCase(declared);
  return isStandardStream(path) ? ".vdb" : lowerCase(path.extension().string());
}

}  // namespace

const char* nameOf(Kind kind) {
  switch (kind) {
    case Kind::mesh:
      return "a mesh";
    case Kind::grids:
      return "grids";
    case Kind::slices:
      return "slices";
    case Kind::usd:
      break;
  }
  return "a .usda";
}

ConversionEnd conversionInput(const fs::path& path, const std::string& declared) {
  ConversionEnd end{path, extensionOf(path, declared), Kind::grids};
  if (end.extension == ".vdb") return end;
  end.kind = Kind::mesh;
  if (isMeshOutputName("x" + end.extension)) return end;
  end.kind = Kind::slices;
  if (declared.empty() && FramePath(path).numbered()) return end;
  throw Error(Errc::usage, "what is in " + path.string() +
                               "? It should end in .obj .ply .stl .off (a mesh) or .vdb (grids), or be named "
                               "slice.####.png (slices); --from says so where a name cannot");
}

ConversionEnd conversionOutput(const fs::path& path, const std::string& declared) {
  ConversionEnd end{path, extensionOf(path, declared), Kind::grids};
  if (end.extension == ".vdb") return end;
  end.kind = Kind::mesh;
  if (isMeshOutputName("x" + end.extension)) return end;
  end.kind = Kind::usd;
  if (end.extension == ".usda") return end;
  end.kind = Kind::slices;
  if (isSliceOutputName("x" + end.extension)) {
    if (FramePath(path).numbered()) return end;
    throw Error(Errc::usage, "slices are many files: " + path.string() +
                                 " needs a place for their numbers, " + path.stem().string() + ".####" +
                                 end.extension);
  }
  throw Error(Errc::usage,
              "what shall " + path.string() +
                  " be? It should end in .obj .ply .stl .off (a mesh), .vdb (grids), .usda, or be "
                  "named slice.####.png .tif .exr (slices); --to says so where a name cannot");
}

}  // namespace polestar::cli
