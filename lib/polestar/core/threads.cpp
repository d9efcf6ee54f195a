#include "polestar/core/threads.h"

#include <tbb/task_arena.h>

#include <algorithm>

namespace polestar {

void withThreads(int threads, const std::function<void()>& body) {
  // More than there are cores would only make TBB warn on standard error.
  const int cores = tbb::this_task_arena::max_concurrency();
  tbb::task_arena arena(threads > 0 ? std::min(threads, cores) : tbb::task_arena::automatic);
  arena.execute(body);
}

}  // namespace polestar
