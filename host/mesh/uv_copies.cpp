#include "mesh/uv_copies.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mesh/charts.h"
#include "mesh/uv_squares.h"

namespace kiln {
namespace {

// A copy must be covered by baked triangles except for at most this share of its area.
constexpr double kMaxUncovered = 1e-3;
constexpr std::size_t kMaxCoverTriangles =
    64;  // Maximum number of baked triangles that may cover a copy in another triangulation
constexpr std::array<std::array<std::size_t, 3>, 6> kCornerOrders = {
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};

bool are_same_corners(const UvPlace& a, const UvPlace& b) {
  const double tolerance = std::min(a.tolerance(), b.tolerance());
  return std::any_of(kCornerOrders.begin(), kCornerOrders.end(), [&](const auto& order) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (!are_near(a.uv[k], b.uv[order[k]], tolerance)) return false;
    }
    return true;
  });
}

/// Finds the baked triangles that cover a triangle. This is one triangle with the same corners, or, if the polygon is
/// triangulated differently, several triangles that cover it without overlap and whose corners include all of its
/// corners. The search starts with the triangle at its centroid, and continues from corner to corner.
class CoverFinder {
 public:
  CoverFinder(const std::vector<UvPlace>& uv_places, const UvSquares& baked_squares)
      : places_(uv_places), baked_(baked_squares) {}

  /// The triangles that cover `t`, the one with the largest share first. Empty if they do not cover it completely.
  const std::vector<std::uint32_t>& of(std::uint32_t t) {
    covering_.clear();
    const bool twin = baked_.any_match_at(places_[t].middle, [&](std::uint32_t is_not_preferred) {
      if (!are_same_corners(places_[t], places_[is_not_preferred])) return false;
      covering_.push_back(is_not_preferred);
      return true;
    });
    if (!twin && !collect_covering(t)) covering_.clear();
    return covering_;
  }

 private:
  bool collect_covering(std::uint32_t t) {
    covered_uvs_ = places_[t].uv;
    if (!add_covering(t, places_[t].middle) || !snap_corners(t)) return false;
    for (std::size_t i = 0; i < covering_.size(); ++i) {
      for (const UvPosition& corner : places_[covering_[i]].uv) {
        if (!add_covering(t, corner)) return false;
      }
    }
    double area_sum = 0, largest_area = 0;
    const double area = shared_area(covered_uvs_, covered_uvs_);
    for (std::uint32_t& triangle : covering_) {
      const double share = shared_area(covered_uvs_, places_[triangle].uv);
      area_sum += share;
      if (share <= largest_area) continue;
      largest_area = share;
      std::swap(covering_[0], triangle);
    }
    return std::abs(area_sum - area) <= kMaxUncovered * area;
  }

  /// Adds the triangles at a point that overlap `t`.
  /// \returns false if there are too many
  bool add_covering(std::uint32_t t, const UvPosition& point) {
    return !baked_.any_match_at(point, [&](std::uint32_t is_not_preferred) {
      const UvPlace& place = places_[is_not_preferred];
      const double tolerance = std::min(place.tolerance(), places_[t].tolerance());
      const bool at = place.contains(point) ||
                      std::any_of(place.uv.begin(), place.uv.end(), [&](const UvPosition& corner) {
                        return are_near(corner, point, tolerance);
                      });
      if (!at || std::find(covering_.begin(), covering_.end(), is_not_preferred) != covering_.end())
        return false;
      const double smaller_area = std::min(std::abs(place.area), std::abs(places_[t].area));
      if (shared_area(covered_uvs_, place.uv) <= kMaxUncovered * smaller_area) return false;
      covering_.push_back(is_not_preferred);
      return covering_.size() > kMaxCoverTriangles;
    });
  }

  /// Moves the corners of the outline to the nearest corners of baked triangles.
  /// \returns false if there is no such corner near one of them
  bool snap_corners(std::uint32_t t) {
    for (UvPosition& corner : covered_uvs_) {
      const bool is_found = baked_.any_match_at(corner, [&](std::uint32_t is_not_preferred) {
        const UvPlace& place = places_[is_not_preferred];
        const double tolerance = std::min(place.tolerance(), places_[t].tolerance());
        const auto* const at =
            std::find_if(place.uv.begin(), place.uv.end(),
                         [&](const UvPosition& uv) { return are_near(uv, corner, tolerance); });
        if (at == place.uv.end()) return false;
        corner = *at;
        return true;
      });
      if (!is_found) return false;
    }
    return true;
  }

  const std::vector<UvPlace>& places_;
  const UvSquares& baked_;
  std::array<UvPosition, 3> covered_uvs_{};
  std::vector<std::uint32_t> covering_;
};

/// The triangles whose UV centroid lies in another triangle, in order. All other triangles are added to the grid.
std::vector<std::uint32_t> overlapping(const std::vector<UvPlace>& uv_places, UvSquares& others) {
  const auto count = static_cast<std::uint32_t>(uv_places.size());
  UvSquares all(uv_places);
  for (std::uint32_t t = 0; t < count; ++t) all.add(t);
  std::vector<std::uint32_t> result;
  for (std::uint32_t t = 0; t < count; ++t) {
    const bool is_inside =
        all.any_match_at(uv_places[t].middle, [&](std::uint32_t is_not_preferred) {
          return is_not_preferred != t && uv_places[is_not_preferred].contains(uv_places[t].middle);
        });
    if (is_inside) result.push_back(t);
  }
  if (result.empty()) return result;
  for (std::uint32_t t = 0, next = 0; t < count; ++t) {
    const bool overlaps = next < result.size() && result[next] == t;
    next += overlaps ? 1 : 0;
    if (!overlaps) others.add(t);
  }
  return result;
}

}  // namespace

void find_uv_copies(const Mesh& low, UvCopies rule, LowSurface& surface) {
  const std::size_t count = surface.triangles.size();
  std::vector<UvPlace> uv_places;                // UV places of the usable triangles
  std::vector<std::uint32_t> triangle_of_place;  // Triangle of each item of `uv_places`
  for (const std::uint32_t t : surface.with_uvs) {
    if (surface.usable[t] == 0) continue;
    const UvPlace place = UvPlace::of(surface.triangles[t]);
    if (place.area == 0) continue;
    uv_places.push_back(place);
    triangle_of_place.push_back(t);
  }
  UvSquares baked_squares(uv_places);
  std::vector<std::uint32_t> order = overlapping(uv_places, baked_squares);
  if (order.empty()) return;
  const std::vector<std::uint32_t> chart = uv_charts(low, surface.with_uvs);
  std::vector<std::uint64_t> rank(uv_places.size());
  for (const std::uint32_t i : order) {
    const UvPlace& place = uv_places[i];
    const bool is_mirrored = place.area < 0;
    const bool is_not_preferred =
        rule != UvCopies::first && is_mirrored != (rule == UvCopies::mirrored);
    const bool is_shifted = place.offset[0] != 0 || place.offset[1] != 0;
    rank[i] = (is_not_preferred ? 2ULL << 32U : 0) + (is_shifted ? 1ULL << 32U : 0) +
              chart[triangle_of_place[i]];
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::uint32_t a, std::uint32_t b) { return rank[a] < rank[b]; });
  std::vector<std::uint32_t> copy_of(count, LowSurface::kNoCopy);
  std::vector<std::uint8_t> is_shared(uv_places.size());
  CoverFinder cover_finder(uv_places, baked_squares);
  bool any = false;
  for (const std::uint32_t i : order) {
    const std::vector<std::uint32_t>& covering = cover_finder.of(i);
    if (covering.empty()) {
      baked_squares.add(i);
      continue;
    }
    any = true;
    copy_of[triangle_of_place[i]] = triangle_of_place[covering[0]];
    is_shared[i] = 1;
    for (const std::uint32_t is_not_preferred : covering) is_shared[is_not_preferred] = 1;
  }
  if (!any) return;
  surface.copy_of = std::move(copy_of);
  for (std::size_t i = 0; i < uv_places.size(); ++i) {
    if (is_shared[i] == 0) continue;
    for (LowSurface::Corner& corner : surface.triangles[triangle_of_place[i]]) {
      corner.uv.x -= static_cast<float>(uv_places[i].offset[0]);
      corner.uv.y -= static_cast<float>(uv_places[i].offset[1]);
    }
  }
}

}  // namespace kiln
