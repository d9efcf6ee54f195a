#pragma once
// What a subcommand is, and the road that all of them take from the command line to an exit code.

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <span>

#include "cli/session.h"

namespace polestar::cli {

class Command {
 public:
  struct Description {
    std::string name;
    std::string summary;      ///< one line, for the list of commands
    std::string output;       ///< what -o means here
    std::string example;      ///< ends the help
    bool ownThreads = false;  ///< it deals out -j itself: nothing may start threads before
  };

  virtual ~Command() = default;
  virtual Description description() const = 0;
  /// Adds options beyond the common ones. They are stored in the command itself.
  virtual void addOptions(CLI::App& app) = 0;
  /// Does the work and fills the session's answer. @throws Error for everything that is not success.
  virtual void run(Session& session) = 0;
};

/// Parses the command line, runs the command that it names and returns the exit code.
/// @p words: without the program's name.
int runCommandLine(const std::vector<std::unique_ptr<Command>>& commands, std::span<const std::string> words);

/// Why `words` are no command line that could be run; nothing when they are. Reads no files.
std::optional<std::string> whyNoCommandLine(const std::vector<std::unique_ptr<Command>>& commands,
                                            std::span<const std::string> words);

}  // namespace polestar::cli
