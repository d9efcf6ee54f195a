// polestar verify: runs polestar-verify, the program beside this one that judges maps with no code of ours.

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>

#include "cli/dry_run.h"
#include "commands.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

namespace fs = std::filesystem;

struct Answer {
  int status = 0;  ///< as waitpid tells it
  std::string out, err;
};

fs::path judge() {
  const fs::path path = fs::read_symlink("/proc/self/exe").parent_path() / "polestar-verify";
  if (access(path.c_str(), X_OK) != 0) {
    throw Error(
        Errc::io,
        path.string() + " is not there: build the target polestar_verify, or install it beside polestar");
  }
  return path;
}

/// Runs `words` with no shell in between and collects what it prints.
Answer collect(std::vector<std::string> words, Context& context) {
  std::array<std::array<int, 2>, 2> pipes{};
  for (auto& ends : pipes) {
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
      throw Error(Errc::io, "no pipe: " + std::generic_category().message(errno));
  }
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pipes[0][1], STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, pipes[1][1], STDERR_FILENO);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  pid_t child = 0;
  const int failed = posix_spawn(&child, arguments[0], &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  for (auto& ends : pipes) close(ends[1]);

  Answer answer;
  std::array<pollfd, 2> open{{{pipes[0][0], POLLIN, 0}, {pipes[1][0], POLLIN, 0}}};
  while (!failed && (open[0].fd >= 0 || open[1].fd >= 0)) {
    // Ctrl-C reaches the child, too, a farm's SIGTERM need not. Its end closes the pipes.
    if (context.cancelled()) kill(child, SIGTERM);
    if (poll(open.data(), open.size(), -1) < 0 && errno != EINTR) break;
    for (std::size_t i = 0; i < open.size(); ++i) {
      if (open[i].fd < 0 || open[i].revents == 0) continue;
      std::array<char, 4096> buffer;
      const ssize_t size = read(open[i].fd, buffer.data(), buffer.size());
      if (size > 0) (i == 0 ? answer.out : answer.err).append(buffer.data(), static_cast<std::size_t>(size));
      if (size == 0 || (size < 0 && errno != EINTR)) open[i].fd = -1;
    }
  }
  for (auto& ends : pipes) close(ends[0]);
  if (failed)
    throw Error(Errc::io, "cannot start " + words[0] + ": " + std::generic_category().message(failed));
  while (waitpid(child, &answer.status, 0) < 0 && errno == EINTR) {
  }
  context.throwIfCancelled();
  return answer;
}

/// Its members take their places among ours; the error is told once, by us.
void merge(const std::string& text, Session& session) {
  const Json answer = Json::parse(text, nullptr, false);
  if (!answer.is_object()) throw std::runtime_error("polestar-verify gave no JSON");
  for (const auto& [name, value] : answer.items()) {
    if (name == "timings") {
      for (const auto& [stage, seconds] : value.items()) session.noteSeconds(stage.c_str(), seconds);
    } else if (name != "error" && !session.json().contains(name)) {
      session.json()[name] = value;
    }
  }
}

class VerifyCommand final : public Command {
 public:
  Description description() const override {
    return {"verify", "Judges a .pmap or .vdb by a program that shares no code with this one",
            "Write the answer to FILE instead of standard output", "polestar verify asteroid.pmap"};
  }

  void addOptions(CLI::App& app) override {
    app.add_option("FILE", file_, "A .pmap (decided by exact arithmetic) or a .vdb (judged on its voxels)")
        ->required()
        ->type_name("");
  }

  void run(Session& session) override {
    session.addInput(file_);
    session.sendAnswerToOutput();
    if (session.options().dryRun) return describePlan(session);
    std::vector<std::string> words{judge().string(), "--threads", std::to_string(session.options().threads)};
    if (session.options().json) words.emplace_back("--json");
    words.insert(words.end(), {"--", file_.string()});
    const Answer answer = collect(words, session.context());
    if (!WIFEXITED(answer.status)) {
      throw Error(Errc::io, "polestar-verify broke off on " + file_.string() + " (signal " +
                                std::to_string(WTERMSIG(answer.status)) + "): the file is probably damaged");
    }
    if (session.options().json) {
      merge(answer.out, session);
    } else {
      session.text() = answer.out;
    }
    finish(WEXITSTATUS(answer.status), answer.err);
  }

 private:
  /// @throws Error for everything but "it holds"
  static void finish(int exitCode, std::string message) {
    constexpr std::string_view kPrefix = "polestar-verify: ";
    if (message.starts_with(kPrefix)) message.erase(0, kPrefix.size());
    while (message.ends_with('\n')) message.pop_back();
    switch (exitCode) {
      case 0:
        return;
      case 2:
        throw Error(Errc::usage, message);
      case 3:
        throw Error(Errc::io, message);
      case 6:
        throw Error(Errc::notConverged, message);
      default:
        throw std::runtime_error(message);
    }
  }

  fs::path file_;
};

}  // namespace

std::unique_ptr<Command> makeVerifyCommand() { return std::make_unique<VerifyCommand>(); }

}  // namespace polestar::cli
