#include "cli/session.h"

#include <cstdio>
#include <fstream>
#include <iostream>
#include <string_view>

#include "cli/outputs.h"
#include "cli/text.h"
#include "polestar/core/atomic_file.h"
#include "polestar/core/error.h"
#include "polestar/core/version.h"

namespace polestar::cli {
namespace {

std::string prefixFor(const std::string& command) {
  return command.empty() ? "polestar: " : "polestar " + command + ": ";
}

/// One line. File names need not be UTF-8, JSON must be.
std::string dumped(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void writeStandardOutput(std::string_view text) {
  const bool written =
      std::fwrite(text.data(), 1, text.size(), stdout) == text.size() && std::fflush(stdout) == 0;
  if (!written)
    throw Error(Errc::io, "cannot write to standard output; is the disk full or the pipe closed?");
}

/// The members that every object of schema "polestar/1" starts with.
Json envelope(const std::string& command, int threads) {
  return {{"schema", "polestar/1"},  {"version", kVersion}, {"command", command},
          {"inputs", Json::array()}, {"threads", threads},  {"units", "mesh"}};
}

void addError(Json& json, const Failure& failure, const std::string& message) {
  json["error"] = {{"code", failure.name}, {"message", message}};
}

ProgressMeter::Style progressStyle(const CommonOptions& options) {
  return options.quiet ? ProgressMeter::Style::none : ProgressMeter::styleForStandardError();
}

LogLevel leastShown(const CommonOptions& options) {
  if (options.verbosity >= 2) return LogLevel::debug;
  return options.verbosity == 1 ? LogLevel::info : LogLevel::warning;
}

}  // namespace

Json toJson(const Vec3& point) { return {point.x(), point.y(), point.z()}; }

Session::Session(std::string command, std::string arguments, CommonOptions options)
    : command_(std::move(command)),
      arguments_(std::move(arguments)),
      options_(std::move(options)),
      meter_(std::cerr, progressStyle(options_), prefixFor(command_)),
      json_(envelope(command_, options_.threads)) {
  context_.onProgress = [this](std::string_view stage, double fraction) { meter_.update(stage, fraction); };
  context_.onLog = [this](LogLevel level, std::string_view message) {
    if (options_.quiet || level < leastShown(options_)) return;
    meter_.message(level == LogLevel::warning ? "warning: " + std::string(message) : std::string(message));
  };
}

void Session::addInput(const std::filesystem::path& path) {
  inputs_.push_back(path);
  json_["inputs"].push_back(path.string());
}

void Session::sendAnswerToOutput() {
  if (options_.output.empty() || isStandardStream(options_.output)) return;
  checkOutput(options_.output, options_.overwrite, inputs_);
  answerFile_ = options_.output;
}

std::string Session::answer() {
  if (!options_.json) return text_;
  if (!timings_.empty()) json_["timings"] = timings_;
  return dumped(json_);
}

int Session::finish() {
  meter_.clear();
  if (textToStandardError_) {
    if (!options_.quiet) std::cerr << text_;
  } else if (answerFile_.empty()) {
    writeStandardOutput(answer());
  } else {
    writeAtomically(answerFile_, [&](const std::filesystem::path& temporary) {
      std::ofstream out(temporary, std::ios::binary);
      out << answer() << std::flush;
      if (!out) throw Error(Errc::io, "cannot write " + answerFile_.string() + "; is the disk full?");
    });
  }
  return 0;
}

int Session::fail(const Failure& failure, const std::string& message) {
  meter_.clear();
  if (options_.json) addError(json_, failure, message);
  try {
    if (!textToStandardError_) writeStandardOutput(answer());
  } catch (const Error&) {
    // The failure below says more than a second one would.
  }
  std::cerr << prefixFor(command_) << message << std::endl;
  return failure.exitCode;
}

int reportFailure(const std::string& command, bool json, const Failure& failure, const std::string& message) {
  if (json) {
    Json object = envelope(command, defaultThreads());
    addError(object, failure, message);
    std::cout << dumped(object);
  }
  std::cerr << prefixFor(command) << message << std::endl;
  return failure.exitCode;
}

}  // namespace polestar::cli
