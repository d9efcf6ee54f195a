#pragma once
// One row, measured in a process of its own.

#include "row.h"

namespace polestar::bench {

/// runRow in a child process, so that peak memory is the row's own and a crash ends the row alone; of
/// `repeat` runs the fastest. `status` is "failed: ..." when it threw or died. To be called without threads.
Json runRowApart(const Row& row, const Reference* reference, int repeat);

}  // namespace polestar::bench
