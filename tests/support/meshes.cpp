#include "support/meshes.h"

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace polestar::testing {

std::optional<std::filesystem::path> meshFolder() {
  const char* folder = std::getenv("POLESTAR_MESHES");
  if (!folder || !*folder) return std::nullopt;
  return std::filesystem::path(folder);
}

std::vector<std::string> chosenModels(std::vector<std::string> hardest,
                                      const std::vector<std::string>& others) {
  if (std::getenv("POLESTAR_ALL_MODELS")) hardest.insert(hardest.end(), others.begin(), others.end());
  return hardest;
}

std::vector<ManifestEntry> manifest() {
  std::vector<ManifestEntry> entries;
  const auto folder = meshFolder();
  if (!folder) return entries;
  std::ifstream in(*folder / "MANIFEST.tsv");
  std::string line;
  std::getline(in, line);  // header
  while (std::getline(in, line)) {
    std::vector<std::string> cells;
    std::stringstream stream(line);
    for (std::string cell; std::getline(stream, cell, '\t');) cells.push_back(cell);
    if (cells.size() < 13) continue;
    ManifestEntry entry;
    entry.path = *folder / cells[0];
    entry.source = cells[1];
    entry.star = cells[5];
    if (cells[6] != "-") entry.marginRelative = std::stod(cells[6]);
    entry.closed = cells[7] == "True";
    if (cells[8] != "None" && cells[8] != "-") entry.genus = std::stoi(cells[8]);
    entry.components = cells[9] == "-" ? 0 : std::stoi(cells[9]);
    entry.note = cells.back();
    entries.push_back(entry);
  }
  return entries;
}

}  // namespace polestar::testing
