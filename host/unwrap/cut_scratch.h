// Scratch memory for cutting charts open on many threads.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

#include "unwrap/chart_surface.h"

namespace kiln {

/// Scratch memory for cut_open(). It lists edges whose state (glued or open) a thread inverts without changing
/// ChartBorders.
struct CutScratch {
  std::vector<std::uint32_t> index_in_chart;
  /// 1 for each half-edge whose state (glued or open) is inverted; all 0 between uses
  std::vector<std::uint8_t> inverted;

  explicit CutScratch(const ChartSurface& surface)
      : index_in_chart(surface.triangles.size()), inverted(surface.mate.size(), 0) {}
  /// Sets whether the state of edges is inverted.
  void set_inverted(const ChartSurface& surface, std::span<const std::uint32_t> edges,
                    std::uint8_t is_inverted) {
    for (const std::uint32_t h : edges) inverted[h] = inverted[surface.mate[h]] = is_inverted;
  }
};

/// A pool with one scratch for each active thread. Scratches are reused, since each has an entry for each half-edge of
/// the surface.
class ScratchPool {
 public:
  explicit ScratchPool(const ChartSurface& surface) : surface_(surface) {}

  std::unique_ptr<CutScratch> acquire() {
    const std::lock_guard lock(mutex_);
    if (free_scratches_.empty()) return std::make_unique<CutScratch>(surface_);
    std::unique_ptr<CutScratch> one = std::move(free_scratches_.back());
    free_scratches_.pop_back();
    return one;
  }
  void release(std::unique_ptr<CutScratch> one) {
    const std::lock_guard lock(mutex_);
    free_scratches_.push_back(std::move(one));
  }

 private:
  const ChartSurface& surface_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<CutScratch>> free_scratches_;
};

}  // namespace kiln
