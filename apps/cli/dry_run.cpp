#include "cli/dry_run.h"

#include "cli/outputs.h"
#include "cli/text.h"
#include "polestar/core/error.h"

namespace polestar::cli {
namespace {

Json describeInput(const std::filesystem::path& path, std::string& text) {
  if (isStandardStream(path)) {
    text += "would read standard input\n";
    return {{"path", "-"}, {"bytes", nullptr}};
  }
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  if (error) throw Error(Errc::io, "cannot read " + path.string() + ": " + error.message());
  text += "would read " + path.string() + " (" + byteSize(bytes) + ")\n";
  return {{"path", path.string()}, {"bytes", bytes}};
}

Json describeOutput(const PlannedFile& file, std::string& text) {
  text += "would write " + (isStandardStream(file.path) ? "standard output" : file.path.string()) + ": " +
          file.content;
  if (file.bytes) text += ", at most " + byteSize(*file.bytes);
  text += "\n";
  return {{"path", file.path.string()},
          {"content", file.content},
          {"bytes", file.bytes ? Json(*file.bytes) : Json()}};
}

}  // namespace

void describePlan(Session& session, const std::vector<PlannedFile>& writes) {
  Json reads = Json::array(), made = Json::array();
  for (const auto& path : session.inputs()) reads.push_back(describeInput(path, session.text()));
  for (const PlannedFile& file : writes) made.push_back(describeOutput(file, session.text()));
  session.json()["dry_run"] = {{"reads", reads}, {"writes", made}};
}

}  // namespace polestar::cli
