#pragma once
// Numbered files: ranges of frames, and names in which a frame's number stands.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace polestar {

/// Frames "FIRST-LASTxSTEP", both ends included: "1-48", "1-240x2" (1, 3, ... 239), "7". Numbers from -999999
/// to 9999999.
class FrameRange {
 public:
  /// @throws Error{Errc::usage} saying what a range looks like.
  static FrameRange parse(std::string_view text);

  std::size_t size() const { return frames_.size(); }
  const std::vector<int>& frames() const { return frames_; }

 private:
  std::vector<int> frames_;  ///< at least one
};

/// A path whose file name may hold the place of a frame's number: "####" (as many digits as there are #, more
/// where the number needs them), "%04d", "%d", "$F4" or "$F".
class FramePath {
 public:
  /// Names of folders are left alone. @throws Error{Errc::usage} for more than one place.
  explicit FramePath(const std::filesystem::path& path);

  bool numbered() const { return end_ > begin_; }
  /// What stands before and after the place in the file's name.
  std::string before() const;
  std::string after() const;
  /// The path of a frame; without a place for it, the path as it is.
  std::filesystem::path at(int frame) const;
  const std::filesystem::path& pattern() const { return path_; }

 private:
  std::filesystem::path path_;
  std::size_t begin_ = 0, end_ = 0;  ///< of the place, in the file name
  int digits_ = 0;
};

}  // namespace polestar
