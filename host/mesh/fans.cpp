#include "mesh/fans.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/disjoint_sets.h"

namespace kiln {
namespace {

struct Side {
  std::uint64_t key;  ///< The edge: its lower and its higher vertex in one number
  std::uint32_t triangle;
  /// `corner`: the corner at which the side starts; `forward`: 1 if that is the edge's lower vertex
  std::uint8_t corner, forward;
};

std::vector<Side> sorted_sides(std::span<const Triangle> triangles) {
  std::vector<Side> triangle_sides;
  triangle_sides.reserve(triangles.size() * 3);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::uint8_t k = 0; k < 3; ++k) {
      const std::uint64_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      triangle_sides.push_back({a < b ? a << 32 | b : b << 32 | a, t, k, a < b});
    }
  }
  std::sort(triangle_sides.begin(), triangle_sides.end(), [](const Side& a, const Side& b) {
    if (a.key != b.key) return a.key < b.key;
    if (a.forward != b.forward) return a.forward > b.forward;
    return a.triangle != b.triangle ? a.triangle < b.triangle : a.corner < b.corner;
  });
  return triangle_sides;
}

}  // namespace

bool has_repeated_sides(std::span<const Triangle> triangles) {
  std::uint32_t last = 0;
  for (const Triangle& t : triangles) last = std::max({last, t[0], t[1], t[2]});
  return has_repeated_sides(SideLists(triangles, std::size_t{last} + 1));
}

bool has_repeated_sides(const SideLists& lists) {
  for (std::size_t v = 0; v < lists.vertices(); ++v) {
    const std::span<const SideLists::Item> vertex_sides = lists.of(v);
    for (std::size_t i = 1; i < vertex_sides.size(); ++i) {
      if (vertex_sides[i].key == vertex_sides[i - 1].key) return true;
    }
  }
  return false;
}

void remove_back_to_back(std::vector<Triangle>& triangles) {
  struct SortedTriangle {
    Triangle sorted_corners;
    std::uint32_t index;
    std::uint8_t is_odd_order;  ///< Parity of the permutation that sorts the corners
  };
  std::vector<SortedTriangle> sorted_triangles;
  sorted_triangles.reserve(triangles.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    Triangle v = triangles[t];
    bool is_odd_order = false;
    for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{0, 1}}) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      if (v[a] > v[b]) {
        std::swap(v[a], v[b]);
        is_odd_order = !is_odd_order;
      }
    }
    sorted_triangles.push_back({v, t, is_odd_order});
  }
  std::sort(sorted_triangles.begin(), sorted_triangles.end(),
            [](const SortedTriangle& a, const SortedTriangle& b) {
              return a.sorted_corners != b.sorted_corners ? a.sorted_corners < b.sorted_corners
                     : a.is_odd_order != b.is_odd_order   ? a.is_odd_order < b.is_odd_order
                                                          : a.index < b.index;
            });
  std::vector<std::uint8_t> is_removed(triangles.size(), 0);
  for (std::size_t begin = 0, end = 0; begin < sorted_triangles.size(); begin = end) {
    std::size_t first_odd_order = begin;
    while (end < sorted_triangles.size() &&
           sorted_triangles[end].sorted_corners == sorted_triangles[begin].sorted_corners) {
      if (!sorted_triangles[end++].is_odd_order) first_odd_order = end;
    }
    for (std::size_t i = begin, j = first_odd_order; i < first_odd_order && j < end; ++i, ++j) {
      is_removed[sorted_triangles[i].index] = is_removed[sorted_triangles[j].index] = 1;
    }
  }
  std::size_t kept_count = 0;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    if (!is_removed[t]) triangles[kept_count++] = triangles[t];
  }
  triangles.resize(kept_count);
}

std::vector<std::uint32_t> split_into_fans(std::span<Triangle> triangles, std::size_t vertices) {
  constexpr auto kNone = static_cast<std::uint32_t>(-1);
  constexpr int kMaxPairingAttempts = 4;
  const std::vector<Triangle> old_triangles(triangles.begin(), triangles.end());
  const std::vector<Side> triangle_sides = sorted_sides(old_triangles);
  const auto corner = [](const Side& side, std::uint32_t offset) {
    return side.triangle * 3 + (side.corner + offset) % 3;
  };
  // Edges whose forward side i is paired with backward side i + shift instead of i. The shift of an edge is the number
  // of times it is listed here
  std::vector<std::uint64_t> shifted_edges;
  std::vector<std::uint32_t> original_vertices;
  for (int attempt = 0; attempt < kMaxPairingAttempts; ++attempt) {
    // Disjoint sets of corners: two corners of a vertex are united if their triangles are joined along a side.
    DisjointSets fans(old_triangles.size() * 3);
    for (std::size_t begin = 0, end = 0; begin < triangle_sides.size(); begin = end) {
      std::size_t first_backward_side = begin;
      while (end < triangle_sides.size() && triangle_sides[end].key == triangle_sides[begin].key) {
        if (triangle_sides[end++].forward) first_backward_side = end;
      }
      const std::size_t pairs = std::min(first_backward_side - begin, end - first_backward_side);
      if (pairs == 0) continue;
      const auto repeats =
          std::equal_range(shifted_edges.begin(), shifted_edges.end(), triangle_sides[begin].key);
      const auto shift = static_cast<std::size_t>(repeats.second - repeats.first);
      for (std::size_t i = 0; i < pairs; ++i) {
        const Side& forward_side = triangle_sides[begin + i];
        const Side& backward_side =
            triangle_sides[first_backward_side + (i + shift) % (end - first_backward_side)];
        fans.join(corner(forward_side, 0), corner(backward_side, 1));
        fans.join(corner(forward_side, 1), corner(backward_side, 0));
      }
    }
    // The first fan of a vertex keeps the vertex itself.
    std::vector<std::uint32_t> first_fan(vertices, kNone),
        fan_vertex(old_triangles.size() * 3, kNone);
    original_vertices.clear();
    for (std::uint32_t c = 0; c < old_triangles.size() * 3; ++c) {
      const std::uint32_t vertex = old_triangles[c / 3][c % 3];
      const std::uint32_t fan = fans.find(c);
      if (fan_vertex[fan] == kNone) {
        if (first_fan[vertex] == kNone) {
          first_fan[vertex] = fan;
          fan_vertex[fan] = vertex;
        } else {
          fan_vertex[fan] = static_cast<std::uint32_t>(vertices + original_vertices.size());
          original_vertices.push_back(vertex);
        }
      }
      triangles[c / 3][c % 3] = fan_vertex[fan];
    }
    // If a fan contains an edge twice, the next attempt pairs the sides of this edge with a larger shift.
    const std::vector<Side> check = sorted_sides(triangles);
    const std::size_t before = shifted_edges.size();
    const auto original = [&](std::uint64_t v) {
      return v < vertices ? v : original_vertices[v - vertices];
    };
    for (std::size_t i = 1; i < check.size(); ++i) {
      if (check[i].key != check[i - 1].key || check[i].forward != check[i - 1].forward) continue;
      const std::uint64_t a = original(check[i].key >> 32), b = original(check[i].key & kNone);
      shifted_edges.push_back(a < b ? a << 32 | b : b << 32 | a);
    }
    if (shifted_edges.size() == before) break;
    std::sort(shifted_edges.begin() + static_cast<std::ptrdiff_t>(before), shifted_edges.end());
    shifted_edges.erase(std::unique(shifted_edges.begin() + static_cast<std::ptrdiff_t>(before),
                                    shifted_edges.end()),
                        shifted_edges.end());
    std::sort(shifted_edges.begin(), shifted_edges.end());
  }
  return original_vertices;
}

std::uint64_t count_components(std::span<const Triangle> triangles, std::size_t vertices) {
  DisjointSets sets(vertices);
  std::vector<std::uint8_t> used(vertices, 0);
  for (const Triangle& t : triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[1], t[2]);
    for (const std::uint32_t vertex : t) used[vertex] = 1;
  }
  std::uint64_t count = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) count += used[v] && sets.find(v) == v;
  return count;
}

}  // namespace kiln
