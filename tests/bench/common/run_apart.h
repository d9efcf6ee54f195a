#pragma once
// One measurement in a process of its own.

#include <functional>

#include "results.h"

namespace polestar::bench {

/// What `work` returns, computed in a child process, so that peak memory is its own and a crash ends it
/// alone. {"status": "failed: ..."} when it threw or died. To be called without threads.
Json runApart(const std::function<Json()>& work);

}  // namespace polestar::bench
