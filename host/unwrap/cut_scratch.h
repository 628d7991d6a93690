// Scratch for cutting charts open on many threads.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Scratch of cut_open() with edges whose glue state differs from the borders'.
struct CutScratch {
  std::vector<std::uint32_t> local;
  /// 1 for half-edges whose glue state is inverted; all 0 between uses
  std::vector<std::uint8_t> other;

  explicit CutScratch(const ChartSurface& surface)
      : local(surface.triangles.size()), other(surface.mate.size(), 0) {}
  /// Marks edges whose glue state is inverted; 0: unmarks them.
  void mark(const ChartSurface& surface, std::span<const std::uint32_t> edges, std::uint8_t value) {
    for (const std::uint32_t h : edges) other[h] = other[surface.mate[h]] = value;
  }
};

/// A pool with one scratch for each active thread, since a scratch has an entry for each half-edge of the surface.
class ScratchPool {
 public:
  explicit ScratchPool(const ChartSurface& surface) : surface_(surface) {}

  std::unique_ptr<CutScratch> acquire() {
    const std::lock_guard lock(mutex_);
    if (free_.empty()) return std::make_unique<CutScratch>(surface_);
    std::unique_ptr<CutScratch> one = std::move(free_.back());
    free_.pop_back();
    return one;
  }
  void release(std::unique_ptr<CutScratch> one) {
    const std::lock_guard lock(mutex_);
    free_.push_back(std::move(one));
  }

 private:
  const ChartSurface& surface_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<CutScratch>> free_;
};

}  // namespace kiln
