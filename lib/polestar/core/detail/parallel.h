#pragma once
// Parallel loops with the same result for any number of threads: work is cut into chunks of a fixed size, and
// sums are formed per chunk and then in chunk order. Private: TBB stays out of public headers.

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "polestar/core/context.h"

namespace polestar::detail {

/// Calls body(begin, end) on disjoint chunks that cover [0, count); every chunk but the last has `chunk`
/// items. Which thread runs a chunk is open, its bounds are not. Stops early when `context` is cancelled,
/// then throws.
template <class Body>
void parallelChunks(std::size_t count, std::size_t chunk, const Context& context, Body&& body) {
  const std::size_t chunks = (count + chunk - 1) / chunk;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, chunks, 1),
                    [&](const tbb::blocked_range<std::size_t>& range) {
                      for (std::size_t c = range.begin(); c != range.end(); ++c) {
                        if (context.cancelled()) return;
                        body(c * chunk, std::min(count, (c + 1) * chunk));
                      }
                    });
  context.throwIfCancelled();
}

template <class Body>
void parallelChunks(std::size_t count, std::size_t chunk, Body&& body) {
  parallelChunks(count, chunk, Context::quiet(), std::forward<Body>(body));
}

/// Combines the results of term(begin, end) over fixed chunks, in order of the chunks. What was combined so
/// far is moved into combine(), so that lists which take it by value grow in place.
template <class Value, class Term, class Combine>
Value reduceChunks(std::size_t count, std::size_t chunk, Value init, Term&& term, Combine&& combine) {
  const std::size_t chunks = (count + chunk - 1) / chunk;
  std::vector<Value> partial(chunks, init);
  parallelChunks(count, chunk,
                 [&](std::size_t begin, std::size_t end) { partial[begin / chunk] = term(begin, end); });
  for (const Value& value : partial) init = combine(std::move(init), value);
  return init;
}

/// Both, at the same time where there are threads for it.
template <class First, class Second>
void inParallel(First&& first, Second&& second) {
  tbb::parallel_invoke(std::forward<First>(first), std::forward<Second>(second));
}

}  // namespace polestar::detail
