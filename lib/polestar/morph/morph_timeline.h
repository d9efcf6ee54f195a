#pragma once
// Which weights the shapes of a morph have at which frame.

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace polestar {

/// How a passage runs through its time: from 0 to 1, never back.
enum class Ease {
  linear,
  smooth,  ///< 3 t^2 - 2 t^3: at rest at both ends
  in,      ///< t^2: at rest at the beginning
  out      ///< at rest at the end
};
/// "linear", "smooth", "in" or "out".
const char* toString(Ease ease);
double eased(Ease ease, double t);

/// Barycentric weights: none negative, sum 1. Frames may be fractions.
class MorphTimeline {
 public:
  /// From the first shape at frame `first` through all others, evenly, to the last one at frame `last`.
  /// @throws Error{Errc::usage} for fewer than two shapes or frames
  static MorphTimeline passage(std::size_t shapes, int first, int last, Ease ease);
  /// The same at all frames. @throws Error{Errc::usage} for weights that are negative or do not sum to 1 to
  /// within 1e-6; they are made to sum to 1.
  static MorphTimeline still(std::vector<double> weights);
  /// Rows at even distances from frame `first` to frame `last`, linear in between; the ends go on.
  /// @throws as still(), for rows of different lengths, without rows, and where the frames do not rise
  static MorphTimeline keyed(int first, int last, std::vector<std::vector<double>> rows);

  std::size_t shapeCount() const { return keys_.front().size(); }
  std::vector<double> weights(double frame) const;
  /// Their derivative by the frame; where it jumps the mean of both sides, at the ends that of the inside.
  std::vector<double> rates(double frame) const;

 private:
  MorphTimeline() = default;
  double position(double frame) const;  // in keys_

  std::vector<std::vector<double>> keys_;
  double first_ = 0, last_ = 0;  // frames of the first and the last key
  Ease ease_ = Ease::linear;
};

}  // namespace polestar
