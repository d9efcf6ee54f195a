#pragma once
// JOBS.toml: which textures go into which targets, and how; read, checked, and told by line when wrong.

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace polestar::batch {

/// The commands that a batch is made of, in the order in which they need each other.
enum class Step { map, transfer, render };
inline constexpr std::array kSteps{Step::map, Step::transfer, Step::render};
const char* toString(Step step);

/// An option of a command: its long name, and the words that it becomes, such as "--cut=x".
struct JobOption {
  std::vector<std::string> words;  ///< none: the option is switched off
  std::vector<std::string> values;
  int line = 0;  ///< in the job file
};

/// By long name, of each step.
class JobOptions {
 public:
  std::map<std::string, JobOption>& of(Step step) { return of_[static_cast<std::size_t>(step)]; }
  const std::map<std::string, JobOption>& of(Step step) const { return of_[static_cast<std::size_t>(step)]; }
  /// What `later` sets takes the place of what stands here.
  void overrideBy(const JobOptions& later);

 private:
  std::array<std::map<std::string, JobOption>, kSteps.size()> of_;
};

struct JobTexture {
  std::string name;     ///< in the names of files
  std::string texture;  ///< as `transfer` takes it
  /// The solid that a file's texture fills: a mesh, which then is mapped first, or a map; empty: the file
  /// says.
  std::string source;
  JobOptions options;
  int line = 0;
};

struct JobTarget {
  std::string name;
  std::string path;  ///< a mesh or a map, or a numbered sequence of meshes
  JobOptions options;
  int line = 0;
};

/// Options for those pairs whose names match two patterns of a shell's kind.
struct JobOverride {
  std::string texture = "*", target = "*";
  JobOptions options;
};

/// Long options of sbatch by name, for all steps and for single ones.
struct SlurmOptions {
  std::map<std::string, std::string> all;
  std::array<std::map<std::string, std::string>, kSteps.size()> of;
};

struct JobFile {
  std::filesystem::path folder;  ///< absolute, where the file lies: what the paths in it start from
  std::string output = "batch";  ///< the folder of all results
  std::vector<Step> steps{kSteps.begin(), kSteps.end()};
  std::optional<std::string> frames;
  int framesPerTask = 1;
  std::string pictureFormat = "png";
  int retries = 1;
  JobOptions defaults;
  std::vector<JobTexture> textures;
  std::vector<JobTarget> targets;  ///< at least one
  std::vector<JobOverride> overrides;
  SlurmOptions slurm;

  bool has(Step step) const;
};

/// @throws Error{Errc::io} for a file that cannot be read; Error{Errc::usage} with the line for what is no
/// TOML, for keys that there are not, values of a wrong type, names that no file can have, and a pattern of
/// `meshes` that nothing matches.
JobFile readJobFile(const std::filesystem::path& path);

}  // namespace polestar::batch
