#include "base/parallel.h"

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/input_log.h"
#include "base/memory.h"
#include "base/progress_guard.h"
#include "kiln/error.h"
#include "kiln/limits.h"

namespace kiln {
namespace {

constexpr int kMaxThreads = 1024;
std::atomic<int> requested_limit{0};

/// Number of threads if no limit was set.
int default_thread_count() {
  static const int count = [] {
    if (const char* text = std::getenv("KILN_THREADS")) {
      const int value = std::atoi(text);
      if (value >= 1 && value <= kMaxThreads) return value;
    }
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }();
  return count;
}

}  // namespace

int thread_count() {
  const int set = requested_limit;
  return set != 0 ? set : default_thread_count();
}

void set_thread_limit(int threads) {
  if (threads < 0 || threads > kMaxThreads) {
    throw Error(ErrorCode::usage,
                "The thread limit is " + std::to_string(threads) +
                    ": it must be 1 to 1024, or 0 for as many as the machine has.",
                "thread-limit");
  }
  requested_limit = threads;
}

int thread_limit() { return thread_count(); }

void parallel_pieces(std::size_t count, std::size_t grain, const void* body,
                     void (*call)(const void* body, std::size_t begin, std::size_t end),
                     int thread_limit) {
  const std::size_t pieces = (count + grain - 1) / grain;
  const auto requested_threads =
      static_cast<std::size_t>(thread_limit > 0 ? thread_limit : thread_count());
  const std::size_t threads = std::min(pieces, requested_threads);
  if (threads <= 1) {
    for (std::size_t begin = 0; begin < count; begin += grain) {
      call(body, begin, std::min(count, begin + grain));
      ProgressGuard::poll();
    }
    return;
  }
  std::atomic<std::size_t> next{0};
  std::exception_ptr error;
  std::mutex error_mutex;
  const auto work = [&] {
    try {
      for (std::size_t piece = next++; piece < pieces; piece = next++) {
        call(body, piece * grain, std::min(count, (piece + 1) * grain));
        ProgressGuard::
            poll();  // polls the progress callback of the calling thread; the other threads have no callback
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
    for (std::size_t i = 1; i < threads; ++i) {
      pool.emplace_back([&, log = current_input_log()] {
        const InputLogScope scope(log);
        obey_memory_limit();
        work();
      });
    }
    work();
  }
  if (error) std::rethrow_exception(error);
}

}  // namespace kiln
