#include "polestar/core/context.h"

#include "polestar/core/error.h"

namespace polestar {

void Context::throwIfCancelled() const {
  if (cancelled()) throw Error(Errc::cancelled, "cancelled");
}

Context& Context::quiet() {
  // One per thread: a caller that cancels its own quiet context must not stop a stranger's computation.
  thread_local Context context;
  return context;
}

}  // namespace polestar
