#include "cli/command.h"

#include <algorithm>
#include <iostream>
#include <new>
#include <sstream>
#include <string_view>

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
    "5 not star-shaped, 6 the result fails its certificate, 130 cancelled.\n"
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
    withThreads(session.options().threads, [&] { command.run(session); });
    return session.finish();
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

/// The command line as one would type it again.
std::string commandLine(int argc, const char* const* argv) {
  std::string line = "polestar";
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool plain = !word.empty() && word.find_first_not_of(
                                            "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                                            "0123456789-_./,=:+%@") == std::string_view::npos;
    line += ' ';
    if (plain) {
      line += word;
      continue;
    }
    line += '\'';
    for (const char c : word) line += c == '\'' ? std::string("'\\''") : std::string(1, c);
    line += '\'';
  }
  return line;
}

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

/// Usage errors come before there is a session.
int reportUsage(const CLI::App& app, const CLI::ParseError& error, int argc, const char* const* argv) {
  const auto chosen = app.get_subcommands();
  std::string command = chosen.empty() ? "" : chosen.front()->get_name();
  std::string message = firstLine(error.what());
  if (command.empty() && argc > 1 && argv[1][0] != '-') {
    message = "there is no command " + std::string(argv[1]);
  }
  const bool json = std::find(argv, argv + argc, std::string_view("--json")) != argv + argc;
  message += "; see polestar " + (command.empty() ? "" : command + " ") + "--help";
  return reportFailure(command, json, failureFor(Errc::usage), message);
}

}  // namespace

int runCommandLine(const std::vector<std::unique_ptr<Command>>& commands, int argc, const char* const* argv) {
  CLI::App app("polestar: star-shaped solids as coordinates, by Green's functions", "polestar");
  app.set_version_flag("--version", std::string("polestar ") + kVersion);
  app.require_subcommand(1);
  app.formatter(std::make_shared<HelpFormatter>());
  app.get_formatter()->column_width(kHelpColumn);
  app.footer(kExitCodes);

  CommonOptions common;
  std::vector<CLI::App*> parsers;
  for (const auto& command : commands) {
    const auto description = command->description();
    CLI::App* parser = app.add_subcommand(description.name, description.summary);
    command->addOptions(*parser);
    addCommonOptions(*parser, common, description.output);
    parser->footer("Example:\n  " + description.example);
    parsers.push_back(parser);
  }

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    return reportUsage(app, error, argc, argv);
  }
  const auto chosen =
      std::find_if(parsers.begin(), parsers.end(), [](CLI::App* parser) { return parser->parsed(); });
  Command& command = *commands[static_cast<std::size_t>(chosen - parsers.begin())];
  Session session(command.description().name, commandLine(argc, argv), common);
  return runSession(command, session);
}

}  // namespace polestar::cli
