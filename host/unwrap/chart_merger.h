// Merges patches into discs greedily, in the order of the increase of the normals' variance per length of removed
// edges.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <queue>
#include <span>
#include <tuple>
#include <utility>
#include <vector>

#include "base/progress_guard.h"
#include "mesh/half_edge.h"
#include "unwrap/chart_borders.h"

namespace kiln {

/// Constant in the merge cost. Where the surface is flat, it makes small patches merge first.
inline constexpr double kSmallPatchPriority = 0.02;

struct ChartPatch {
  /// One half-edge of the patch's border, and the number of half-edges of that border
  std::uint32_t border_half_edge = 0, border_length = 3;
  double area = 0;
  Vec3d normal{};  ///< Area-weighted sum of the triangles' normals
  std::array<std::uint32_t, 2> parts{kNoIndex, kNoIndex};
  std::vector<std::uint32_t> glued;  ///< Half-edges along which the two parts were joined
  bool is_current = true;
};

inline double variance(double area, const Vec3d& normal) { return area - length(normal); }

/// A batch of trial merges in the order of their costs. If two merges share a part, the later one is only used if the
/// earlier one is refused.
template <std::size_t count>
class MergeTrials {
 public:
  explicit MergeTrials(std::span<const ChartPatch> joined) : joined_(joined) {}

  /// True if merge i need not be tried, since a final merge before it contains one of its parts. Thread-safe.
  bool is_superseded(std::size_t i) const {
    for (std::size_t j = 0; j < i; ++j) {
      if (shares_part(i, j) && trial_outcomes_[j] == 1 && is_final(j)) return true;
    }
    return false;
  }
  bool has_rival(std::size_t i) const {
    for (std::size_t j = 0; j < i; ++j) {
      if (shares_part(i, j)) return true;
    }
    return false;
  }
  void record_outcome(std::size_t i, bool is_accepted) {
    trial_outcomes_[i] = is_accepted ? 1 : -1;
  }

 private:
  bool shares_part(std::size_t i, std::size_t j) const {
    const auto [a, b] = joined_[i].parts;
    const auto [c, d] = joined_[j].parts;
    return a == c || a == d || b == c || b == d;
  }
  /// True if accepted merge i is final: each earlier merge that shares a part with it is refused or superseded.
  bool is_final(std::size_t i) const {
    for (std::size_t j = 0; j < i; ++j) {
      if (shares_part(i, j) && trial_outcomes_[j] != -1 && !is_superseded(j)) return false;
    }
    return true;
  }

  std::span<const ChartPatch> joined_;
  /// Result of each trial: 0 if not tried yet, 1 if accepted, -1 if refused
  std::array<std::atomic<int>, count> trial_outcomes_{};
};

/// Merges patches greedily. The caller decides which merges are accepted.
class ChartMerger {
 public:
  ChartMerger(const ChartSurface& surface, ChartBorders& borders)
      : surface_(surface), borders_(borders), owner_(surface.triangles.size()) {}

  std::uint32_t add(ChartPatch patch) {
    patches_.push_back(std::move(patch));
    root_.push_back(static_cast<std::uint32_t>(root_.size()));
    waiting_pairs_.emplace_back();
    neighbour_index_.push_back(kNoIndex);
    return root_.back();
  }
  void assign_owner(std::uint32_t triangle, std::uint32_t patch) { owner_[triangle] = patch; }
  std::vector<ChartPatch>& patches() { return patches_; }

  /// Merges until no pair is left. `fits(area, normal)` is a cheap test that decides whether a pair is queued at all.
  /// `accept(joined, accepted)` receives up to `width` merged patches, the cheapest first, and sets entries of
  /// `accepted` to 0 for patches that it refuses. Several of the patches may share a part: if one of these is accepted,
  /// the later ones must be refused. If `width` is above 1, the edges between the two parts of each patch are still
  /// open during the call.
  template <typename Fits, typename Accept>
  void run(std::size_t width, const Fits& fits, const Accept& accept) {
    for (std::uint32_t p = 0; p < patches_.size(); ++p) {
      if (patches_[p].is_current) queue_neighbour_pairs(p, true, fits);
    }
    std::vector<ChartPatch> joined;
    std::vector<std::uint8_t> accepted;
    while (!queue_.empty()) {
      ProgressGuard::poll();
      pop_pairs(width, joined);
      accepted.assign(joined.size(), 1);
      accept(std::span<const ChartPatch>(joined), accepted);
      for (std::size_t i = 0; i < joined.size(); ++i) {
        if (accepted[i] == 0) {
          if (width == 1) borders_.open_edges(joined[i].glued);
          continue;
        }
        if (width > 1) glue(joined[i]);
        const auto [a, b] = joined[i].parts;
        for (const std::uint32_t part : {a, b}) {
          patches_[part].is_current = false;
          waiting_pairs_[part] = {};
        }
        const std::uint32_t id = add(std::move(joined[i]));
        root_[a] = root_[b] = id;
        queue_neighbour_pairs(id, false, fits);
      }
    }
  }

 private:
  struct Pair {
    double cost = 0;
    std::uint32_t a = 0, b = 0, half_edge = 0;
    std::uint32_t from = 0;                    ///< The patch that queued the pair
    bool operator<(const Pair& other) const {  // Orders heaps so that the cheapest pair is on top
      return std::tie(cost, a, b) > std::tie(other.cost, other.a, other.b);
    }
  };

  /// Pops up to `width` of the cheapest pairs whose parts can be glued.
  void pop_pairs(std::size_t width, std::vector<ChartPatch>& joined) {
    joined.clear();
    while (joined.size() < width && !queue_.empty()) {
      const Pair pair = queue_.top();
      queue_.pop();
      queue_next(pair.from);
      const ChartPatch &a = patches_[pair.a], &b = patches_[pair.b];
      if (!a.is_current || !b.is_current) continue;
      ChartPatch patch;
      patch.border_half_edge = pair.half_edge;
      patch.parts = {pair.a, pair.b};
      if (!glue(patch)) continue;
      if (width > 1) borders_.open_edges(patch.glued);
      patch.border_length =
          a.border_length + b.border_length - 2 * static_cast<std::uint32_t>(patch.glued.size());
      patch.area = a.area + b.area;
      patch.normal = a.normal + b.normal;
      joined.push_back(std::move(patch));
    }
  }

  /// Glues the two parts of a patch.
  /// \param patch  [in, out] ChartPatch::border_half_edge is a half-edge between the parts on entry, and one of the new
  ///   border on return
  bool glue(ChartPatch& patch) {
    const auto [a, b] = patch.parts;
    const std::uint32_t joint = patch.glued.empty() ? patch.border_half_edge : patch.glued.front();
    patch.glued.clear();
    patch.border_half_edge = borders_.glue(borders_.run_through(joint), patches_[a].border_length,
                                           patches_[b].border_length, patch.glued);
    return patch.border_half_edge != kNoIndex;
  }

  std::uint32_t owner(std::uint32_t half_edge) {
    std::uint32_t p = owner_[half_edge / 3];
    while (root_[p] != p) p = root_[p] = root_[root_[p]];
    return p;
  }

  /// Queues the cheapest waiting pair of a patch. The patch's other pairs wait in a separate heap: most are never
  /// needed, and the queue stays short.
  void queue_next(std::uint32_t p) {
    std::vector<Pair>& waiting = waiting_pairs_[p];
    while (!waiting.empty()) {
      std::pop_heap(waiting.begin(), waiting.end());
      const Pair pair = waiting.back();
      waiting.pop_back();
      if (!patches_[pair.a].is_current || !patches_[pair.b].is_current) continue;
      queue_.push(pair);
      return;
    }
  }

  /// Finds the pairs of a patch with its neighbours, each at the longest run of shared edges, and queues the cheapest.
  template <typename Fits>
  void queue_neighbour_pairs(std::uint32_t p, bool later_only, const Fits& fits) {
    std::vector<std::pair<std::uint32_t, ChartBorders::Run>> best;
    const std::uint32_t border_half_edge = patches_[p].border_half_edge;
    std::uint32_t h = border_half_edge;
    const auto add_run = [&](std::uint32_t half_edge) {
      const ChartBorders::Run run = borders_.run_through(half_edge);
      const std::uint32_t other = owner(surface_.mate[half_edge]);
      if (neighbour_index_[other] == kNoIndex) {
        neighbour_index_[other] = static_cast<std::uint32_t>(best.size());
        best.push_back({other, run});
      } else if (run.length > best[neighbour_index_[other]].second.length) {
        best[neighbour_index_[other]].second = run;
      }
    };
    bool any = false;
    std::uint32_t last_shared_edge = kNoIndex;
    do {
      const std::uint32_t m = surface_.mate[h];
      if (m != kNoIndex && owner(m) != p) {
        last_shared_edge = h;
        const std::uint32_t before = borders_.previous(h);
        const bool continues_run =
            surface_.mate[before] != kNoIndex && borders_.next(m) == surface_.mate[before];
        if (!continues_run) add_run(h), any = true;
      }
      h = borders_.next(h);
    } while (h != border_half_edge);
    if (!any && last_shared_edge != kNoIndex) add_run(last_shared_edge);
    const ChartPatch& patch = patches_[p];
    std::vector<Pair>& waiting = waiting_pairs_[p];
    for (const auto& [other, run] : best) {
      neighbour_index_[other] = kNoIndex;
      if (later_only && other < p) continue;
      const ChartPatch& neighbour = patches_[other];
      const double area = patch.area + neighbour.area;
      const Vec3d normal = patch.normal + neighbour.normal;
      if (!fits(area, normal)) continue;
      const double variance_increase = variance(area, normal) - variance(patch.area, patch.normal) -
                                       variance(neighbour.area, neighbour.normal);
      const double cost = (std::max(variance_increase, 0.0) +
                           kSmallPatchPriority * std::min(patch.area, neighbour.area)) /
                          run.length;
      waiting.push_back({cost, std::min(p, other), std::max(p, other), run.first, p});
    }
    std::make_heap(waiting.begin(), waiting.end());
    queue_next(p);
  }

  const ChartSurface& surface_;
  ChartBorders& borders_;
  std::vector<std::uint32_t> owner_, root_;
  std::vector<ChartPatch> patches_;
  std::priority_queue<Pair> queue_;  ///< The cheapest pair of each patch
  /// For each patch, a heap of its pairs that are not in queue_
  std::vector<std::vector<Pair>> waiting_pairs_;
  /// Scratch of propose(): for each patch, kNoIndex or its index in the list of neighbours.
  std::vector<std::uint32_t> neighbour_index_;
};

}  // namespace kiln
