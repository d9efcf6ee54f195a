#pragma once
// The one place where the library's error codes become exit codes, as scripts and farms rely on them.

#include <stdexcept>
#include <string>

#include "polestar/core/error.h"

namespace polestar::cli {

/// How a failed command ends.
struct Failure {
  int exitCode;
  const char* name;  ///< the "code" of a JSON error
};

inline constexpr Failure kInternalError{1, "internal"};    ///< a mistake of ours, or no memory left
inline constexpr Failure kTasksFailed{7, "tasks_failed"};  ///< some tasks of a batch

constexpr Failure failureFor(Errc code) {
  switch (code) {
    case Errc::usage:
      return {2, "usage"};
    case Errc::io:
      return {3, "io"};
    case Errc::invalidSurface:
      return {4, "invalid_surface"};
    case Errc::notStarShaped:
      return {5, "not_star_shaped"};
    case Errc::notConverged:
      return {6, "not_converged"};
    case Errc::cancelled:
      return {130, "cancelled"};
  }
  return kInternalError;
}

/// An end that only the tool knows, such as that of a batch.
class CommandFailure : public std::runtime_error {
 public:
  CommandFailure(Failure failure, const std::string& message)
      : std::runtime_error(message), failure_(failure) {}
  const Failure& failure() const { return failure_; }

 private:
  Failure failure_;
};

}  // namespace polestar::cli
