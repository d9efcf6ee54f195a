#include "run_tool.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <thread>

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> result;
  for (std::string& text : strings) result.push_back(text.data());
  result.push_back(nullptr);
  return result;
}

std::vector<std::string> environmentWith(const std::map<std::string, std::string>& added) {
  std::vector<std::string> result;
  for (char** entry = environ; *entry; ++entry) {
    const std::string text = *entry;
    if (!added.contains(text.substr(0, text.find('=')))) result.push_back(text);
  }
  for (const auto& [name, value] : added) result.push_back(name + "=" + value);
  return result;
}

/// Whether the process has a handler for SIGINT; before that, while libraries are loading, the signal just
/// ends it.
bool handlesInterrupts(pid_t process) {
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("SigCgt:")) continue;
    return (std::stoull(line.substr(7), nullptr, 16) >> (SIGINT - 1)) & 1;
  }
  return false;
}

/// The exit code, or 128 + the signal.
int waitFor(pid_t child, const ToolSettings& settings, bool& hung) {
  const auto start = Clock::now();
  auto ready = Clock::time_point::max();
  bool interrupted = settings.interruptAfter.count() == 0;
  int status = 0;
  while (waitpid(child, &status, WNOHANG) == 0) {
    const auto elapsed = Clock::now() - start;
    if (!interrupted && ready == Clock::time_point::max() && handlesInterrupts(child)) ready = Clock::now();
    if (!interrupted && Clock::now() > ready && Clock::now() - ready > settings.interruptAfter) {
      kill(child, SIGINT);
      interrupted = true;
    }
    if (!hung && elapsed > settings.limit) {
      kill(child, SIGKILL);
      hung = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

std::string ToolRun::messages() const {
  static const std::regex progress("polestar [a-z]+: [^\n]*: [0-9.]+ %(, [^\n]*)?\n");
  return std::regex_replace(err, progress, "");
}

nlohmann::json ToolRun::json() const {
  try {
    return nlohmann::json::parse(out);
  } catch (const nlohmann::json::exception& error) {
    ADD_FAILURE() << "no JSON object on standard output: " << error.what() << "\n" << out << err;
    return nlohmann::json::object();
  }
}

ToolRun runTool(const std::vector<std::string>& arguments, const ToolSettings& settings) {
  std::vector<std::string> words{POLESTAR_TOOL};
  words.insert(words.end(), arguments.begin(), arguments.end());
  return runProgram(words, settings);
}

ToolRun runProgram(std::vector<std::string> words, const ToolSettings& settings) {
  const ScratchFolder streams;
  const std::string in = streams.file("in", settings.input);
  const std::string out = settings.output.empty() ? streams / "out" : settings.output.string();
  const std::string err = streams / "err";

  std::vector<std::string> environment = environmentWith(settings.environment);

  // A pipe that nobody writes to: what a person who does not type looks like.
  int silent[2] = {-1, -1};
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (settings.interruptAfter.count() > 0) {
    if (pipe2(silent, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
    posix_spawn_file_actions_adddup2(&actions, silent[0], STDIN_FILENO);
  } else {
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, in.c_str(), O_RDONLY, 0);
  }
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), O_WRONLY | O_CREAT, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), O_WRONLY | O_CREAT, 0600);
  if (!settings.folder.empty()) posix_spawn_file_actions_addchdir_np(&actions, settings.folder.c_str());

  pid_t child = 0;
  const int failed = posix_spawn(&child, words[0].c_str(), &actions, nullptr, pointers(words).data(),
                                 pointers(environment).data());
  posix_spawn_file_actions_destroy(&actions);
  if (failed) throw std::runtime_error("cannot start " + words[0]);

  ToolRun run;
  run.exitCode = waitFor(child, settings, run.hung);
  for (const int end : silent) {
    if (end >= 0) close(end);
  }
  run.err = readFile(err);
  if (settings.output.empty()) run.out = readFile(out);
  return run;
}

ScratchFolder::ScratchFolder() {
  std::string name = (fs::temp_directory_path() / "polestar-test-XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("cannot make " + name);
  path_ = name;
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::vector<std::string> ScratchFolder::names() const {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(path_)) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::string ScratchFolder::file(const std::string& name, const std::string& content) const {
  std::ofstream(path_ / name, std::ios::binary) << content;
  return (path_ / name).string();
}

std::string ScratchFolder::obj(const std::string& name, const TriMesh& mesh) const {
  std::ostringstream text;
  text.precision(17);
  for (const Vec3& v : mesh.vertices) text << "v " << v.x() << ' ' << v.y() << ' ' << v.z() << '\n';
  for (const Triangle& t : mesh.triangles)
    text << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
  return file(name, text.str());
}

std::string readFile(const fs::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

}  // namespace polestar::testing
