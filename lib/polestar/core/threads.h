#pragma once
// The number of threads is the caller's choice per computation, not a global setting.

#include <functional>

namespace polestar {

/// Runs `body` with at most `threads` threads for all parallel loops inside it; 0 means all cores.
void withThreads(int threads, const std::function<void()>& body);

}  // namespace polestar
