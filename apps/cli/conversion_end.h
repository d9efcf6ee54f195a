#pragma once
// What stands at either end of `convert`: told by its name, or by --from and --to.

#include <filesystem>
#include <string>

namespace polestar::cli {

struct ConversionEnd {
  enum class Kind { mesh, grids, slices, usd };

  std::filesystem::path path;
  std::string extension;  ///< ".obj", lower case; of the format, also where the path has none
  Kind kind;
};

/// "a mesh", "grids" ...
const char* nameOf(ConversionEnd::Kind kind);

/// `declared` is a format such as "obj", or empty. @throws Error{Errc::usage} when neither it nor the name
/// tells what is there.
ConversionEnd conversionInput(const std::filesystem::path& path, const std::string& declared);
ConversionEnd conversionOutput(const std::filesystem::path& path, const std::string& declared);

}  // namespace polestar::cli
