#include "polestar/io/frame_path.h"

#include <charconv>
#include <regex>
#include <string>

#include "polestar/core/error.h"

namespace polestar {
namespace {

/// What may stand for a number.
const std::regex& placePattern() {
  static const std::regex kPlace(R"(#+|%(?:0(\d))?d|\$F(\d)?)");
  return kPlace;
}

}  // namespace

FrameRange FrameRange::parse(std::string_view text) {
  static const std::regex kRange(R"((-?\d{1,7})(?:-(-?\d{1,7})(?:x(\d{1,7}))?)?)");
  std::match_results<std::string_view::const_iterator> match;
  const std::string shown(text);
  if (!std::regex_match(text.begin(), text.end(), match, kRange)) {
    throw Error(Errc::usage,
                "frames are FIRST-LAST or FIRST-LASTxSTEP such as 1-240x2; found \"" + shown + "\"");
  }
  const int first = std::stoi(match[1].str());
  const int last = match[2].matched ? std::stoi(match[2].str()) : first;
  const int step = match[3].matched ? std::stoi(match[3].str()) : 1;
  if (last < first) throw Error(Errc::usage, "the frames " + shown + " end before they begin");
  if (step == 0) throw Error(Errc::usage, "the frames " + shown + " have a step of 0");
  FrameRange range;
  for (int frame = first; frame <= last; frame += step) range.frames_.push_back(frame);
  return range;
}

FramePath::FramePath(const std::filesystem::path& path) : path_(path) {
  const std::string name = path.filename().string();
  std::smatch match;
  if (!std::regex_search(name, match, placePattern())) return;
  const std::string rest = match.suffix();
  if (std::regex_search(rest, placePattern())) {
    throw Error(Errc::usage, path.string() + ": there is more than one place for the frame's number");
  }
  begin_ = static_cast<std::size_t>(match.position());
  end_ = begin_ + static_cast<std::size_t>(match.length());
  if (name[begin_] == '#') digits_ = static_cast<int>(match.length());
  if (match[1].matched) digits_ = std::stoi(match[1].str());
  if (match[2].matched) digits_ = std::stoi(match[2].str());
}

std::string FramePath::before() const { return path_.filename().string().substr(0, begin_); }
std::string FramePath::after() const { return path_.filename().string().substr(end_); }

std::filesystem::path FramePath::at(int frame) const {
  if (!numbered()) return path_;
  std::string number = std::to_string(std::abs(frame));
  const std::size_t sign = frame < 0 ? 1 : 0;
  const auto width = static_cast<std::size_t>(digits_);
  if (number.size() + sign < width) number.insert(0, width - number.size() - sign, '0');
  std::string name = path_.filename().string();
  name.replace(begin_, end_ - begin_, (frame < 0 ? "-" : "") + number);
  return path_.parent_path() / name;
}

}  // namespace polestar
