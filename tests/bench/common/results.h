#pragma once
// The raw figures: one JSON object a line, one line a row.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace polestar::bench {

using Json = nlohmann::ordered_json;

/// What made a figure: processor, threads, version, compiler, day of compilation. No names of hosts or
/// folders.
Json machineFacts();

/// The machines that `results` have as their member `machine`, as a list in Markdown.
std::string machineText(const std::vector<Json>& results);

class Results {
 public:
  /// Reads the file, if there is one. Rows are the same when their members `keys` are.
  /// @throws std::runtime_error when a line lacks one of them or is no JSON.
  Results(std::filesystem::path file, std::vector<std::string> keys);

  const std::vector<Json>& all() const { return results_; }
  /// The result whose keys are those of `like`; null where there is none.
  const Json* find(const Json& like) const;
  /// In the place of an earlier result of the same row, else at the end; the file is written anew.
  void put(Json result);

 private:
  bool same(const Json& a, const Json& b) const;

  std::filesystem::path file_;
  std::vector<std::string> keys_;
  std::vector<Json> results_;
};

}  // namespace polestar::bench
