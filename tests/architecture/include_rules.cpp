#include "include_rules.h"

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

namespace polestar::testing {
namespace {

namespace fs = std::filesystem;

/// Stage -> the stages that it may use, and through them what those use. A stage may always use itself.
const std::map<std::string, std::vector<std::string>>& arrows() {
  static const std::map<std::string, std::vector<std::string>> table = {
      {"core", {}},
      {"mesh", {"core"}},
      {"star", {"mesh"}},
      {"green", {"star"}},
      {"chart", {"green"}},
      {"sphere", {"star"}},
      {"polycube", {"sphere"}},
      {"map", {"chart", "sphere"}},
      {"certify", {"map"}},
      {"vdb", {"mesh"}},
      {"io", {"vdb"}},
      {"texture", {"map", "vdb", "io"}},
      {"morph", {"certify", "texture"}},
      {"render", {"texture", "polycube"}},
  };
  return table;
}

std::set<std::string> allowed(const std::string& stage) {
  std::set<std::string> result{stage};
  for (const std::string& used : arrows().at(stage)) result.merge(allowed(used));
  return result;
}

bool isPrivate(const fs::path& path) {
  for (const fs::path& part : path) {
    if (part == "detail") return true;
  }
  return false;
}

bool isHeader(const fs::path& file) { return file.extension() == ".h" || file.extension() == ".in"; }

/// What takes seconds to parse, or ties users of our headers to a library that we may replace.
bool isHeavy(const std::string& include) {
  static const std::regex kHeavy("(openvdb|embree3|OpenImageIO|tbb|oneapi|boost|ceres|nlohmann|CL)/.*");
  return std::regex_match(include, kHeavy);
}

/// "mesh" for lib/polestar/mesh/... and polestar/mesh/...; "" for files of no stage, such as
/// polestar/pipeline.h.
std::string stageOf(const fs::path& path) {
  auto part = path.begin();
  if (part != path.end() && *part == "lib") ++part;
  if (part == path.end() || *part != "polestar") return "";
  if (++part == path.end() || std::next(part) == path.end()) return "";
  return part->string();
}

/// polestar-verify judges what all other code makes: an error of theirs must not be able to hide in a shared
/// line.
bool isOfTheJudge(const fs::path& file) {
  return file.lexically_relative("apps/verify").native().rfind("..", 0) != 0;
}

/// Its own headers stand beside their users, without a folder in the name.
std::string objectionOfTheJudge(const std::string& include) {
  static const std::regex kOurs("(polestar|cli|batch|volumes|support|lib|apps)/.*|.*\\.\\..*");
  return std::regex_match(include, kOurs) ? "the judge shares no code with what it judges" : "";
}

/// Why `file` may not include `include`; empty when it may.
std::string objection(const fs::path& file, const std::string& include) {
  if (isOfTheJudge(file)) return objectionOfTheJudge(include);
  if (std::regex_match(include, std::regex("(.*/)?verify/.*")))
    return "the judge's code is the judge's alone";
  const bool inLibrary = *file.begin() == "lib";
  const std::string from = stageOf(file), to = stageOf(include);
  if (inLibrary && !from.empty() && !arrows().contains(from))
    return "the stage " + from + " is not in the table";
  if (isHeader(file) && inLibrary && !isPrivate(file) && isHeavy(include)) {
    return "heavy headers belong into .cpp files and detail/";
  }
  if (*fs::path(include).begin() != "polestar") return "";
  if (inLibrary && !from.empty()) {
    if (to.empty()) return "it stands above all stages";
    if (!allowed(from).contains(to)) return from + " may not use " + to;
  }
  if (isPrivate(include) && from != to && to != "core") return "detail/ is private to " + to;
  if (isPrivate(include) && !inLibrary) return "detail/ is private to the library";
  if (isPrivate(include) && isHeader(file) && !isPrivate(file))
    return "detail/ headers are not installed, this one is";
  return "";
}

}  // namespace

Violations checkIncludes(const fs::path& file, const std::string& text) {
  static const std::regex kInclude(R"(^\s*#\s*include\s*[<"]([^>"]+)[>"].*)");
  Violations violations;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    std::smatch match;
    if (!std::regex_match(line, match, kInclude)) continue;
    const std::string reason = objection(file, match[1]);
    if (reason.empty()) continue;
    violations.push_back(file.string() + ":" + std::to_string(number) + " includes " + match[1].str() + ": " +
                         reason);
  }
  return violations;
}

Violations checkTree(const fs::path& root, const fs::path& folder, std::size_t& files) {
  Violations violations;
  for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
    const fs::path file = entry.path().lexically_relative(root);
    if (!entry.is_regular_file() || (!isHeader(file) && file.extension() != ".cpp")) continue;
    ++files;
    std::ostringstream text;
    text << std::ifstream(entry.path()).rdbuf();
    const Violations more = checkIncludes(file, text.str());
    violations.insert(violations.end(), more.begin(), more.end());
  }
  return violations;
}

}  // namespace polestar::testing
