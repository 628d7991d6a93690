#include "mesh/two_sided.h"

#include <algorithm>
#include <array>

#include "mesh/vertex_lists.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// A neighbour within a sheet, and whether both triangles traverse the edge in the same direction.
struct Link {
  std::uint32_t to = TwoSided::kNone;
  bool is_turned = false;
};

std::vector<std::uint32_t> find_twins(std::span<const Triangle> welded, std::size_t vertices) {
  const auto rotated = [&](std::size_t t) { return lowest_first(welded[t]); };
  const VertexLists triangles_by_vertex(
      vertices, welded.size(), [&](std::size_t t) { return rotated(t)[0]; },
      [&](std::size_t t) {
        const Triangle v = rotated(t);
        return std::uint64_t{std::min(v[1], v[2])} << 32 | std::max(v[1], v[2]);
      });
  std::vector<std::uint32_t> twins;
  for (std::size_t v = 0; v < vertices; ++v) {
    const std::span<const VertexLists::Item> items = triangles_by_vertex.of(v);
    for (std::size_t begin = 0, end = 0; begin < items.size(); begin = end) {
      while (end < items.size() && items[end].key == items[begin].key) ++end;
      if (end - begin != 2) continue;
      const std::uint32_t a = items[begin].index, b = items[begin + 1].index;
      if (rotated(a)[1] != rotated(b)[2] || rotated(a)[1] == rotated(b)[1]) continue;
      if (twins.empty()) twins.assign(welded.size(), TwoSided::kNone);
      twins[a] = b;
      twins[b] = a;
    }
  }
  return twins;
}

/// For each triangle, its neighbours across its three edges. An edge has a neighbour if exactly two triangles share it.
std::vector<std::array<Link, 3>> neighbour_links_of(const std::vector<Triangle>& triangles,
                                                    std::size_t vertices) {
  std::vector<std::array<Link, 3>> neighbour_links(triangles.size());
  SideLists(triangles, vertices)
      .each_edge([&](std::uint32_t, std::span<const SideLists::Item> sides) {
        if (sides.size() != 2) return;
        const bool is_turned = SideLists::forward(sides[0]) == SideLists::forward(sides[1]);
        for (std::size_t i = 0; i < 2; ++i) {
          neighbour_links[sides[i].index / 3][sides[i].index % 3] = {sides[1 - i].index / 3,
                                                                     is_turned};
        }
      });
  return neighbour_links;
}

}  // namespace

TwoSided TwoSided::of(std::span<const Triangle> welded, std::size_t vertices) {
  TwoSided result{find_twins(welded, vertices), {}, {}};
  if (result.empty()) return result;
  // One triangle of each pair, and all triangles without a twin.
  std::vector<std::uint32_t> source_triangles;
  std::vector<Triangle> kept_triangles;
  for (std::uint32_t t = 0; t < welded.size(); ++t) {
    if (result.twins[t] < t) continue;
    source_triangles.push_back(t);
    kept_triangles.push_back(welded[t]);
  }
  const std::vector<std::array<Link, 3>> neighbour_links =
      neighbour_links_of(kept_triangles, vertices);
  std::vector<std::uint8_t> is_oriented(kept_triangles.size(), 0),
      is_turned(kept_triangles.size(), 0);
  std::vector<std::uint32_t> next;
  const auto spread_from = [&](std::uint32_t first) {
    is_oriented[first] = 1;
    next.push_back(first);
    while (!next.empty()) {
      const std::uint32_t at = next.back();
      next.pop_back();
      for (const Link& link : neighbour_links[at]) {
        if (link.to == kNone || is_oriented[link.to] != 0) continue;
        is_oriented[link.to] = 1;
        is_turned[link.to] = is_turned[at] ^ (link.is_turned ? 1 : 0);
        next.push_back(link.to);
      }
    }
  };
  const auto is_pair = [&](std::uint32_t i) { return result.twins[source_triangles[i]] != kNone; };
  for (std::uint32_t i = 0; i < kept_triangles.size(); ++i) is_oriented[i] = is_pair(i) ? 0 : 1;
  for (std::uint32_t i = 0; i < kept_triangles.size(); ++i) {
    if (!is_pair(i)) spread_from(i);
  }
  result.backs.assign(welded.size(), 0);
  result.has_only_pairs = result.backs;
  const std::vector<std::uint8_t> has_unpaired_neighbour = is_oriented;
  for (std::uint32_t i = 0; i < kept_triangles.size(); ++i) {
    if (!is_pair(i)) continue;
    if (is_oriented[i] == 0) spread_from(i);
    const std::uint32_t one = source_triangles[i], other = result.twins[one];
    result.backs[is_turned[i] != 0 ? one : other] = 1;
    result.has_only_pairs[one] = result.has_only_pairs[other] = has_unpaired_neighbour[i] == 0;
  }
  return result;
}

TwoSided TwoSided::of(const Mesh& mesh) {
  return of(welded_triangles(mesh), mesh.positions.size());
}

}  // namespace kiln
