#include "mesh/uv_copies.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unordered_map>

#include "mesh/charts.h"

namespace kiln {
namespace {

constexpr double kNear = 1e-4;
constexpr double kNearShare = 0.05;  // of the longest side
constexpr double kCells = 1024;      // a unit
constexpr double kFarthest = 1e6;    // whole numbers beyond are no tiles
constexpr std::array<std::array<std::size_t, 3>, 6> kOrders = {
    {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}}};

/// A triangle's UVs, moved by whole numbers so that their middle lies in the unit square.
struct Place {
  std::array<std::array<double, 2>, 3> uv{};
  std::array<double, 2> middle{}, offset{};
  double side = 0;  ///< The longest
  bool mirrored = false, usable = false;
};

Place place_of(const std::array<LowSurface::Corner, 3>& corners) {
  Place place;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    for (std::size_t k = 0; k < 3; ++k) {
      place.uv[k][axis] = axis == 0 ? corners[k].uv.x : corners[k].uv.y;
      place.middle[axis] += place.uv[k][axis] / 3;
    }
    if (!(std::abs(place.middle[axis]) < kFarthest)) return place;
    place.offset[axis] = std::floor(place.middle[axis]);
    place.middle[axis] -= place.offset[axis];
    for (auto& uv : place.uv) uv[axis] -= place.offset[axis];
  }
  const auto& [a, b, c] = place.uv;
  const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &p = place.uv[k], &q = place.uv[(k + 1) % 3];
    place.side = std::max(place.side, std::hypot(p[0] - q[0], p[1] - q[1]));
  }
  place.mirrored = area < 0;
  place.usable = area != 0;
  return place;
}

bool same(const Place& a, const Place& b) {
  const double near = std::min(kNear, kNearShare * std::min(a.side, b.side));
  return std::any_of(kOrders.begin(), kOrders.end(), [&](const auto& order) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto &p = a.uv[k], &q = b.uv[order[k]];
      if (!(std::abs(p[0] - q[0]) <= near && std::abs(p[1] - q[1]) <= near)) return false;
    }
    return true;
  });
}

/// Triangles by the middles of their UVs.
class Cells {
 public:
  /// The first of those put in that has the same UVs; none: the triangle itself.
  std::uint32_t find(const std::vector<Place>& places, std::uint32_t t) const {
    const Place& place = places[t];
    const auto low = cell(place.middle, -kNear), high = cell(place.middle, kNear);
    for (std::int64_t x = low[0]; x <= high[0]; ++x) {
      for (std::int64_t y = low[1]; y <= high[1]; ++y) {
        const auto found = cells_.find(key(x, y));
        if (found == cells_.end()) continue;
        for (const std::uint32_t other : found->second) {
          if (same(place, places[other])) return other;
        }
      }
    }
    return t;
  }

  void add(const std::vector<Place>& places, std::uint32_t t) {
    const auto [x, y] = cell(places[t].middle, 0);
    cells_[key(x, y)].push_back(t);
  }

 private:
  static std::array<std::int64_t, 2> cell(const std::array<double, 2>& middle, double off) {
    return {static_cast<std::int64_t>(std::floor((middle[0] + off) * kCells)),
            static_cast<std::int64_t>(std::floor((middle[1] + off) * kCells))};
  }
  static std::int64_t key(std::int64_t x, std::int64_t y) { return x * 65536 + y; }

  std::unordered_map<std::int64_t, std::vector<std::uint32_t>> cells_;
};

}  // namespace

void find_uv_copies(const Mesh& low, UvCopies rule, LowSurface& surface) {
  const auto count = static_cast<std::uint32_t>(surface.triangles.size());
  std::vector<Place> places(count);
  std::vector<std::uint32_t> order;
  Cells all;
  bool any = false;
  for (std::uint32_t t = 0; t < count; ++t) {
    if (surface.usable[t] == 0) continue;
    places[t] = place_of(surface.triangles[t]);
    if (!places[t].usable) continue;
    order.push_back(t);
    any = any || all.find(places, t) != t;
    all.add(places, t);
  }
  if (!any) return;
  const std::vector<std::uint32_t> chart = uv_charts(low);
  const auto rank = [&](std::uint32_t t) {
    const Place& place = places[t];
    const bool other = rule != UvCopies::first && place.mirrored != (rule == UvCopies::mirrored);
    const bool beside = place.offset[0] != 0 || place.offset[1] != 0;
    return std::tuple(other, beside, chart[t], t);
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return rank(a) < rank(b); });
  Cells baked;
  surface.copy_of.assign(count, LowSurface::kNoCopy);
  std::vector<std::uint8_t> shared(count);
  for (const std::uint32_t t : order) {
    const std::uint32_t first = baked.find(places, t);
    if (first == t) {
      baked.add(places, t);
      continue;
    }
    surface.copy_of[t] = first;
    shared[t] = shared[first] = 1;
  }
  for (std::uint32_t t = 0; t < count; ++t) {
    if (shared[t] == 0) continue;
    for (LowSurface::Corner& corner : surface.triangles[t]) {
      corner.uv.x -= static_cast<float>(places[t].offset[0]);
      corner.uv.y -= static_cast<float>(places[t].offset[1]);
    }
  }
}

}  // namespace kiln
