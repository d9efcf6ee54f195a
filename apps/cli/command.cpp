#include "cli/command.h"

#include <algorithm>
#include <iostream>
#include <new>
#include <sstream>
#include <string_view>

#include "cli/command_line.h"
#include "cli/interrupt.h"
#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/core/threads.h"
#include "polestar/core/version.h"

namespace polestar::cli {
namespace {

constexpr std::size_t kHelpColumn = 32, kHelpWidth = 100;

constexpr const char* kExitCodes =
    "Exit codes: 0 done, 2 usage, 3 a file cannot be read or written, 4 not a closed surface of genus 0,\n"
    "5 not star-shaped, 6 the result fails its certificate, 7 some tasks of a batch failed, 130 cancelled.\n"
    "`polestar COMMAND --help` says more and ends with an example.";

std::string wrapped(const std::string& text, std::size_t width) {
  std::istringstream words(text);
  std::string result;
  std::size_t column = 0;
  for (std::string word; words >> word; column += word.size()) {
    if (column > 0) {
      const bool fits = column + 1 + word.size() <= width;
      result += fits ? ' ' : '\n';
      column = fits ? column + 1 : 0;
    }
    result += word;
  }
  return result;
}

class HelpFormatter : public CLI::Formatter {
 public:
  std::string make_option_desc(const CLI::Option* option) const override {
    return wrapped(CLI::Formatter::make_option_desc(option), kHelpWidth - kHelpColumn);
  }
};

int runSession(Command& command, Session& session) {
  const InterruptGuard guard(session.context());
  try {
    if (command.description().ownThreads) {
      command.run(session);
    } else {
      withThreads(session.options().threads, [&] { command.run(session); });
    }
    return session.finish();
  } catch (const CommandFailure& failure) {
    return session.fail(failure.failure(), failure.what());
  } catch (const std::exception& exception) {
    // An interrupted read or write may come up as another error.
    if (session.context().cancelled()) {
      const std::size_t finished = session.json().contains("outputs") ? session.json()["outputs"].size() : 0;
      return session.fail(
          failureFor(Errc::cancelled),
          finished == 0 ? "cancelled; nothing was written"
                        : "cancelled; " + counted(finished, "finished file stays", "finished files stay"));
    }
    if (const auto* error = dynamic_cast<const Error*>(&exception)) {
      return session.fail(failureFor(error->code()), error->what());
    }
    if (dynamic_cast<const std::bad_alloc*>(&exception)) {
      return session.fail(kInternalError, "not enough memory; try a coarser grid or a smaller mesh");
    }
    return session.fail(kInternalError, std::string("internal error: ") + exception.what() +
                                            "; please report it together with the input");
  }
}

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

/// The commands as CLI11 knows them. Values go into the commands themselves.
class Parser {
 public:
  explicit Parser(const std::vector<std::unique_ptr<Command>>& commands) : commands_(commands) {
    app_.set_version_flag("--version", std::string("polestar ") + kVersion);
    app_.require_subcommand(1);
    app_.formatter(std::make_shared<HelpFormatter>());
    app_.get_formatter()->column_width(kHelpColumn);
    app_.footer(kExitCodes);
    for (const auto& command : commands) {
      const auto description = command->description();
      CLI::App* parser = app_.add_subcommand(description.name, description.summary);
      command->addOptions(*parser);
      addCommonOptions(*parser, common_, description.output);
      parser->footer("Example:\n  " + description.example);
      parsers_.push_back(parser);
    }
  }

  /// @throws CLI::ParseError, of which --help and --version are two.
  void parse(std::span<const std::string> words) {
    app_.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 wants the last word first
  }

  Command& command() const {
    const auto chosen =
        std::find_if(parsers_.begin(), parsers_.end(), [](CLI::App* parser) { return parser->parsed(); });
    return *commands_[static_cast<std::size_t>(chosen - parsers_.begin())];
  }
  const CommonOptions& common() const { return common_; }
  const CLI::App& app() const { return app_; }

 private:
  const std::vector<std::unique_ptr<Command>>& commands_;
  CLI::App app_{"polestar: star-shaped solids as coordinates, by Green's functions", "polestar"};
  CommonOptions common_;
  std::vector<CLI::App*> parsers_;
};

/// Usage errors come before there is a session.
int reportUsage(const CLI::App& app, const CLI::ParseError& error, std::span<const std::string> words) {
  const auto chosen = app.get_subcommands();
  std::string command = chosen.empty() ? "" : chosen.front()->get_name();
  std::string message = firstLine(error.what());
  if (command.empty() && !words.empty() && !words[0].starts_with('-'))
    message = "there is no command " + words[0];
  const bool json = std::find(words.begin(), words.end(), "--json") != words.end();
  message += "; see polestar " + (command.empty() ? "" : command + " ") + "--help";
  return reportFailure(command, json, failureFor(Errc::usage), message);
}

}  // namespace

int runCommandLine(const std::vector<std::unique_ptr<Command>>& commands,
                   std::span<const std::string> words) {
  Parser parser(commands);
  try {
    parser.parse(words);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return parser.app().exit(error);  // --help, --version
    return reportUsage(parser.app(), error, words);
  }
  Command& command = parser.command();
  Session session(command.description().name, commandLine(words), parser.common());
  return runSession(command, session);
}

std::optional<std::string> whyNoCommandLine(const std::vector<std::unique_ptr<Command>>& commands,
                                            std::span<const std::string> words) {
  Parser parser(commands);
  try {
    parser.parse(words);
    return std::nullopt;
  } catch (const CLI::ParseError& error) {
    return firstLine(error.what());
  }
}

}  // namespace polestar::cli
