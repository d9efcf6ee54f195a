#include "batch/job_file.h"

#include <glob.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

// Header-only in Debian; nothing else includes it.
#include <toml++/toml.h>

#include "cli/text.h"
#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"

namespace polestar::batch {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLongestName =
    200;  // a file's name has 255 bytes, and frame, suffix and ".part" follow

int lineOf(const toml::node& node) { return static_cast<int>(node.source().begin.line); }

bool isUtf8(const std::string& text) {
  try {
    nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

/// The file while it is read: for messages.
class Reader {
 public:
  explicit Reader(fs::path path) : path_(std::move(path)) {}

  JobFile read() {
    JobFile job;
    std::error_code error;
    const fs::path absolute = fs::absolute(path_, error);
    if (!fs::is_regular_file(absolute, error))
      throw Error(Errc::io, "cannot read " + path_.string() + ": there is no such file");
    job.folder = absolute.parent_path().lexically_normal();
    toml::table table;
    try {
      table = toml::parse_file(absolute.string());
    } catch (const toml::parse_error& failure) {
      // A file that cannot be opened comes without a place.
      if (failure.source().begin.line == 0)
        throw Error(Errc::io, "cannot read " + path_.string() + ": " + std::string(failure.description()));
      fail(static_cast<int>(failure.source().begin.line), std::string(failure.description()));
    }
    for (const auto& [key, node] : table) readMember(job, std::string(key.str()), node);
    finish(job);
    return job;
  }

 private:
  [[noreturn]] void fail(int line, const std::string& message) const {
    throw Error(Errc::usage, path_.string() + ":" + std::to_string(line) + ": " + message);
  }

  [[noreturn]] void failKey(const toml::node& node, const std::string& key, const std::string& where,
                            const std::string& known) const {
    fail(lineOf(node), "there is no key " + key + " " + where + "; there are " + known);
  }

  std::string text(const toml::node& node, const std::string& key) const {
    if (const auto* value = node.as_string()) return value->get();
    fail(lineOf(node), key + " wants text in quotes");
  }

  int count(const toml::node& node, const std::string& key, int least) const {
    const auto* value = node.as_integer();
    if (!value || value->get() < least || value->get() > 1000000)
      fail(lineOf(node), key + " wants a whole number from " + std::to_string(least) + " on");
    return static_cast<int>(value->get());
  }

  const toml::table& tableOf(const toml::node& node, const std::string& key) const {
    if (const auto* table = node.as_table()) return *table;
    fail(lineOf(node), key + " wants a table");
  }

  void readMember(JobFile& job, const std::string& key, const toml::node& node) {
    if (key == "output") {
      job.output = text(node, key);
      if (job.output.empty()) fail(lineOf(node), "output is empty; name a folder");
    } else if (key == "steps") {
      job.steps = readSteps(node);
    } else if (key == "frames") {
      job.frames = text(node, key);
      try {
        FrameRange::parse(*job.frames);
      } catch (const Error& error) {
        fail(lineOf(node), error.what());
      }
    } else if (key == "frames-per-task") {
      job.framesPerTask = count(node, key, 1);
    } else if (key == "format") {
      job.pictureFormat = text(node, key);
      if (job.pictureFormat != "png" && job.pictureFormat != "exr")
        fail(lineOf(node), "format is \"png\" or \"exr\"");
    } else if (key == "retries") {
      job.retries = count(node, key, 0);
    } else if (key == "textures") {
      for (const auto& [name, texture] : tableOf(node, key))
        job.textures.push_back(readTexture(std::string(name.str()), texture));
      inFileOrder(job.textures);
    } else if (key == "targets") {
      for (const auto& [name, target] : tableOf(node, key))
        job.targets.push_back(readTarget(std::string(name.str()), target));
      inFileOrder(job.targets);
    } else if (key == "meshes") {
      readMeshes(node);
    } else if (key == "override") {
      readOverrides(job, node);
    } else if (key == "slurm") {
      readSlurm(job.slurm, tableOf(node, key));
    } else if (const auto step = stepNamed(key)) {
      readOptions(job.defaults, *step, tableOf(node, key));
    } else {
      failKey(
          node, key, "at the top",
          "output, steps, frames, frames-per-task, format, retries, meshes, map, transfer, render, textures, "
          "targets, override, slurm");
    }
  }

  /// The parser sorts keys; people read results in the order in which they wrote.
  template <class Entry>
  static void inFileOrder(std::vector<Entry>& entries) {
    std::stable_sort(entries.begin(), entries.end(),
                     [](const Entry& a, const Entry& b) { return a.line < b.line; });
  }

  static std::optional<Step> stepNamed(std::string_view name) {
    for (const Step step : kSteps) {
      if (name == toString(step)) return step;
    }
    return std::nullopt;
  }

  std::vector<Step> readSteps(const toml::node& node) const {
    const auto* list = node.as_array();
    std::set<Step> steps;
    for (std::size_t i = 0; list && i < list->size(); ++i) {
      const auto step = stepNamed(text(*list->get(i), "steps"));
      if (!step) fail(lineOf(*list->get(i)), "steps are of \"map\", \"transfer\", \"render\"");
      steps.insert(*step);
    }
    if (steps.empty()) fail(lineOf(node), "steps wants a list such as [\"map\", \"transfer\"]");
    return {steps.begin(), steps.end()};
  }

  void checkName(const std::string& name, int line) const {
    const bool control = std::any_of(name.begin(), name.end(), [](char c) { return c >= 0 && c < ' '; });
    if (name.empty() || name[0] == '.' || control || name.find('/') != std::string::npos ||
        name.size() > kLongestName) {
      fail(line,
           "the name \"" + name +
               "\" becomes the name of files: it must not be empty, start with a dot, hold a slash or be "
               "longer than 200 bytes");
    }
    if (FramePath(name).numbered())
      fail(line, "the name \"" + name + "\" has a place for a frame's number in it; leave #, %d and $F out");
  }

  JobTexture readTexture(const std::string& name, const toml::node& node) const {
    JobTexture texture{.name = name, .texture = name, .source = {}, .options = {}, .line = lineOf(node)};
    checkName(name, texture.line);
    if (const auto* value = node.as_string()) {
      texture.texture = value->get();
      return texture;
    }
    for (const auto& [key, member] : tableOf(node, name)) {
      if (key == "texture") {
        texture.texture = text(member, "texture");
      } else if (key == "source") {
        texture.source = text(member, "source");
      } else {
        readStepTable(texture.options, std::string(key.str()), member, "of a texture", "texture, source");
      }
    }
    return texture;
  }

  JobTarget readTarget(const std::string& name, const toml::node& node) const {
    JobTarget target{.name = name, .path = {}, .options = {}, .line = lineOf(node)};
    checkName(name, target.line);
    if (const auto* value = node.as_string()) {
      target.path = value->get();
    } else {
      for (const auto& [key, member] : tableOf(node, name)) {
        if (key == "mesh") {
          target.path = text(member, "mesh");
        } else {
          readStepTable(target.options, std::string(key.str()), member, "of a target", "mesh");
        }
      }
    }
    if (target.path.empty()) fail(target.line, "the target " + name + " wants a mesh = \"FILE\"");
    return target;
  }

  void readStepTable(JobOptions& options, const std::string& key, const toml::node& node,
                     const std::string& where, const std::string& known) const {
    const auto step = stepNamed(key);
    if (!step) failKey(node, key, where, known + ", map, transfer, render");
    readOptions(options, *step, tableOf(node, key));
  }

  void readOptions(JobOptions& options, Step step, const toml::table& table) const {
    static const std::set<std::string_view> kOurs{"output", "threads", "json",    "overwrite", "quiet",
                                                  "help",   "verbose", "dry-run", "frames",    "shot"};
    for (const auto& [key, node] : table) {
      const std::string name(key.str());
      if (kOurs.contains(name))
        fail(lineOf(node), "the batch itself sets --" + name + " of polestar " + toString(step));
      if (name.size() < 2 || name[0] == '-')
        fail(lineOf(node), "options have their long names here, without dashes in front; found " + name);
      options.of(step)[name] = readOption(name, node);
    }
  }

  JobOption readOption(const std::string& name, const toml::node& node) const {
    JobOption option;
    option.line = lineOf(node);
    if (const auto* flag = node.as_boolean()) {
      if (flag->get()) option.words.push_back("--" + name);
      return option;
    }
    if (const auto* list = node.as_array()) {
      option.values = readList(name, *list);
    } else if (const auto* table = node.as_table()) {
      for (const auto& [key, value] : *table)
        option.values.push_back(std::string(key.str()) + "=" + scalar(name, value));
    } else {
      option.values.push_back(scalar(name, node));
    }
    for (const std::string& value : option.values) option.words.push_back("--" + name + "=" + value);
    return option;
  }

  /// Texts are one option each, numbers the parts of one: ["x", "-y"], [0, 90, 0].
  std::vector<std::string> readList(const std::string& name, const toml::array& list) const {
    std::vector<std::string> texts;
    std::string numbers;
    for (const toml::node& node : list) {
      if (node.is_string()) {
        texts.push_back(scalar(name, node));
      } else {
        numbers += (numbers.empty() ? "" : ",") + scalar(name, node);
      }
    }
    if (!texts.empty() && !numbers.empty()) fail(lineOf(list), name + " mixes texts and numbers");
    if (!numbers.empty()) texts.push_back(numbers);
    return texts;
  }

  std::string scalar(const std::string& name, const toml::node& node) const {
    if (const auto* value = node.as_string()) return value->get();
    if (const auto* value = node.as_integer()) return std::to_string(value->get());
    if (const auto* value = node.as_floating_point()) return cli::exactNumber(value->get());
    fail(lineOf(node), name + " wants a text, a number, true or false, or a list of texts or numbers");
  }

  void readMeshes(const toml::node& node) {
    std::vector<const toml::node*> patterns;
    if (const auto* list = node.as_array()) {
      for (const toml::node& entry : *list) patterns.push_back(&entry);
    } else {
      patterns.push_back(&node);
    }
    for (const toml::node* pattern : patterns)
      meshes_.emplace_back(text(*pattern, "meshes"), lineOf(*pattern));
  }

  /// Files that match a pattern become targets under their own names.
  void addMeshes(JobFile& job) const {
    for (const auto& [pattern, line] : meshes_) {
      const std::string whole = (job.folder / pattern).string();
      glob_t found{};
      const int failed = glob(whole.c_str(), 0, nullptr, &found);
      std::vector<fs::path> files(found.gl_pathv, found.gl_pathv + (failed ? 0 : found.gl_pathc));
      globfree(&found);
      if (files.empty()) fail(line, "no file matches " + pattern);
      for (const fs::path& file : files) {
        if (!isUtf8(file.string()))
          fail(line, "the name of " + file.string() + " is not UTF-8; rename the file");
        const fs::path shown = fs::path(pattern).is_absolute() ? file : file.lexically_relative(job.folder);
        job.targets.push_back(
            {.name = file.stem().string(), .path = shown.string(), .options = {}, .line = line});
        checkName(job.targets.back().name, line);
      }
    }
  }

  void readOverrides(JobFile& job, const toml::node& node) const {
    const auto* list = node.as_array();
    if (!list) fail(lineOf(node), "overrides are written [[override]]");
    for (const toml::node& entry : *list) {
      JobOverride rule;
      for (const auto& [key, member] : tableOf(entry, "override")) {
        if (key == "texture") {
          rule.texture = text(member, "texture");
        } else if (key == "target") {
          rule.target = text(member, "target");
        } else {
          readStepTable(rule.options, std::string(key.str()), member, "of an override", "texture, target");
        }
      }
      job.overrides.push_back(std::move(rule));
    }
  }

  void readSlurm(SlurmOptions& slurm, const toml::table& table) const {
    static const std::set<std::string_view> kOurs{"array",  "chdir",    "dependency",
                                                  "output", "parsable", "wait"};
    const auto put = [&](std::map<std::string, std::string>& options, const std::string& key,
                         const toml::node& node) {
      if (kOurs.contains(key)) fail(lineOf(node), "the batch itself sets --" + key + " of sbatch");
      const auto* flag = node.as_boolean();
      if (!flag) {
        options[key] = scalar(key, node);
      } else if (flag->get()) {
        options[key] = "";
      }
    };
    for (const auto& [key, node] : table) {
      if (const auto step = stepNamed(key.str())) {
        for (const auto& [name, value] : tableOf(node, std::string(key.str())))
          put(slurm.of[static_cast<std::size_t>(*step)], std::string(name.str()), value);
      } else {
        put(slurm.all, std::string(key.str()), node);
      }
    }
  }

  template <class Entry>
  void checkUnique(const std::vector<Entry>& entries, const std::string& what) const {
    std::map<std::string, int> lines;
    for (const Entry& entry : entries) {
      const auto [at, added] = lines.emplace(entry.name, entry.line);
      if (!added) {
        fail(entry.line, "there is a " + what + " " + entry.name + " already, of line " +
                             std::to_string(at->second) + "; give one of them a name of its own");
      }
    }
  }

  void finish(JobFile& job) const {
    addMeshes(job);
    if (job.targets.empty())
      fail(1, "there is no target; add [targets] with name = \"MESH\", or meshes = \"FOLDER/*.obj\"");
    checkUnique(job.targets, "target");
    if (job.textures.empty() && job.has(Step::transfer)) std::erase(job.steps, Step::transfer);
  }

  const fs::path path_;
  std::vector<std::pair<std::string, int>> meshes_;
};

}  // namespace

const char* toString(Step step) {
  switch (step) {
    case Step::map:
      return "map";
    case Step::transfer:
      return "transfer";
    case Step::render:
      return "render";
  }
  return "";
}

void JobOptions::overrideBy(const JobOptions& later) {
  for (const Step step : kSteps) {
    for (const auto& [name, option] : later.of(step)) of(step)[name] = option;
  }
}

bool JobFile::has(Step step) const { return std::find(steps.begin(), steps.end(), step) != steps.end(); }

JobFile readJobFile(const fs::path& path) { return Reader(path).read(); }

}  // namespace polestar::batch
