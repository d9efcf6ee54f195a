#pragma once
// Ctrl-C and a farm's SIGTERM become Context::cancel, so that files and temporaries are put in order before
// the end.

#include "polestar/core/context.h"

namespace polestar::cli {

/// While it lives, the first SIGINT, SIGTERM or SIGHUP cancels `context`; a second one ends the process at
/// once. One at a time.
class InterruptGuard {
 public:
  explicit InterruptGuard(Context& context);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

}  // namespace polestar::cli
