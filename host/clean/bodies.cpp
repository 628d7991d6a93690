// Finds superfluous triangles: those of floaters, and those of parts that are invisible from outside.
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

/// Largest share of the area that is removed as floaters. A larger share is assumed to be intended, and kept.
constexpr double kMaxFloaterShare = 0.1;
/// Largest number of grid cells that triangles may touch in total. It bounds the time.
constexpr double kMaxTouchedCells = 8e6;
/// If the diagonal of the largest body is below this share of the mesh's diagonal, the search is repeated at that
/// body's scale, at most kMaxScales times.
constexpr double kMaxDiagonalShareToRescale = 0.5;
constexpr int kMaxScales = 4;

/// A part only counts as hidden if all views together cover at least this many pixels with it, visible or not.
constexpr std::uint32_t kMinHiddenPixels = 256;
/// In the first views, back faces are transparent, so that they hide as little as possible. In later views, back faces
/// are drawn, for leaves of which only the back is visible. The first 32 directions are drawn in several rounds: each
/// round shows most of the remaining parts, and later rounds do not test these again.
constexpr std::array<OutsideViews, 6> kViewRounds{{{.step = 8, .first = 0, .backs = false},
                                                   {.step = 8, .first = 4, .backs = false},
                                                   {.step = 4, .first = 2, .backs = false},
                                                   {.step = 2, .first = 1, .backs = false},
                                                   {},
                                                   {.count = 64, .backs = false}}};

/// Components of a mesh that are connected over shared vertices, numbered in order.
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
    // 1 + the index of the vertex's component, for each vertex; 0 if the vertex has none yet
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

/// Finds bodies: clusters of parts with gaps below the size of a grid cell. Each body is identified by the index of one
/// of its parts.
class BodyFinder {
 public:
  BodyFinder(const Mesh& mesh, const SharedParts& parts, const Vec3d& low, double cell)
      : low_(low), cell_size_(cell), part_sets_(parts.count) {
    for (std::size_t t = 0; t < parts.of.size(); ++t) {
      if (is_finite_triangle(mesh, mesh.triangles[t])) add(mesh, mesh.triangles[t], parts.of[t]);
    }
    std::sort(parts_in_cells_.begin(), parts_in_cells_.end());
    parts_in_cells_.erase(std::unique(parts_in_cells_.begin(), parts_in_cells_.end()),
                          parts_in_cells_.end());
    join();
  }
  std::uint32_t of(std::uint32_t part) { return part_sets_.find(part); }

 private:
  using PartInCell =
      std::pair<std::uint64_t, std::uint32_t>;  ///< A grid cell, and a part that touches the cell
  static constexpr int kBitsPerCoordinate = 21;

  void add(const Mesh& mesh, const Triangle& t, std::uint32_t part) {
    const Vec3d a = point_of(mesh, t[0]), u = point_of(mesh, t[1]) - a,
                v = point_of(mesh, t[2]) - a;
    const double longest = std::max({length(u), length(v), length(v - u)});
    const int steps =
        longest < cell_size_ ? 0 : static_cast<int>(std::min(longest / cell_size_, 1e5)) + 1;
    for (int i = 0; i <= steps; ++i) {
      for (int k = 0; k <= steps - i; ++k) {
        const double step = steps == 0 ? 0 : 1.0 / steps;
        const PartInCell part_in_cell{cell_of(a + u * (i * step) + v * (k * step)), part};
        // Neighbouring triangles mostly touch the same cells. A small cache removes most repetitions, and sorting
        // removes the others.
        const std::uint64_t mixed = part_in_cell.first ^
                                    part_in_cell.first >> (kBitsPerCoordinate - 4) ^
                                    part_in_cell.first >> 2 * (kBitsPerCoordinate - 4);
        PartInCell& recent_entry = recent_entries_[mixed % recent_entries_.size()];
        if (std::exchange(recent_entry, part_in_cell) != part_in_cell)
          parts_in_cells_.push_back(part_in_cell);
      }
    }
  }
  std::uint64_t cell_of(const Vec3d& p) const {
    // Cell coordinates start at 1, so that every cell has cells before it, even if the parts have no extent.
    const auto cell_coordinate = [&](double x) {
      return static_cast<std::uint64_t>(
          std::clamp(x / cell_size_ + 1, 1.0, (1 << kBitsPerCoordinate) - 2.0));
    };
    return cell_coordinate(p.x - low_.x) << 2 * kBitsPerCoordinate |
           cell_coordinate(p.y - low_.y) << kBitsPerCoordinate | cell_coordinate(p.z - low_.z);
  }
  /// Unites parts that touch the same cell or adjacent cells.
  void join() {
    for (std::size_t i = 1; i < parts_in_cells_.size(); ++i) {
      if (parts_in_cells_[i].first == parts_in_cells_[i - 1].first) {
        part_sets_.join(parts_in_cells_[i].second, parts_in_cells_[i - 1].second);
      }
    }
    // One part represents each cell.
    parts_in_cells_.erase(
        std::unique(parts_in_cells_.begin(), parts_in_cells_.end(),
                    [](const PartInCell& a, const PartInCell& b) { return a.first == b.first; }),
        parts_in_cells_.end());
    // Of the 26 cells around a cell, 13 come before it: one in its own row, and three in each of four other rows.
    constexpr std::uint64_t kCellsPerRow = std::uint64_t{1} << kBitsPerCoordinate,
                            kCellsPerSlice = kCellsPerRow << kBitsPerCoordinate;
    for (const std::uint64_t back : {std::uint64_t{0}, kCellsPerRow, kCellsPerSlice - kCellsPerRow,
                                     kCellsPerSlice, kCellsPerSlice + kCellsPerRow}) {
      auto first = parts_in_cells_.begin();
      for (const PartInCell& part_in_cell : parts_in_cells_) {
        const std::uint64_t from = part_in_cell.first - back - 1, to = back == 0 ? from : from + 2;
        while (first->first < from) ++first;
        for (auto near = first; near != parts_in_cells_.end() && near->first <= to; ++near) {
          part_sets_.join(part_in_cell.second, near->second);
        }
      }
    }
  }

  Vec3d low_{};
  double cell_size_;
  DisjointSets part_sets_;
  std::vector<PartInCell> parts_in_cells_;
  std::array<PartInCell, 4096> recent_entries_{};  ///< Cache of recent entries, indexed by a hash
};

}  // namespace

std::vector<std::uint8_t> find_floaters(const Mesh& mesh, double share, Cleaned& floaters) {
  const SharedParts parts(mesh);
  if (parts.count < 2) return {};
  std::vector<Box<Vec3d>> part_boxes(parts.count);
  std::vector<double> part_areas(parts.count, 0);
  Box<Vec3d> mesh_box;
  double area = 0;
  for (std::size_t t = 0; t < parts.of.size(); ++t) {
    const Triangle& v = mesh.triangles[t];
    if (!is_finite_triangle(mesh, v)) continue;
    add_triangle(part_boxes[parts.of[t]], mesh, v);
    const double size = area_of(mesh, v);
    part_areas[parts.of[t]] += size;
    area += size;
  }
  for (const Box<Vec3d>& box : part_boxes) {
    if (box.diagonal() > 0) mesh_box.join(box);
  }
  double diagonal = mesh_box.diagonal();
  if (!(diagonal > 0)) return {};
  std::vector<Box<Vec3d>> body_boxes;
  std::vector<double> area_of_body;
  std::vector<std::uint32_t> body(parts.count);
  for (int scale = 0; scale < kMaxScales && diagonal > 0; ++scale) {
    const double cell = std::max(0.5 * share * diagonal, std::sqrt(area / kMaxTouchedCells));
    BodyFinder body_finder(mesh, parts, mesh_box.low, cell);
    body_boxes.assign(parts.count, {});
    area_of_body.assign(parts.count, 0);
    for (std::uint32_t p = 0; p < parts.count; ++p) {
      body[p] = body_finder.of(p);
      body_boxes[body[p]].join(part_boxes[p]);
      area_of_body[body[p]] += part_areas[p];
    }
    const auto largest =
        std::max_element(area_of_body.begin(), area_of_body.end()) - area_of_body.begin();
    const double own = body_boxes[static_cast<std::size_t>(largest)].diagonal();
    const bool is_rescaled = own < kMaxDiagonalShareToRescale * diagonal;
    diagonal = own;
    if (!is_rescaled) break;
  }
  double floater_area = 0;
  Cleaned found_floaters;
  std::vector<std::uint8_t> is_floater(parts.count, 0);
  for (std::uint32_t p = 0; p < parts.count; ++p) {
    if (!(body_boxes[body[p]].diagonal() < share * diagonal)) continue;
    is_floater[p] = 1;
    floater_area += part_areas[p];
    if (body[p] == p && found_floaters.count++ == 0)
      found_floaters.example = to_float(part_boxes[p].low);
  }
  if (found_floaters.count == 0 || floater_area > kMaxFloaterShare * area) return {};
  floaters = found_floaters;
  std::vector<std::uint8_t> is_dropped(parts.of.size());
  for (std::size_t t = 0; t < is_dropped.size(); ++t) is_dropped[t] = is_floater[parts.of[t]];
  return is_dropped;
}

std::vector<std::uint8_t> find_inner_parts(const Mesh& mesh, Cleaned& inner) {
  const SharedParts parts(mesh);
  if (parts.count < 2) return {};
  std::vector<SeenPixels> seen_pixels(parts.count);
  const auto is_hidden = [](const SeenPixels& of) {
    return of.front + of.back == 0 && of.drawn >= kMinHiddenPixels;
  };
  std::vector<std::uint8_t> is_unseen;  // For each part, 1 if no view has shown it so far, else 0
  for (const OutsideViews& views : kViewRounds) {
    const std::vector<SeenPixels> more =
        count_seen_pixels(mesh, parts.of, parts.count, views, is_unseen);
    for (std::size_t p = 0; p < seen_pixels.size(); ++p) {
      if (!is_unseen.empty() && is_unseen[p] == 0) continue;
      seen_pixels[p].drawn += more[p].drawn;
      seen_pixels[p].front += more[p].front;
      seen_pixels[p].back += more[p].back;
    }
    is_unseen.resize(parts.count);
    std::transform(seen_pixels.begin(), seen_pixels.end(), is_unseen.begin(),
                   [](const SeenPixels& of) { return of.front + of.back == 0; });
    const bool is_counted_in_rounds =
        views.step > 2;  // Later views may cover more pixels of a part than earlier ones
    if (!is_counted_in_rounds && std::none_of(seen_pixels.begin(), seen_pixels.end(), is_hidden))
      return {};
    if (is_counted_in_rounds &&
        std::none_of(is_unseen.begin(), is_unseen.end(), [](auto is) { return is != 0; })) {
      return {};
    }
  }
  std::vector<std::uint8_t> is_dropped(parts.of.size(), 0), counted(parts.count, 0);
  for (std::size_t t = 0; t < is_dropped.size(); ++t) {
    const std::uint32_t p = parts.of[t];
    if (!is_hidden(seen_pixels[p])) continue;
    is_dropped[t] = 1;
    if (std::exchange(counted[p], 1) != 0) continue;
    if (inner.count++ == 0) inner.example = mesh.positions[mesh.triangles[t][0]];
  }
  return inner.count == 0 ? std::vector<std::uint8_t>{} : is_dropped;
}

}  // namespace kiln
