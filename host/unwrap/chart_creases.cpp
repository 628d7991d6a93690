#include "unwrap/chart_creases.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "mesh/half_edge.h"

namespace kiln {
namespace {

/// Limits for single creases. The two faces at a crease enclose at least 60 degrees between their normals (cosine at
/// most kMaxCreaseCosine), and the edge is at least kCreaseLength times the square root of the mean triangle area. A
/// triangle counts as flat if a neighbour's normal is within half a degree (kMinFlatCosine).
constexpr double kMaxCreaseCosine = 0.5, kCreaseLength = 3, kMinFlatCosine = 0.99996;
/// Limits for chains of creases. At each edge of a chain, the normals of the two faces enclose at least 75 degrees
/// (kMaxChainCosine), while the triangles beside the chain have a neighbour within 25 degrees (kMinSmoothCosine). The
/// minimum length of a chain is kChainLength, or kFlatChainLength between flat triangles, in the unit of kCreaseLength:
/// a box of twelve triangles stays one net.
constexpr double kMaxChainCosine = 0.26, kMinSmoothCosine = 0.906, kChainLength = 8,
                 kFlatChainLength = 18;

class CreaseFinder {
 public:
  explicit CreaseFinder(ChartSurface& surface)
      : surface_(surface),
        mean_triangle_side_(
            std::sqrt(surface.total_area / static_cast<double>(surface.triangles.size()))),
        flat_triangles_(surface.triangles.size(), 0),
        bent_triangles_(surface.triangles.size(), 0),
        smooth_triangles_(surface.triangles.size(), 0) {
    for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
      const double cosine = normal_cosine(h);
      if (cosine > kMinFlatCosine) flat_triangles_[h / 3] = 1;
      if (surface.mate[h] == kNoIndex || cosine <= kMaxChainCosine) continue;
      (cosine < kMinSmoothCosine ? bent_triangles_ : smooth_triangles_)[h / 3] = 1;
    }
  }

  void separate() {
    std::vector<std::uint32_t> creases;
    std::vector<std::uint32_t> chain_edges;
    for (std::uint32_t h = 0; h < surface_.mate.size(); ++h) {
      const std::uint32_t m = surface_.mate[h];
      if (m == kNoIndex || m < h || normal_cosine(h) >= kMaxCreaseCosine) continue;
      if (is_between_flat_triangles(h) &&
          surface_.length[h] >= kCreaseLength * mean_triangle_side_) {
        creases.push_back(h);
      } else if (normal_cosine(h) < kMaxChainCosine && is_smooth(h / 3) && is_smooth(m / 3)) {
        chain_edges.push_back(h);
      }
    }
    add_chains(chain_edges, creases);
    for (const std::uint32_t h : creases) {
      surface_.mate[surface_.mate[h]] = kNoIndex;
      surface_.mate[h] = kNoIndex;
    }
  }

 private:
  /// True if the triangle has a neighbour with nearly the same normal, and each other neighbour lies across a crease.
  bool is_smooth(std::uint32_t t) const {
    return smooth_triangles_[t] != 0 && bent_triangles_[t] == 0;
  }
  bool is_between_flat_triangles(std::uint32_t h) const {
    return flat_triangles_[h / 3] != 0 && flat_triangles_[surface_.mate[h] / 3] != 0;
  }
  double normal_cosine(std::uint32_t h) const {
    const std::uint32_t m = surface_.mate[h];
    return m == kNoIndex ? 0.0 : dot(surface_.normal[h / 3], surface_.normal[m / 3]);
  }
  /// Adds the edges that belong to long chains.
  void add_chains(const std::vector<std::uint32_t>& edges, std::vector<std::uint32_t>& creases) {
    DisjointSets sets(surface_.positions.size());
    const auto vertices_of = [&](std::uint32_t h) {
      const Triangle& t = surface_.triangles[h / 3];
      return std::pair{t[h % 3], t[(h + 1) % 3]};
    };
    for (const std::uint32_t h : edges) sets.join(vertices_of(h).first, vertices_of(h).second);
    std::vector<double> length(surface_.positions.size(), 0);
    for (const std::uint32_t h : edges)
      length[sets.find(vertices_of(h).first)] += surface_.length[h];
    for (const std::uint32_t h : edges) {
      const double min_length =
          (is_between_flat_triangles(h) ? kFlatChainLength : kChainLength) * mean_triangle_side_;
      if (length[sets.find(vertices_of(h).first)] >= min_length) creases.push_back(h);
    }
  }

  ChartSurface& surface_;
  double mean_triangle_side_;
  std::vector<std::uint8_t>
      flat_triangles_;  ///< 1 for triangles with a neighbour in the same plane
  /// 1 for triangles whose angle to a neighbour is too large for a smooth surface, but too small for a crease.
  std::vector<std::uint8_t> bent_triangles_;
  std::vector<std::uint8_t>
      smooth_triangles_;  ///< 1 for triangles with a small angle to a neighbour
};

}  // namespace

void separate_at_creases(ChartSurface& surface) { CreaseFinder(surface).separate(); }

}  // namespace kiln
