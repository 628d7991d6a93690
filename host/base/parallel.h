// Threads for the work that stays on the host.
#pragma once

#include <cstddef>
#include <memory>

namespace kiln {

/// As set_thread_limit() says; else hardware threads, or the KILN_THREADS environment variable where that is
/// set.
int thread_count();

/// parallel_for() for a body that is known by its address: threads are compiled once, not once a body.
void parallel_pieces(std::size_t count, std::size_t grain, const void* body,
                     void (*call)(const void* body, std::size_t begin, std::size_t end),
                     int thread_limit);

/// Calls body(begin, end) over [0, count) in pieces of `grain`, on `thread_limit` threads
/// (0: thread_count()). Which thread takes which piece is not defined, so bodies must write to disjoint
/// places. The first exception thrown is thrown again here, after all threads have stopped. The calling thread
/// takes part, and gives a sign of life (base/progress_guard.h) with each of its pieces.
template <typename Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body, int thread_limit = 0) {
  parallel_pieces(
      count, grain, std::addressof(body),
      [](const void* of, std::size_t begin, std::size_t end) {
        (*static_cast<const Body*>(of))(begin, end);
      },
      thread_limit);
}

/// Calls body(i) for [0, count) in order, on the calling thread, with signs of life. For long loops alone.
template <typename Body>
void for_each_alive(std::size_t count, const Body& body) {
  parallel_for(
      count, std::size_t{1} << 17,
      [&](std::size_t begin, std::size_t end) {
        for (std::size_t i = begin; i < end; ++i) body(i);
      },
      1);
}

}  // namespace kiln
