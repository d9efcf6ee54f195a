#pragma once
// The one exception class of the library. A "no" that is an answer (not star-shaped, a certificate refused)
// is data in a report; an Error is thrown when a function cannot give its caller what its name promises.

#include <stdexcept>
#include <string>

namespace polestar {

/// What went wrong, as a caller would react to it. The command line turns these into its exit codes.
enum class Errc {
  usage,           ///< an option or argument is impossible
  io,              ///< a file cannot be read or written
  invalidSurface,  ///< not a closed, connected, orientable, manifold surface of genus 0
  notStarShaped,   ///< no point sees the whole surface, or the given center does not
  notConverged,    ///< a result was computed but misses its tolerance or fails its certificate
  cancelled        ///< the caller's Context asked to stop
};

/// Says what is wrong, where (face ids, coordinates in mesh units) and what to do about it, on one or two
/// lines.
class Error : public std::runtime_error {
 public:
  Error(Errc code, const std::string& message) : std::runtime_error(message), code_(code) {}
  Errc code() const noexcept { return code_; }

 private:
  Errc code_;
};

}  // namespace polestar
