#pragma once
// Meshes of others, found through the environment variable POLESTAR_MESHES (a folder with MANIFEST.tsv).

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace polestar::testing {

/// The folder, or nothing when the variable is unset or empty.
std::optional<std::filesystem::path> meshFolder();

/// One line of MANIFEST.tsv.
struct ManifestEntry {
  std::filesystem::path path;
  std::string source;  ///< where it is from; copies of one body have the same
  std::string star;    ///< "yes", "no", "open", "n/a", "borderline", "misoriented", ...
  std::optional<double> marginRelative;
  bool closed = false;
  std::optional<int> genus;
  int components = 0;
  std::string note;
};
std::vector<ManifestEntry> manifest();

/// Names of models that a sweep goes over: the hardest ones, and the others too when the environment variable
/// POLESTAR_ALL_MODELS is set, as tests/run.sh --all does.
std::vector<std::string> chosenModels(std::vector<std::string> hardest,
                                      const std::vector<std::string>& others);

}  // namespace polestar::testing

/// Ends the test as skipped, visibly, when the folder is not there.
#define POLESTAR_REQUIRE_MESHES()                                                                   \
  if (!polestar::testing::meshFolder()) {                                                           \
    GTEST_SKIP() << "set POLESTAR_MESHES to a folder of meshes with MANIFEST.tsv to run this test"; \
  }                                                                                                 \
  static_assert(true, "")
