#include "volume/short_edges.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace kiln {
namespace {

constexpr std::uint32_t kNoCorner = 0xFFFFFFFF;

std::size_t count_sides(const PolygonCorners& p) { return p[3] == kNoCorner ? 3 : 4; }

bool has_corner(const PolygonCorners& p, std::uint32_t vertex) {
  return std::find(p.begin(), p.end(), vertex) != p.end();
}

bool has_side(const PolygonCorners& p, std::uint32_t a, std::uint32_t b) {
  for (std::size_t k = 0, n = count_sides(p); k < n; ++k) {
    const std::uint32_t c = p[k], d = p[(k + 1) % n];
    if ((c == a && d == b) || (c == b && d == a)) return true;
  }
  return false;
}

class ZeroEdgeCollapser {
 public:
  explicit ZeroEdgeCollapser(std::vector<PolygonCorners>& polygons) : polygons_(polygons) {}

  void add_candidate(std::uint32_t vertex) { polygons_around_.try_emplace(vertex); }
  void collect_polygons() {
    for (std::uint32_t i = 0; i < polygons_.size(); ++i) {
      for (const std::uint32_t corner : polygons_[i]) {
        if (corner == kNoCorner) continue;
        const auto at = polygons_around_.find(corner);
        if (at != polygons_around_.end()) at->second.push_back(i);
      }
    }
  }
  std::uint32_t find_representative(std::uint32_t vertex) const {
    for (auto at = merged_into_.find(vertex); at != merged_into_.end();
         at = merged_into_.find(vertex)) {
      vertex = at->second;
    }
    return vertex;
  }
  /// \returns true if the edge was collapsed
  bool collapse(std::uint32_t a, std::uint32_t b) {
    std::vector<std::uint32_t>& at_a = polygons_around_.at(a);
    const std::vector<std::uint32_t>& at_b = polygons_around_.at(b);
    std::vector<std::uint32_t> shared_polygons, apexes, near_a, near_b, common;
    for (const std::uint32_t i : at_a) {
      if (has_corner(polygons_[i], b)) shared_polygons.push_back(i);
    }
    if (shared_polygons.size() != 2) return false;
    for (const std::uint32_t i : shared_polygons) {
      const PolygonCorners& p = polygons_[i];
      if (!has_side(p, a, b)) return false;
      if (count_sides(p) == 4) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        if (p[k] != a && p[k] != b) apexes.push_back(p[k]);
      }
    }
    if (apexes.size() == 2 && apexes[0] == apexes[1]) return false;
    if (at_border(a, at_a) && at_border(b, at_b)) return false;
    const auto neighbours = [&](std::uint32_t v, const std::vector<std::uint32_t>& around,
                                std::vector<std::uint32_t>& near) {
      for (const std::uint32_t i : around) {
        if (i == shared_polygons[0] || i == shared_polygons[1]) continue;
        for (const std::uint32_t corner : polygons_[i]) {
          if (corner != kNoCorner && corner != v) near.push_back(corner);
        }
      }
      std::sort(near.begin(), near.end());
      near.erase(std::unique(near.begin(), near.end()), near.end());
    };
    neighbours(a, at_a, near_a);
    neighbours(b, at_b, near_b);
    // Merging the two would leave a vertex without polygons.
    if (near_a.empty() || near_b.empty()) return false;
    std::set_intersection(near_a.begin(), near_a.end(), near_b.begin(), near_b.end(),
                          std::back_inserter(common));
    for (const std::uint32_t vertex : common) {
      if (std::find(apexes.begin(), apexes.end(), vertex) == apexes.end()) return false;
    }
    for (const std::uint32_t i : at_b) {
      PolygonCorners& p = polygons_[i];
      if (i != shared_polygons[0] && i != shared_polygons[1]) {
        std::replace(p.begin(), p.end(), b, a);
        at_a.push_back(i);
        continue;
      }
      const bool was_quad = count_sides(p) == 4;
      std::rotate(std::find(p.begin(), p.end(), b), std::find(p.begin(), p.end(), b) + 1, p.end());
      if (was_quad) {
        p[3] = kNoCorner;  // Now a triangle: the corners of the quad without b, in order
      } else {
        p = {kNoCorner, kNoCorner, kNoCorner, kNoCorner};
      }
    }
    std::erase_if(at_a, [&](std::uint32_t i) { return polygons_[i][0] == kNoCorner; });
    for (const std::uint32_t apex : apexes) {
      const auto at = polygons_around_.find(apex);
      if (at == polygons_around_.end()) continue;
      std::erase_if(at->second, [&](std::uint32_t i) { return polygons_[i][0] == kNoCorner; });
    }
    merged_into_[b] = a;
    polygons_around_.erase(b);
    return true;
  }

 private:
  /// True if one of the polygons has a side at the vertex that no other polygon shares.
  bool at_border(std::uint32_t vertex, const std::vector<std::uint32_t>& around) const {
    std::vector<std::uint32_t> ends;
    for (const std::uint32_t i : around) {
      const PolygonCorners& p = polygons_[i];
      for (std::size_t k = 0, n = count_sides(p); k < n; ++k) {
        if (p[k] != vertex) continue;
        ends.push_back(p[(k + 1) % n]);
        ends.push_back(p[(k + n - 1) % n]);
      }
    }
    return std::any_of(ends.begin(), ends.end(), [&](std::uint32_t end) {
      return std::count(ends.begin(), ends.end(), end) == 1;
    });
  }

  std::vector<PolygonCorners>& polygons_;
  // The polygons around each candidate vertex
  std::unordered_map<std::uint32_t, std::vector<std::uint32_t>> polygons_around_;
  std::unordered_map<std::uint32_t, std::uint32_t> merged_into_;
};

}  // namespace

bool same_place(const Vec3& a, const Vec3& b) {
  constexpr float kRelativeRounding = 0x1p-22F;
  const auto same = [](float x, float y) {
    return std::abs(x - y) <= kRelativeRounding * std::max(std::abs(x), std::abs(y));
  };
  return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> collapse_short_edges(
    std::vector<PolygonCorners>& polygons, const std::function<Vec3(std::uint32_t)>& at,
    std::uint32_t count) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, result;
  ZeroEdgeCollapser collapser(polygons);
  for (const PolygonCorners& p : polygons) {
    std::array<Vec3, 4> places;
    const std::size_t n = count_sides(p);
    for (std::size_t k = 0; k < n; ++k) {
      if (p[k] < count) places[k] = at(p[k]);
    }
    for (std::size_t k = 0; k < n; ++k) {
      if (p[k] >= count || p[(k + 1) % n] >= count) continue;
      if (!same_place(places[k], places[(k + 1) % n])) continue;
      edges.emplace_back(std::min(p[k], p[(k + 1) % n]), std::max(p[k], p[(k + 1) % n]));
      collapser.add_candidate(p[k]);
      collapser.add_candidate(p[(k + 1) % n]);
    }
  }
  if (edges.empty()) return result;
  collapser.collect_polygons();
  // Repeats the pass over all polygons, since one collapse may make another possible.
  for (bool changed = true; changed;) {
    changed = false;
    for (const auto& [first, second] : edges) {
      const auto [a, b] = std::minmax(
          {collapser.find_representative(first), collapser.find_representative(second)});
      if (a != b && collapser.collapse(a, b)) changed = true;
    }
  }
  std::erase_if(polygons, [](const PolygonCorners& p) { return p[0] == kNoCorner; });
  for (const auto& [first, second] : edges) {
    for (const std::uint32_t vertex : {first, second}) {
      const std::uint32_t representative_vertex = collapser.find_representative(vertex);
      if (representative_vertex != vertex) result.emplace_back(vertex, representative_vertex);
    }
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace kiln
