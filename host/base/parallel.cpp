#include "base/parallel.h"

#include <cstdlib>

namespace kiln {

int thread_count() {
  static const int count = [] {
    if (const char* text = std::getenv("KILN_THREADS")) {
      const int value = std::atoi(text);
      if (value >= 1 && value <= 1024) return value;
    }
    return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  }();
  return count;
}

}  // namespace kiln
