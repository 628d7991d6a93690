#include "simplify/mesh_pieces.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "base/parallel.h"
#include "mesh/box.h"

namespace kiln {
namespace {

struct TriangleCentre {
  float x, y, z;
  std::uint32_t triangle;
};

/// Splits a list into halves across the longest side of its bounding box.
void halve_items(std::span<TriangleCentre> items) {
  Box<Vec3> box;
  for (const TriangleCentre& p : items) box.add({p.x, p.y, p.z});
  const auto& [low, high] = box;
  const float x = high.x - low.x, y = high.y - low.y, z = high.z - low.z;
  const auto axis = x >= y && x >= z ? &TriangleCentre::x
                    : y >= z         ? &TriangleCentre::y
                                     : &TriangleCentre::z;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(items.size() / 2),
                   items.end(), [axis](const TriangleCentre& p, const TriangleCentre& q) {
                     return p.*axis != q.*axis ? p.*axis < q.*axis : p.triangle < q.triangle;
                   });
}

}  // namespace

std::vector<std::vector<std::uint32_t>> pieces_of(std::span<const Vec3> positions,
                                                  std::span<const Triangle> triangles,
                                                  std::size_t least) {
  std::vector<TriangleCentre> items(triangles.size());
  for (std::uint32_t t = 0; t < items.size(); ++t) {
    const Vec3& corner = positions[triangles[t][0]];
    items[t] = {corner.x, corner.y, corner.z, t};
  }
  std::vector<std::span<TriangleCentre>> pieces{items};
  while (pieces[0].size() / 2 >= least) {
    parallel_for(pieces.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) halve_items(pieces[i]);
    });
    std::vector<std::span<TriangleCentre>> halves;
    for (const std::span<TriangleCentre> piece : pieces) {
      halves.push_back(piece.first(piece.size() / 2));
      halves.push_back(piece.subspan(piece.size() / 2));
    }
    pieces = std::move(halves);
  }
  std::vector<std::vector<std::uint32_t>> result(pieces.size());
  parallel_for(result.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      result[i].reserve(pieces[i].size());
      for (const TriangleCentre& item : pieces[i]) result[i].push_back(item.triangle);
      std::sort(result[i].begin(), result[i].end());
    }
  });
  return result;
}

std::vector<std::uint8_t> vertices_between_pieces(
    const std::vector<std::vector<std::uint32_t>>& pieces, std::span<const Triangle> triangles,
    std::size_t vertices) {
  constexpr auto kNone = static_cast<std::uint32_t>(-1);
  std::vector<std::uint32_t> piece_of(vertices, kNone);
  std::vector<std::uint8_t> is_between_pieces(vertices, 0);
  for (std::uint32_t i = 0; i < pieces.size(); ++i) {
    for (const std::uint32_t t : pieces[i]) {
      for (const std::uint32_t v : triangles[t]) {
        if (piece_of[v] == kNone) piece_of[v] = i;
        if (piece_of[v] != i) is_between_pieces[v] = 1;
      }
    }
  }
  return is_between_pieces;
}

}  // namespace kiln
