// Finds superfluous triangles: floaters, and parts that are invisible from outside.
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/disjoint_sets.h"
#include "clean/outside_views.h"
#include "clean/steps.h"
#include "clean/triangle_list.h"
#include "mesh/weld.h"

namespace kiln {
namespace {

/// Largest share of the area that may be removed as floaters; a larger share is assumed to be intended.
constexpr double kMaxFloaterShare = 0.1;
/// Largest number of grid cells that triangles touch, which bounds the time.
constexpr double kMaxTouchedCells = 8e6;
/// If the largest body's diagonal is below this share of the box, the search is repeated at that body's scale, up to
/// kMaxScales times.
constexpr double kMaxRescaleShare = 0.5;
constexpr int kMaxScales = 4;

/// Pixels that a part must cover in all views to count as hidden.
constexpr std::uint32_t kMinHiddenPixels = 256;
/// The first views have no back faces, so that least is occluded; the later ones have back faces, for leaves of which
/// only the back is visible. The first 32 directions are drawn in rounds: each round shows most of the remaining
/// parts, which are not counted in later rounds.
constexpr std::array<OutsideViews, 6> kViews{{{.step = 8, .first = 0, .backs = false},
                                              {.step = 8, .first = 4, .backs = false},
                                              {.step = 4, .first = 2, .backs = false},
                                              {.step = 2, .first = 1, .backs = false},
                                              {},
                                              {.count = 64, .backs = false}}};

/// Components over shared vertices, numbered in order.
struct SharedParts {
  std::vector<std::uint32_t> of;
  std::size_t count = 0;

  explicit SharedParts(const Mesh& mesh) : of(mesh.triangles.size()) {
    const std::vector<Triangle> corners = welded_triangles(mesh);
    DisjointSets sets(mesh.positions.size());
    for (const Triangle& t : corners) {
      sets.join(t[0], t[1]);
      sets.join(t[1], t[2]);
    }
    // Index of each vertex's component + 1; 0: none yet
    std::vector<std::uint32_t> number(mesh.positions.size(), 0);
    for (std::size_t t = 0; t < of.size(); ++t) {
      std::uint32_t& part = number[sets.find(corners[t][0])];
      if (part == 0) part = static_cast<std::uint32_t>(++count);
      of[t] = part - 1;
    }
  }
};

bool is_finite_triangle(const Mesh& mesh, const Triangle& t) {
  return is_finite(mesh.positions[t[0]]) && is_finite(mesh.positions[t[1]]) &&
         is_finite(mesh.positions[t[2]]);
}

/// Clusters of parts with gaps below the size of a grid cell, each identified by one of its parts.
class Bodies {
 public:
  Bodies(const Mesh& mesh, const SharedParts& parts, const Vec3d& low, double cell)
      : low_(low), cell_(cell), sets_(parts.count) {
    for (std::size_t t = 0; t < parts.of.size(); ++t) {
      if (is_finite_triangle(mesh, mesh.triangles[t])) add(mesh, mesh.triangles[t], parts.of[t]);
    }
    std::sort(places_.begin(), places_.end());
    places_.erase(std::unique(places_.begin(), places_.end()), places_.end());
    join();
  }
  std::uint32_t of(std::uint32_t part) { return sets_.find(part); }

 private:
  using Place = std::pair<std::uint64_t, std::uint32_t>;  ///< A cell, and a part that touches it
  static constexpr int kBits = 21;

  void add(const Mesh& mesh, const Triangle& t, std::uint32_t part) {
    const Vec3d a = point_of(mesh, t[0]), u = point_of(mesh, t[1]) - a,
                v = point_of(mesh, t[2]) - a;
    const double longest = std::max({length(u), length(v), length(v - u)});
    const int steps = longest < cell_ ? 0 : static_cast<int>(std::min(longest / cell_, 1e5)) + 1;
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; k <= steps - i; ++k) {
        const double step = steps == 0 ? 0 : 1.0 / steps;
        const Place place{cell_of(a + u * (i * step) + v * (k * step)), part};
        // Neighbouring triangles mostly touch the same cells: a small cache removes most repetitions, and sorting
        // finds the others.
        const std::uint64_t mixed =
            place.first ^ place.first >> (kBits - 4) ^ place.first >> 2 * (kBits - 4);
        Place& recent = recent_[mixed % recent_.size()];
        if (std::exchange(recent, place) != place) places_.push_back(place);
      }
    }
  }
  std::uint64_t cell_of(const Vec3d& p) const {
    // Cell coordinates start at 1, so that each cell has preceding cells, even if the parts have no extent.
    const auto along = [&](double x) {
      return static_cast<std::uint64_t>(std::clamp(x / cell_ + 1, 1.0, (1 << kBits) - 2.0));
    };
    return along(p.x - low_.x) << 2 * kBits | along(p.y - low_.y) << kBits | along(p.z - low_.z);
  }
  /// Unites parts that touch the same cell or adjacent cells.
  void join() {
    for (std::size_t i = 1; i < places_.size(); ++i) {
      if (places_[i].first == places_[i - 1].first) {
        sets_.join(places_[i].second, places_[i - 1].second);
      }
    }
    // One part represents each cell.
    places_.erase(std::unique(places_.begin(), places_.end(),
                              [](const Place& a, const Place& b) { return a.first == b.first; }),
                  places_.end());
    // 13 of the 26 adjacent cells precede a cell: one in its row, and three in each of four rows.
    constexpr std::uint64_t kRow = std::uint64_t{1} << kBits, kSlice = kRow << kBits;
    for (const std::uint64_t back :
         {std::uint64_t{0}, kRow, kSlice - kRow, kSlice, kSlice + kRow}) {
      auto first = places_.begin();
      for (const Place& place : places_) {
        const std::uint64_t from = place.first - back - 1, to = back == 0 ? from : from + 2;
        while (first->first < from) ++first;
        for (auto near = first; near != places_.end() && near->first <= to; ++near) {
          sets_.join(place.second, near->second);
        }
      }
    }
  }

  Vec3d low_{};
  double cell_;
  DisjointSets sets_;
  std::vector<Place> places_;
  std::array<Place, 4096> recent_{};  ///< Cache of recent places, indexed by a hash
};

}  // namespace

std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters) {
  const SharedParts parts(mesh);
  if (parts.count < 2) return {};
  std::vector<Box<Vec3d>> boxes(parts.count);
  std::vector<double> areas(parts.count, 0);
  Box<Vec3d> whole;
  double area = 0;
  for (std::size_t t = 0; t < parts.of.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    if (!is_finite_triangle(mesh, v)) continue;
    add_triangle(boxes[parts.of[t]], mesh, v);
    const double size = area_of(mesh, v);
    areas[parts.of[t]] += size;
    area += size;
  }
  for (const Box<Vec3d>& box : boxes) {
    if (box.diagonal() > 0) whole.join(box);
  }
  double diagonal = whole.diagonal();
  if (!(diagonal > 0)) return {};
  std::vector<Box<Vec3d>> of_body;
  std::vector<double> area_of;
  std::vector<std::uint32_t> body(parts.count);
  for (int scale = 0; scale < kMaxScales && diagonal > 0; ++scale) {
    const double cell = std::max(0.5 * share * diagonal, std::sqrt(area / kMaxTouchedCells));
    Bodies bodies(mesh, parts, whole.low, cell);
    of_body.assign(parts.count, {});
    area_of.assign(parts.count, 0);
    for (std::uint32_t p = 0; p < parts.count; ++p) {
      body[p] = bodies.of(p);
      of_body[body[p]].join(boxes[p]);
      area_of[body[p]] += areas[p];
    }
    const auto largest = std::max_element(area_of.begin(), area_of.end()) - area_of.begin();
    const double own = of_body[static_cast<std::size_t>(largest)].diagonal();
    const bool rescale = own < kMaxRescaleShare * diagonal;
    diagonal = own;
    if (!rescale) break;
  }
  double floating = 0;
  Cleaned found;
  std::vector<std::uint8_t> is_floater(parts.count, 0);
  for (std::uint32_t p = 0; p < parts.count; ++p) {
    if (!(of_body[body[p]].diagonal() < share * diagonal)) continue;
    is_floater[p] = 1;
    floating += areas[p];
    if (body[p] == p && found.count++ == 0) found.example = to_float(boxes[p].low);
  }
  if (found.count == 0 || floating > kMaxFloaterShare * area) return {};
  floaters = found;
  std::vector<std::uint8_t> dropped(parts.of.size());
  for (std::size_t t = 0; t < dropped.size(); ++t) dropped[t] = is_floater[parts.of[t]];
  return dropped;
}

std::vector<std::uint8_t> find_inner(const Mesh& mesh, Cleaned& inner) {
  const SharedParts parts(mesh);
  if (parts.count < 2) return {};
  std::vector<SeenPixels> seen(parts.count);
  const auto is_hidden = [](const SeenPixels& of) {
    return of.front + of.back == 0 && of.drawn >= kMinHiddenPixels;
  };
  std::vector<std::uint8_t> is_unseen;  // For each part, 1 if no view has shown it so far
  for (const OutsideViews& views : kViews) {
    const std::vector<SeenPixels> more =
        look_from_outside(mesh, parts.of, parts.count, views, is_unseen);
    for (std::size_t p = 0; p < seen.size(); ++p) {
      if (!is_unseen.empty() && is_unseen[p] == 0) continue;
      seen[p].drawn += more[p].drawn;
      seen[p].front += more[p].front;
      seen[p].back += more[p].back;
    }
    is_unseen.resize(parts.count);
    std::transform(seen.begin(), seen.end(), is_unseen.begin(),
                   [](const SeenPixels& of) { return of.front + of.back == 0; });
    const bool is_round = views.step > 2;  // Later views may cover more pixels of a part
    if (!is_round && std::none_of(seen.begin(), seen.end(), is_hidden)) return {};
    if (is_round &&
        std::none_of(is_unseen.begin(), is_unseen.end(), [](auto is) { return is != 0; })) {
      return {};
    }
  }
  std::vector<std::uint8_t> dropped(parts.of.size(), 0), counted(parts.count, 0);
  for (std::size_t t = 0; t < dropped.size(); ++t) {
    const std::uint32_t p = parts.of[t];
    if (!is_hidden(seen[p])) continue;
    dropped[t] = 1;
    if (std::exchange(counted[p], 1) != 0) continue;
    if (inner.count++ == 0) inner.example = mesh.positions[mesh.triangles[t][0]];
  }
  return inner.count == 0 ? std::vector<std::uint8_t>{} : dropped;
}

}  // namespace kiln
