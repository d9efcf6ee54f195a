#include "batch/plan.h"

#include <fnmatch.h>

#include <algorithm>
#include <fstream>

#include "polestar/core/error.h"
#include "polestar/io/frame_path.h"

namespace polestar::batch {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSchema = "polestar-plan/1";

/// Options whose values are files that the step reads.
constexpr std::array kFileOptions{"source", "landmarks", "surface-map", "polycube"};

bool matches(const std::string& pattern, const std::string& name) {
  return fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
}

/// A file's name that starts with a dash is no option.
std::string asArgument(const fs::path& path) {
  const std::string text = path.string();
  return text.starts_with('-') ? "./" + text : text;
}

/// "3-9x2" from the frames 3, 5, 7, 9.
std::string rangeText(std::span<const int> frames) {
  std::string text = std::to_string(frames.front());
  if (frames.size() == 1) return text;
  text += "-" + std::to_string(frames.back());
  const int stride = frames[1] - frames[0];
  return stride == 1 ? text : text + "x" + std::to_string(stride);
}

class Planner {
 public:
  explicit Planner(const JobFile& job) : job_(job) {
    plan_.folder = job.folder;
    plan_.output = job.output;
    plan_.retries = job.retries;
    if (job.frames) frames_ = FrameRange::parse(*job.frames).frames();
  }

  Plan plan() {
    for (const JobTexture& texture : job_.textures) planSource(texture);
    for (const JobTarget& target : job_.targets) planMaps(target);
    if (job_.has(Step::transfer)) forAllPairs([&](const Pair& pair) { planTransfers(pair); });
    if (job_.has(Step::render)) {
      if (job_.textures.empty()) {
        for (const JobTarget& target : job_.targets) planRenders({nullptr, &target});
      } else {
        forAllPairs([&](const Pair& pair) { planRenders(pair); });
      }
    }
    return std::move(plan_);
  }

 private:
  struct Pair {
    const JobTexture* texture;  ///< null: the map itself is drawn
    const JobTarget* target;
    std::string name() const { return texture ? texture->name + "/" + target->name : target->name; }
  };

  /// What is made of one thing: a file or a numbered sequence, and the tasks that make it.
  struct Made {
    fs::path pattern;
    std::vector<std::size_t> tasks;  ///< one, or one a frame; none: it was there before
  };

  /// A .pmap, or the .vdb that lies beside one.
  bool isMap(const fs::path& path) const {
    std::error_code ignored;
    return path.extension() == ".pmap" ||
           (path.extension() == ".vdb" &&
            fs::exists(job_.folder / fs::path(path).replace_extension(".pmap"), ignored));
  }

  template <class Visit>
  void forAllPairs(Visit&& visit) {
    for (const JobTexture& texture : job_.textures) {
      for (const JobTarget& target : job_.targets) visit(Pair{&texture, &target});
    }
  }

  bool numbered(const JobTarget& target) const {
    if (!FramePath(target.path).numbered()) return false;
    if (!job_.frames) {
      throw Error(Errc::usage, "the target " + target.name + " is a sequence, " + target.path +
                                   "; say which frames with frames = \"1-48\"");
    }
    return true;
  }

  /// The file name of results, with a place for the frame where there are several.
  std::string fileName(const JobTarget& target, bool frames, const std::string& suffix) const {
    return target.name + (frames ? "_####" : "") + suffix;
  }

  /// Later ones take the place of earlier ones: of the file, the texture, the target, of overrides.
  JobOptions optionsOf(const Pair& pair) const {
    JobOptions options = job_.defaults;
    if (pair.texture) options.overrideBy(pair.texture->options);
    options.overrideBy(pair.target->options);
    for (const JobOverride& rule : job_.overrides) {
      // A map belongs to all textures: only what names none of them is for it.
      if (matches(rule.target, pair.target->name) &&
          (pair.texture ? matches(rule.texture, pair.texture->name) : rule.texture == "*"))
        options.overrideBy(rule.options);
    }
    return options;
  }

  static void addOptions(Task& task, const JobOptions& options) {
    for (const auto& [name, option] : options.of(task.step)) {
      task.arguments.insert(task.arguments.end(), option.words.begin(), option.words.end());
      if (std::find(kFileOptions.begin(), kFileOptions.end(), name) != kFileOptions.end())
        task.inputs.insert(task.inputs.end(), option.values.begin(), option.values.end());
    }
  }

  std::size_t add(Task task) {
    task.log = plan_.output / "logs" / toString(task.step) / (task.name + ".log");
    plan_.tasks.push_back(std::move(task));
    return plan_.tasks.size() - 1;
  }

  std::size_t addMap(const std::string& name, const fs::path& mesh, const fs::path& grids,
                     const JobOptions& options) {
    Task task{.step = Step::map,
              .name = name,
              .arguments = {"map", asArgument(mesh), "-o", asArgument(grids)},
              .inputs = {mesh},
              .outputs = {grids, fs::path(grids).replace_extension(".pmap")},
              .after = {},
              .log = {}};
    addOptions(task, options);
    return add(std::move(task));
  }

  /// The solid that a file's texture fills.
  void planSource(const JobTexture& texture) {
    if (texture.source.empty()) return;
    if (isMap(texture.source) || !job_.has(Step::transfer)) {
      sources_[texture.name] = {texture.source, {}};
      return;
    }
    JobOptions options = job_.defaults;
    options.overrideBy(texture.options);
    // A folder of its own: a target may have the same name.
    const fs::path grids = plan_.output / "maps" / "sources" / (texture.name + ".vdb");
    const std::size_t task = addMap("sources/" + texture.name, texture.source, grids, options);
    sources_[texture.name] = {fs::path(grids).replace_extension(".pmap"), {task}};
  }

  void planMaps(const JobTarget& target) {
    const bool sequence = numbered(target);
    if (!job_.has(Step::map) || isMap(target.path)) {
      if (!isMap(target.path)) {
        throw Error(Errc::usage, "the target " + target.name + ", " + target.path +
                                     ", is no map: add \"map\" to steps, or name a .pmap");
      }
      maps_[target.name] = {target.path, {}};
      return;
    }
    const JobOptions options = optionsOf({nullptr, &target});
    Made made{plan_.output / "maps" / fileName(target, sequence, ".vdb"), {}};
    if (!sequence) {
      made.tasks.push_back(addMap(target.name, target.path, made.pattern, options));
    } else {
      for (const int frame : frames_) {
        made.tasks.push_back(addMap(target.name + " " + std::to_string(frame),
                                    FramePath(target.path).at(frame), FramePath(made.pattern).at(frame),
                                    options));
      }
    }
    maps_[target.name] = std::move(made);
  }

  static std::size_t makerOf(const Made& made, std::size_t frame) {
    return made.tasks[made.tasks.size() == 1 ? 0 : frame];
  }

  void planTransfers(const Pair& pair) {
    const Made& map = maps_.at(pair.target->name);
    const bool sequence = FramePath(map.pattern).numbered();
    Made made{plan_.output / "solids" / pair.texture->name / fileName(*pair.target, sequence, ".vdb"), {}};
    const JobOptions options = optionsOf(pair);
    for (std::size_t i = 0; i < (sequence ? frames_.size() : 1); ++i) {
      const auto at = [&](const fs::path& pattern) {
        return sequence ? FramePath(pattern).at(frames_[i]) : pattern;
      };
      Task task{.step = Step::transfer,
                .name = pair.name() + (sequence ? " " + std::to_string(frames_[i]) : ""),
                .arguments = {},
                .inputs = {},
                .outputs = {at(made.pattern)},
                .after = {},
                .log = {}};
      addTransfer(task, pair, at(map.pattern), options);
      if (!map.tasks.empty()) task.after.push_back(makerOf(map, i));
      made.tasks.push_back(add(std::move(task)));
    }
    solids_[pair.name()] = std::move(made);
  }

  void addTransfer(Task& task, const Pair& pair, const fs::path& map, const JobOptions& options) {
    const auto& own = options.of(Step::transfer);
    // The voxels of the map's grids are those of the solid unless others are asked for.
    const bool sized = own.contains("dim") || own.contains("voxel");
    const fs::path target = sized ? fs::path(map).replace_extension(".pmap") : map;
    const std::string& texture = pair.texture->texture;
    task.arguments = {"transfer", asArgument(texture), asArgument(target), "-o", asArgument(task.outputs[0])};
    task.inputs = {target};
    if (isFile(texture)) task.inputs.push_back(texture);
    if (const auto source = sources_.find(pair.texture->name); source != sources_.end()) {
      task.arguments.push_back("--source=" + source->second.pattern.string());
      task.inputs.push_back(source->second.pattern);
      task.after = source->second.tasks;
    }
    addOptions(task, options);
  }

  static bool isFile(const std::string& texture) {
    return FramePath(texture).numbered() || fs::path(texture).has_extension();
  }

  void planRenders(const Pair& pair) {
    const Made& input =
        pair.texture && job_.has(Step::transfer) ? solids_.at(pair.name()) : maps_.at(pair.target->name);
    const bool shot = job_.frames.has_value();
    const fs::path folder = plan_.output / "pictures" / (pair.texture ? pair.texture->name : "");
    const fs::path picture = folder / fileName(*pair.target, shot, "." + job_.pictureFormat);
    const JobOptions options = optionsOf(pair);
    const auto size = static_cast<std::size_t>(shot ? job_.framesPerTask : 1);
    const std::size_t count = shot ? frames_.size() : 1;
    for (std::size_t begin = 0; begin < count; begin += size) {
      const std::size_t end = std::min(begin + size, count);
      Task task{.step = Step::render,
                .name = pair.name(),
                .arguments = {"render", asArgument(input.pattern), "-o", asArgument(picture)},
                .inputs = {input.pattern},
                .outputs = {},
                .after = input.tasks,
                .log = {}};
      if (shot) {
        const std::string range = rangeText(std::span(frames_).subspan(begin, end - begin));
        task.name += " " + range;
        task.arguments.insert(task.arguments.end(), {"--frames=" + range, "--shot=" + *job_.frames});
        for (std::size_t i = begin; i < end; ++i) task.outputs.push_back(FramePath(picture).at(frames_[i]));
      } else {
        task.outputs.push_back(picture);
      }
      addLook(task, pair);
      addOptions(task, options);
      const fs::path first = task.outputs.front();
      const std::size_t index = add(std::move(task));
      if (begin == 0)
        plan_.pictures.push_back({pair.texture ? pair.texture->name : "", pair.target->name, first, index});
    }
  }

  void addLook(Task& task, const Pair& pair) const {
    if (!pair.texture || job_.has(Step::transfer)) return;
    if (isFile(pair.texture->texture)) {
      throw Error(Errc::usage, "the texture " + pair.texture->name + " is a file, " + pair.texture->texture +
                                   ": it is drawn by way of a transfer; add \"transfer\" to steps");
    }
    task.arguments.push_back("--texture=" + pair.texture->texture);
  }

  const JobFile& job_;
  std::vector<int> frames_;
  Plan plan_;
  std::map<std::string, Made> sources_, maps_, solids_;
};

std::vector<std::string> strings(const std::vector<fs::path>& paths) {
  std::vector<std::string> result;
  for (const fs::path& path : paths) result.push_back(path.string());
  return result;
}

std::vector<fs::path> paths(const Json& json) {
  std::vector<fs::path> result;
  for (const Json& path : json) result.emplace_back(path.get<std::string>());
  return result;
}

Task taskFrom(const Json& json, std::size_t index) {
  Task task;
  const auto step = json.at("step").get<std::string>();
  const auto found =
      std::find_if(kSteps.begin(), kSteps.end(), [&](Step candidate) { return step == toString(candidate); });
  if (found == kSteps.end()) throw std::runtime_error("there is no step " + step);
  task.step = *found;
  task.name = json.at("name").get<std::string>();
  task.arguments = json.at("arguments").get<std::vector<std::string>>();
  task.inputs = paths(json.at("inputs"));
  task.outputs = paths(json.at("outputs"));
  task.after = json.at("after").get<std::vector<std::size_t>>();
  task.log = json.at("log").get<std::string>();
  if (std::any_of(task.after.begin(), task.after.end(), [&](std::size_t other) { return other >= index; }))
    throw std::runtime_error("task " + std::to_string(index) + " comes before what it needs");
  return task;
}

}  // namespace

fs::path Task::result() const {
  fs::path path = log;
  return path.replace_extension(".json");
}

std::vector<std::size_t> Plan::ends() const {
  std::vector<bool> needed(tasks.size(), false);
  for (const Task& task : tasks) {
    for (const std::size_t other : task.after) needed[other] = true;
  }
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    if (!needed[i]) result.push_back(i);
  }
  return result;
}

std::vector<std::size_t> Plan::withNeeds(const std::vector<std::size_t>& chosen) const {
  std::vector<bool> wanted(tasks.size(), false);
  for (const std::size_t i : chosen) wanted[i] = true;
  std::vector<std::size_t> result;
  for (std::size_t i = tasks.size(); i-- > 0;) {
    if (!wanted[i]) continue;
    result.push_back(i);
    for (const std::size_t other : tasks[i].after) wanted[other] = true;
  }
  std::reverse(result.begin(), result.end());
  return result;
}

Plan makePlan(const JobFile& job) { return Planner(job).plan(); }

Json toJson(const Plan& plan) {
  Json tasks = Json::array();
  for (const Task& task : plan.tasks) {
    tasks.push_back({{"step", toString(task.step)},
                     {"name", task.name},
                     {"arguments", task.arguments},
                     {"inputs", strings(task.inputs)},
                     {"outputs", strings(task.outputs)},
                     {"after", task.after},
                     {"log", task.log.string()}});
  }
  Json pictures = Json::array();
  for (const PlannedPicture& picture : plan.pictures) {
    pictures.push_back({{"texture", picture.texture},
                        {"target", picture.target},
                        {"path", picture.path.string()},
                        {"task", picture.task}});
  }
  return {{"schema", kSchema},
          {"folder", plan.folder.string()},
          {"output", plan.output.string()},
          {"retries", plan.retries},
          {"tasks", tasks},
          {"pictures", pictures}};
}

Plan readPlan(const fs::path& path) {
  std::ifstream in(path);
  if (!in) throw Error(Errc::io, "cannot read " + path.string());
  try {
    const Json json = Json::parse(in);
    if (json.at("schema") != kSchema) throw std::runtime_error("its schema is another");
    Plan plan;
    plan.folder = json.at("folder").get<std::string>();
    plan.output = json.at("output").get<std::string>();
    plan.retries = json.at("retries").get<int>();
    for (const Json& task : json.at("tasks")) plan.tasks.push_back(taskFrom(task, plan.tasks.size()));
    for (const Json& picture : json.at("pictures")) {
      plan.pictures.push_back({picture.at("texture").get<std::string>(),
                               picture.at("target").get<std::string>(), picture.at("path").get<std::string>(),
                               picture.at("task").get<std::size_t>()});
    }
    return plan;
  } catch (const std::exception& error) {
    throw Error(Errc::io, path.string() + " is no plan of a batch: " + error.what());
  }
}

}  // namespace polestar::batch
