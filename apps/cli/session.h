#pragma once
// One run of one subcommand: its context, its answer as text and as JSON, and how it ends.

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "cli/exit_codes.h"
#include "cli/options.h"
#include "cli/progress.h"
#include "polestar/core/context.h"

namespace polestar::cli {

using Json = nlohmann::ordered_json;  // members appear in the order in which the schema lists them

Json toJson(const Vec3& point);

class Session {
 public:
  /// `arguments`: the command line, for provenance.
  Session(std::string command, std::string arguments, CommonOptions options);
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  const CommonOptions& options() const { return options_; }
  /// The command line for provenance: commandLine().
  const std::string& arguments() const { return arguments_; }
  Context& context() { return context_; }

  /// Names a file that the command reads; appears under "inputs", and outputs are not written over it.
  void addInput(const std::filesystem::path& path);
  const std::vector<std::filesystem::path>& inputs() const { return inputs_; }

  /// The answer as members of the JSON object. Fill it before throwing a "no", so that it gets printed with
  /// the error.
  Json& json() { return json_; }
  /// The answer as people read it; not shown with --json.
  std::string& text() { return text_; }

  /// Runs `work` and notes its seconds under "timings".
  template <class Work>
  auto timed(const char* name, Work&& work) {
    const Timer timer{*this, name};
    return std::forward<Work>(work)();
  }

  /// Shows a line of progress that is more than one share of one stage.
  void showStatus(std::string_view line) { meter_.status(line); }

  /// Seconds that were measured elsewhere.
  void noteSeconds(const char* name, double seconds) { timings_[name] = seconds; }

  /// Lets the answer go to the file of -o. Commands whose output is another kind of file do not call this.
  /// @throws what checkOutput throws.
  void sendAnswerToOutput();
  /// Standard output carries a result of its own: the text goes to standard error.
  void keepStandardOutputFree() { textToStandardError_ = true; }

  /// Prints the answer and returns exit code 0.
  /// @throws Error{Errc::io} when it cannot be written.
  int finish();
  /// Prints what there is of the answer and the error, and returns the exit code.
  int fail(const Failure& failure, const std::string& message);

 private:
  struct Timer {
    Session& session;
    const char* name;
    std::chrono::steady_clock::time_point start = std::chrono::steady_clock::now();
    ~Timer() {
      session.noteSeconds(name,
                          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    }
  };

  std::string answer();

  const std::string command_, arguments_;
  const CommonOptions options_;
  std::vector<std::filesystem::path> inputs_;
  ProgressMeter meter_;
  Context context_;
  Json json_;
  Json timings_ = Json::object();
  std::string text_;
  std::filesystem::path answerFile_;
  bool textToStandardError_ = false;
};

/// Prints `message` as a failed command does, before or without a session: on standard error with "polestar
/// COMMAND: " in front, and with `json` as an object on standard output.
int reportFailure(const std::string& command, bool json, const Failure& failure, const std::string& message);

}  // namespace polestar::cli
