// Runs Embree's calls with as many threads as Kiln uses.
#pragma once

#include <pmmintrin.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cstddef>
#include <thread>
#include <vector>

#include "base/parallel.h"

namespace kiln::bench {

/// Runs a function over contiguous ranges, one per thread, with denormals flushed to zero as Embree requires.
template <typename Body>
void on_threads(std::size_t count, const Body& body) {
  const auto threads = static_cast<std::size_t>(thread_count());
  const std::size_t share = (count / threads + 63) / 64 * 64 + 64;
  std::vector<std::jthread> pool;
  for (std::size_t i = 0; i < threads; ++i) {
    pool.emplace_back([&, i] {
      _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
      _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
      body(std::min(count, i * share), std::min(count, (i + 1) * share));
    });
  }
}

}  // namespace kiln::bench
