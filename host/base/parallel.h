// Parallel loops on the host.
#pragma once

#include <cstddef>
#include <memory>

namespace kiln {

/// Number of threads: that of set_thread_limit(), else of the environment variable KILN_THREADS, else the
/// number of hardware threads.
int thread_count();

/// Type-erased parallel_for(), so that the threading code is compiled once instead of once for each body.
void parallel_pieces(std::size_t count, std::size_t grain, const void* body,
                     void (*call)(const void* body, std::size_t begin, std::size_t end),
                     int thread_limit);

/// Calls body(begin, end) over [0, count) in pieces of `grain`, on `thread_limit` threads (0: thread_count()). The
/// assignment of pieces to threads is undefined, so bodies must write to disjoint memory. The first exception is
/// rethrown after all threads have stopped. The calling thread takes part, and polls progress (base/progress_guard.h)
/// with each of its pieces.
template <typename Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body, int thread_limit = 0) {
  parallel_pieces(
      count, grain, std::addressof(body),
      [](const void* of, std::size_t begin, std::size_t end) {
        (*static_cast<const Body*>(of))(begin, end);
      },
      thread_limit);
}

/// Calls body(i) for [0, count) in order on the calling thread, polling progress. For long loops.
template <typename Body>
void for_each_polling(std::size_t count, const Body& body) {
  parallel_for(
      count, std::size_t{1} << 17,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(i);
      },
      1);
}

}  // namespace kiln
