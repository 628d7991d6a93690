// Threads for the work that stays on the host.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

#include "base/heartbeat.h"

namespace kiln {

/// As set_thread_limit() says; else hardware threads, or the KILN_THREADS environment variable where that is
/// set.
int thread_count();

/// Calls body(begin, end) over [0, count) in pieces of `grain`, on `thread_limit` threads
/// (0: thread_count()). Which thread takes which piece is not defined, so bodies must write to disjoint
/// places. The first exception thrown is thrown again here, after all threads have stopped. The calling thread
/// takes part, and gives a sign of life (base/heartbeat.h) with each of its pieces.
template <typename Body>
void parallel_for(std::size_t count, std::size_t grain, const Body& body, int thread_limit = 0) {
  const std::size_t pieces = (count + grain - 1) / grain;
  const auto wanted = static_cast<std::size_t>(thread_limit > 0 ? thread_limit : thread_count());
  const std::size_t threads = std::min(pieces, wanted);
  if (threads <= 1) {
    for (std::size_t begin = 0; begin < count; begin += grain) {
      body(begin, std::min(count, begin + grain));
      Heartbeat::beat();
    }
    return;
  }
  std::atomic<std::size_t> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto work = [&] {
    try {
      for (std::size_t piece = next++; piece < pieces; piece = next++) {
        body(piece * grain, std::min(count, (piece + 1) * grain));
        Heartbeat::beat();  // of the calling thread: others have none
      }
    } catch (...) {
      next = pieces;
      const std::lock_guard lock(error_mutex);
      if (!error) error = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> pool;
    pool.reserve(threads - 1);
    for (std::size_t i = 1; i < threads; ++i) pool.emplace_back(work);
    work();
  }
  if (error) std::rethrow_exception(error);
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
