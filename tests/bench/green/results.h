#pragma once
// The raw figures: one JSON object a line, one line a row.

#include <filesystem>
#include <vector>

#include "row.h"

namespace polestar::bench {

/// What made a figure: processor, threads, version, compiler, day of compilation. No names of hosts or
/// folders.
Json machineFacts();

class Results {
 public:
  /// Reads the file, if there is one.
  /// @throws std::runtime_error when it is no such file.
  explicit Results(std::filesystem::path file);

  const std::vector<Json>& all() const { return results_; }
  const Json* find(const Row& row) const;
  /// In the place of an earlier result of the same row, else at the end; the file is written anew.
  void put(Json result);

 private:
  std::filesystem::path file_;
  std::vector<Json> results_;
};

}  // namespace polestar::bench
