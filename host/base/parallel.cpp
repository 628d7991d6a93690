#include "base/parallel.h"

#include <cstdlib>
#include <string>

#include "kiln/error.h"
#include "kiln/threads.h"

namespace kiln {
namespace {

constexpr int kMostThreads = 1024;
std::atomic<int> limit{0};

/// Where no limit is set.
int usual_count() {
  static const int count = [] {
    if (const char* text = std::getenv("KILN_THREADS")) {
      const int value = std::atoi(text);
      if (value >= 1 && value <= kMostThreads) return value;
    }
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }();
  return count;
}

}  // namespace

int thread_count() {
  const int set = limit;
  return set != 0 ? set : usual_count();
}

void set_thread_limit(int threads) {
  if (threads < 0 || threads > kMostThreads) {
    throw Error(ErrorCode::usage,
                "The thread limit is " + std::to_string(threads) +
                    ": it must be 1 to 1024, or 0 for as many as the machine has.",
                "thread-limit");
  }
  limit = threads;
}

int thread_limit() { return thread_count(); }

}  // namespace kiln
