#pragma once
// Where results go. Everything that can be known before computing is checked before computing.

#include <filesystem>
#include <vector>

namespace polestar::cli {

/// "-" stands for standard output (or input).
bool isStandardStream(const std::filesystem::path& path);

/// Whether `path` could be written at the end: its folder exists and may be written, it is no folder itself,
/// and it does not exist yet, or may be replaced (`overwrite`) and is none of the inputs.
/// @throws Error{Errc::io}
void checkOutput(const std::filesystem::path& path, bool overwrite,
                 const std::vector<std::filesystem::path>& inputs);

/// Removes files that a failed or cancelled command made before it came to its end.
class OutputGuard {
 public:
  explicit OutputGuard(const std::vector<std::filesystem::path>& files);
  ~OutputGuard();
  OutputGuard(const OutputGuard&) = delete;
  OutputGuard& operator=(const OutputGuard&) = delete;

  /// The files are good: they stay.
  void keep() { kept_ = true; }

 private:
  struct Entry {
    std::filesystem::path path;
    std::filesystem::file_time_type before;  ///< of the file that stood there, else the clock's least value
  };
  std::vector<Entry> entries_;
  bool kept_ = false;
};

}  // namespace polestar::cli
