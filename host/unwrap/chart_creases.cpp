#include "unwrap/chart_creases.h"

#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/disjoint_sets.h"
#include "mesh/half_edge.h"

namespace kiln {
namespace {

/// Creases turn by 60 degrees at least, and are longer than this, over the side of a square with the mean
/// triangle's area. Triangles are flat whose neighbour turns by less than half a degree.
constexpr double kCreaseTurn = 0.5, kCreaseLength = 3, kFlatTurn = 0.99996;
/// In chains they turn by 75 degrees at least, and triangles beside them by less than 25 otherwise. A chain is longer
/// than this, over that side. Between flats it is longer still: a box of twelve triangles stays a net.
constexpr double kChainTurn = 0.26, kSmoothTurn = 0.906, kChainLength = 8, kFlatChain = 18;

class Creases {
 public:
  explicit Creases(ChartSurface& surface)
      : surface_(surface),
        side_(std::sqrt(surface.total_area / static_cast<double>(surface.triangles.size()))),
        flat_(surface.triangles.size(), 0),
        bent_(surface.triangles.size(), 0),
        smooth_(surface.triangles.size(), 0) {
    for (std::uint32_t h = 0; h < surface.mate.size(); ++h) {
      const double cosine = turn(h);
      if (cosine > kFlatTurn) flat_[h / 3] = 1;
      if (surface.mate[h] == kNoIndex || cosine <= kChainTurn) continue;
      (cosine < kSmoothTurn ? bent_ : smooth_)[h / 3] = 1;
    }
  }

  void part() {
    std::vector<std::uint32_t> creases;
    std::vector<std::uint32_t> chained;
    for (std::uint32_t h = 0; h < surface_.mate.size(); ++h) {
      const std::uint32_t m = surface_.mate[h];
      if (m == kNoIndex || m < h || turn(h) >= kCreaseTurn) continue;
      if (between_flats(h) && surface_.length[h] >= kCreaseLength * side_) {
        creases.push_back(h);
      } else if (turn(h) < kChainTurn && is_smooth(h / 3) && is_smooth(m / 3)) {
        chained.push_back(h);
      }
    }
    add_chains(chained, creases);
    for (const std::uint32_t h : creases) {
      surface_.mate[surface_.mate[h]] = kNoIndex;
      surface_.mate[h] = kNoIndex;
    }
  }

 private:
  /// True if the crease continues over at least one side, and bends more over none.
  bool is_smooth(std::uint32_t t) const { return smooth_[t] != 0 && bent_[t] == 0; }
  bool between_flats(std::uint32_t h) const {
    return flat_[h / 3] != 0 && flat_[surface_.mate[h] / 3] != 0;
  }
  double turn(std::uint32_t h) const {
    const std::uint32_t m = surface_.mate[h];
    return m == kNoIndex ? 0.0 : dot(surface_.normal[h / 3], surface_.normal[m / 3]);
  }
  /// Edges that lie in a long chain.
  void add_chains(const std::vector<std::uint32_t>& edges, std::vector<std::uint32_t>& creases) {
    DisjointSets sets(surface_.positions.size());
    const auto ends = [&](std::uint32_t h) {
      const Triangle& t = surface_.triangles[h / 3];
      return std::pair{t[h % 3], t[(h + 1) % 3]};
    };
    for (const std::uint32_t h : edges) sets.join(ends(h).first, ends(h).second);
    std::vector<double> length(surface_.positions.size(), 0);
    for (const std::uint32_t h : edges) length[sets.find(ends(h).first)] += surface_.length[h];
    for (const std::uint32_t h : edges) {
      const double least = (between_flats(h) ? kFlatChain : kChainLength) * side_;
      if (length[sets.find(ends(h).first)] >= least) creases.push_back(h);
    }
  }

  ChartSurface& surface_;
  double side_;
  std::vector<std::uint8_t> flat_;  ///< Triangles beside one in their plane.
  std::vector<std::uint8_t>
      bent_;  ///< With a neighbour that turns more than smooth ones, but no crease.
  std::vector<std::uint8_t> smooth_;  ///< With one that turns little.
};

}  // namespace

void part_at_creases(ChartSurface& surface) { Creases(surface).part(); }

}  // namespace kiln
