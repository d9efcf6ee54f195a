#include "polestar/core/threads.h"

#include <tbb/task_arena.h>

namespace polestar {

void withThreads(int threads, const std::function<void()>& body) {
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute(body);
}

}  // namespace polestar
