#pragma once
// Runs the built polestar as a user would, with an argument vector and no shell in between.

#include <chrono>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "polestar/mesh/tri_mesh.h"

namespace polestar::testing {

struct ToolRun {
  int exitCode = -1;  ///< 128 + signal when a signal ended it
  bool hung = false;  ///< killed after the time limit
  std::string out, err;

  /// Standard output as one JSON object; reports a test failure when it is anything else.
  nlohmann::json json() const;
  /// Standard error without lines of progress, which a slow machine prints and a fast one does not.
  std::string messages() const;
};

struct ToolSettings {
  std::string input{};             ///< standard input
  std::filesystem::path folder{};  ///< to run in; empty: the test's own
  std::filesystem::path output{};  ///< standard output goes there instead of into ToolRun::out
  std::map<std::string, std::string> environment{};  ///< added to the test's own
  /// Keeps standard input open and sends SIGINT this long after the tool began to handle it.
  std::chrono::milliseconds interruptAfter{0};
  std::chrono::seconds limit{120};
};

ToolRun runTool(const std::vector<std::string>& arguments, const ToolSettings& settings = {});
/// Another program: its path, then its arguments.
ToolRun runProgram(std::vector<std::string> words, const ToolSettings& settings = {});

/// A folder of its own, removed with everything in it at the end.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }
  /// Names of everything inside, sorted, hidden files too.
  std::vector<std::string> names() const;
  /// Writes a file and returns its path.
  std::string file(const std::string& name, const std::string& content) const;
  std::string obj(const std::string& name, const TriMesh& mesh) const;

 private:
  std::filesystem::path path_;
};

std::string readFile(const std::filesystem::path& path);

}  // namespace polestar::testing
