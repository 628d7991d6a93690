// Items in lists by vertex: what to use in place of sorting millions of sides.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "kiln/types.h"

namespace kiln {

/// A triangle turned so that its lowest corner comes first: equal for those of the same corners and sense.
inline Triangle lowest_first(Triangle corners) {
  std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
  return corners;
}

/// Items in lists, one list a vertex, each in order of key, then of index. Counted and dealt out, then every
/// list is sorted by itself, on all threads: a few times as fast as one sort of all.
class VertexLists {
 public:
  struct Item {
    std::uint64_t key;
    std::uint32_t index;
  };

  /// \param count   items, numbered from 0
  /// \param vertex  of an item: below `vertices`
  /// \param key     of an item
  template <class Vertex, class Key>
  VertexLists(std::size_t vertices, std::size_t count, const Vertex& vertex, const Key& key)
      : start_(vertices + 1, 0), items_(count) {
    for (std::size_t i = 0; i < count; ++i) ++start_[vertex(i)];
    std::uint32_t sum = 0;
    for (std::uint32_t& first : start_) first = sum += first;  // Where the list ends, for now.
    for (std::size_t i = count; i-- > 0;) {
      items_[--start_[vertex(i)]] = {key(i), static_cast<std::uint32_t>(i)};
    }
    constexpr std::size_t kListsOfPiece = std::size_t{1} << 14;
    parallel_for(vertices, kListsOfPiece, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        std::sort(items_.begin() + start_[v], items_.begin() + start_[v + 1],
                  [](const Item& a, const Item& b) {
                    return a.key != b.key ? a.key < b.key : a.index < b.index;
                  });
      }
    });
  }

  std::size_t vertices() const { return start_.size() - 1; }
  std::span<const Item> of(std::size_t vertex) const {
    return {items_.data() + start_[vertex], items_.data() + start_[vertex + 1]};
  }

 private:
  std::vector<std::uint32_t> start_;
  std::vector<Item> items_;
};

/// Sides of triangles by the lower vertex of their edge; item i is the side of triangle i / 3 that starts at
/// corner i % 3. Those of one edge follow each other, and of these the ones that start at the lower vertex
/// come first.
class SideLists : public VertexLists {
 public:
  SideLists(std::span<const Triangle> triangles, std::size_t vertices)
      : VertexLists(
            vertices, triangles.size() * 3,
            [&](std::size_t i) { return std::min(from(triangles, i), to(triangles, i)); },
            [&](std::size_t i) {
              const std::uint64_t a = from(triangles, i), b = to(triangles, i);
              return std::max(a, b) << 1 | (a > b);
            }) {}

  static std::uint32_t higher(const Item& side) {
    return static_cast<std::uint32_t>(side.key >> 1);
  }
  static bool forward(const Item& side) { return (side.key & 1) == 0; }

  /// Calls `body` with the lower vertex and the sides of each edge, in order of the edges' vertices.
  template <class Body>
  void each_edge(const Body& body) const {
    for (std::size_t v = 0; v < vertices(); ++v) {
      const std::span<const Item> sides = of(v);
      for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
        while (end < sides.size() && higher(sides[end]) == higher(sides[begin])) ++end;
        body(static_cast<std::uint32_t>(v), sides.subspan(begin, end - begin));
      }
    }
  }

 private:
  static std::uint32_t from(std::span<const Triangle> triangles, std::size_t i) {
    return triangles[i / 3][i % 3];
  }
  static std::uint32_t to(std::span<const Triangle> triangles, std::size_t i) {
    return triangles[i / 3][(i + 1) % 3];
  }
};

}  // namespace kiln
