#include "unwrap/pairing.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/vector.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Largest stretch of a pair; above it, two single triangles are better. A pair reaches this limit if its areas differ
/// by a factor of 5, or with a shear of 4.
constexpr double kMaxStretch = 0.7;

struct CandidatePair {
  float stretch;
  std::uint32_t a, b;  ///< Indices of the adjacent triangles, a < b
  std::uint8_t apex_a, apex_b;
};

double pair_stretch(const TriangleShape& a, int apex_a, const TriangleShape& b, int apex_b) {
  // Squared sides of the quad in the order of its corners: apex of a, next corner of a, apex of b, next corner of b.
  // Opposite sides of the quad become opposite sides of the rectangle.
  const double a_next = a.squared_edge[(apex_a + 2) % 3], a_last = a.squared_edge[(apex_a + 1) % 3];
  const double b_next = b.squared_edge[(apex_b + 2) % 3], b_last = b.squared_edge[(apex_b + 1) % 3];
  const double width = std::sqrt(a_next) + std::sqrt(b_next);
  const double height = std::sqrt(a_last) + std::sqrt(b_last);
  const double scale = std::sqrt((a.area + b.area) / (width * height));
  const double total =
      a.area * stretch(width * scale, height * scale, a_next, a_last, a.squared_edge[apex_a]) +
      b.area * stretch(width * scale, height * scale, b_next, b_last, b.squared_edge[apex_b]);
  // Adds the difference of the areas without a weight. By area-weighted stretch alone, a tiny triangle would be
  // distorted in favour of a large one.
  const double half_log_ratio = 0.5 * (std::log(a.area) - std::log(b.area));
  return total / (a.area + b.area) + 0.25 * half_log_ratio * half_log_ratio;
}

std::vector<CandidatePair> find_candidate_pairs(std::span<const Vec3> positions,
                                                std::span<const Triangle> triangles,
                                                std::span<const TriangleShape> shapes) {
  struct TriangleSide {
    std::uint64_t
        key;  ///< Both vertices of the edge in one integer, the lower index in the high bits
    std::uint32_t triangle;
    std::uint8_t apex, forward;
  };
  const std::vector<std::uint32_t> welded = weld_vertices(positions);
  std::vector<TriangleSide> sides;
  sides.reserve(triangles.size() * 3);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (!(shapes[t].area > 0)) continue;
    for (std::uint8_t apex = 0; apex < 3; ++apex) {
      const std::uint64_t from = welded[triangles[t][(apex + 1) % 3]];
      const std::uint64_t to = welded[triangles[t][(apex + 2) % 3]];
      sides.push_back({from < to ? from << 32 | to : to << 32 | from, t, apex, from < to});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const TriangleSide& a, const TriangleSide& b) {
    if (a.key != b.key) return a.key < b.key;
    if (a.forward != b.forward) return a.forward > b.forward;
    return a.triangle < b.triangle;
  });
  std::vector<CandidatePair> candidate_pairs;
  candidate_pairs.reserve(sides.size() / 2);
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    std::size_t first_backward = begin;
    while (end < sides.size() && sides[end].key == sides[begin].key) {
      if (sides[end++].forward) first_backward = end;
    }
    // At an edge of more than two triangles, the i-th half-edge of one orientation is paired with the i-th of the
    // other. The cost stays linear.
    for (std::size_t i = begin, j = first_backward; i < first_backward && j < end; ++i, ++j) {
      const TriangleSide& a = sides[i].triangle < sides[j].triangle ? sides[i] : sides[j];
      const TriangleSide& b = sides[i].triangle < sides[j].triangle ? sides[j] : sides[i];
      if (a.triangle == b.triangle) continue;
      const double cost = pair_stretch(shapes[a.triangle], a.apex, shapes[b.triangle], b.apex);
      if (!(cost <= kMaxStretch)) continue;
      candidate_pairs.push_back({static_cast<float>(cost), a.triangle, b.triangle, a.apex, b.apex});
    }
  }
  std::sort(candidate_pairs.begin(), candidate_pairs.end(),
            [](const CandidatePair& x, const CandidatePair& y) {
              if (x.stretch != y.stretch) return x.stretch < y.stretch;
              return x.a != y.a ? x.a < y.a : x.b != y.b ? x.b < y.b : x.apex_a < y.apex_a;
            });
  return candidate_pairs;
}

/// A matching that is improved along alternating paths. Odd cycles (blossoms) are not contracted, so a path may be
/// missed, which is rare in triangle meshes.
class TriangleMatching {
 public:
  TriangleMatching(std::size_t triangles, std::span<const CandidatePair> candidate_pairs)
      : candidate_pairs_(candidate_pairs),
        mate_(triangles, kNoIndex),
        pairs_of_triangle_(triangles, {kNoIndex, kNoIndex, kNoIndex}) {
    for (std::uint32_t i = 0; i < candidate_pairs.size(); ++i) {
      for (const std::uint32_t t : {candidate_pairs[i].a, candidate_pairs[i].b}) {
        const auto free_entry =
            std::find(pairs_of_triangle_[t].begin(), pairs_of_triangle_[t].end(), kNoIndex);
        // A triangle has three edges, so it belongs to at most three candidate pairs
        if (free_entry != pairs_of_triangle_[t].end()) *free_entry = i;
      }
    }
    for (std::uint32_t i = 0; i < candidate_pairs.size(); ++i) {
      if (mate_[candidate_pairs[i].a] == kNoIndex && mate_[candidate_pairs[i].b] == kNoIndex)
        join(i);
    }
  }

  /// Searches for an alternating path from each single triangle, breadth first.
  void augment() {
    std::vector<std::uint32_t> visited_from(mate_.size(), kNoIndex), queue, from;
    for (std::uint32_t root = 0; root < mate_.size(); ++root) {
      if (mate_[root] != kNoIndex || pairs_of_triangle_[root][0] == kNoIndex) continue;
      queue.assign(1, root);
      from.assign(1, kNoIndex);
      visited_from[root] = root;
      bool is_path_found = false;
      for (std::size_t head = 0;
           head < queue.size() && head < kMaxVisitedTriangles && !is_path_found; ++head) {
        for (const std::uint32_t pair : pairs_of_triangle_[queue[head]]) {
          if (pair == kNoIndex) break;
          const std::uint32_t other = triangle_across(pair, queue[head]);
          if (visited_from[other] == root) continue;
          visited_from[other] = root;
          if (mate_[other] == kNoIndex) {
            augment(pair, head, from);
            is_path_found = true;
            break;
          }
          const std::uint32_t next = triangle_across(mate_[other], other);
          if (visited_from[next] == root) continue;
          visited_from[next] = root;
          queue.push_back(next);
          from.push_back(static_cast<std::uint32_t>(head));
          pair_of_entry_.resize(std::max(pair_of_entry_.size(), queue.size()));
          pair_of_entry_[queue.size() - 1] = pair;
        }
      }
    }
  }

  const std::vector<std::uint32_t>& mate() const { return mate_; }

 private:
  /// Maximum number of triangles that the search from one single triangle visits.
  static constexpr std::size_t kMaxVisitedTriangles = 256;

  std::uint32_t triangle_across(std::uint32_t pair, std::uint32_t triangle) const {
    return candidate_pairs_[pair].a == triangle ? candidate_pairs_[pair].b
                                                : candidate_pairs_[pair].a;
  }
  void join(std::uint32_t pair) {
    mate_[candidate_pairs_[pair].a] = mate_[candidate_pairs_[pair].b] = pair;
  }

  void augment(std::uint32_t pair, std::size_t head, const std::vector<std::uint32_t>& from) {
    // Inverts the path from its far end to the root. join() makes a new pair of two triangles. One of them leaves its
    // previous mate, which the next step pairs anew.
    std::uint32_t at = static_cast<std::uint32_t>(head);
    std::uint32_t current = pair;
    while (true) {
      join(current);
      if (from[at] == kNoIndex) break;
      current = pair_of_entry_[at];
      at = from[at];
    }
  }

  std::span<const CandidatePair> candidate_pairs_;
  std::vector<std::uint32_t> mate_;  ///< Pair that each triangle belongs to; kNoIndex if single
  /// For each triangle, up to three candidate pairs that contain it, the least stretched first
  std::vector<std::array<std::uint32_t, 3>> pairs_of_triangle_;
  /// For each triangle in the queue, the pair over which the search reached it
  std::vector<std::uint32_t> pair_of_entry_;
};

}  // namespace

double stretch(double width, double height, double leg_u, double leg_v, double hypotenuse) {
  // First fundamental form of the map. Its eigenvalues are the squared singular values.
  const double e = leg_u / (width * width);
  const double g = leg_v / (height * height);
  const double f = 0.5 * (leg_u + leg_v - hypotenuse) / (width * height);
  const double mean = 0.5 * (e + g);
  const double root = std::sqrt(0.25 * (e - g) * (e - g) + f * f);
  const double determinant = std::max(e * g - f * f, 1e-12 * mean * mean);
  const double larger_eigenvalue = mean + root;
  const double log_large = 0.5 * std::log(larger_eigenvalue);
  const double log_small = 0.5 * std::log(determinant / larger_eigenvalue);
  return 0.5 * (log_large * log_large + log_small * log_small);
}

Pairing pair_triangles(std::span<const Vec3> positions, std::span<const Triangle> triangles,
                       std::span<const TriangleShape> shapes) {
  const std::vector<CandidatePair> candidate_pairs =
      find_candidate_pairs(positions, triangles, shapes);
  TriangleMatching triangle_matching(triangles.size(), candidate_pairs);
  triangle_matching.augment();

  Pairing result;
  result.partner.assign(triangles.size(), kNoIndex);
  result.apex.assign(triangles.size(), 0);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const std::uint32_t pair = triangle_matching.mate()[t];
    if (pair == kNoIndex) continue;
    const bool is_first = candidate_pairs[pair].a == t;
    result.partner[t] = is_first ? candidate_pairs[pair].b : candidate_pairs[pair].a;
    result.apex[t] = is_first ? candidate_pairs[pair].apex_a : candidate_pairs[pair].apex_b;
    result.pairs += is_first;
  }
  return result;
}

}  // namespace kiln
