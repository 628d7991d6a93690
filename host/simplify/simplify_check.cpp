#include "simplify/simplify_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/parallel.h"
#include "mesh/vertex_lists.h"
#include "simplify/heightfield_constraint.h"

namespace kiln {
namespace {

using flaw_rules::is_flat;
using flaw_rules::kMaxAwayCosine;
using flaw_rules::kMaxBackToBackCosine;
using flaw_rules::kMaxDegenerateHeight;
using flaw_rules::kMaxSuspiciousCosine;
using flaw_rules::normal_of;
using flaw_rules::unit_or_zero;

/// Two normals of the high poly near each other belong to different sides of a sharp edge if their cosine is below
/// this.
constexpr double kMaxSharpCosine = -0.5;
/// Between its corners, a triangle over a thin curved shell cuts through the shell and may come out on its other side.
/// So it does not count as facing away if the high poly has a triangle near it (within kShellReach, as a share of the
/// triangle's longest side) with a similar normal (a cosine of at least kShellCosine).
constexpr double kShellCosine = 0.5, kShellReach = 0.05;
/// Radius around a triangle within which the high poly is searched, as a share of the diagonal.
constexpr double kSearchRadius = 0.02;
/// Additional radius around candidates, within which triangles of the high poly are kept in the tree.
constexpr double kSearchMargin = 0.01;
constexpr std::size_t kTrianglesOfPiece = std::size_t{1} << 15;

TriangleCorners corners_of(const std::vector<Vec3d>& points, const Triangle& t) {
  return {points[t[0]], points[t[1]], points[t[2]]};
}

/// A side of a triangle. Sorting by `key` brings the sides at one edge together.
struct TriangleSide {
  std::uint64_t key;
  std::uint32_t triangle;
  bool starts_at_lower;
};

std::vector<TriangleSide> sorted_sides(std::span<const Triangle> triangles) {
  std::vector<TriangleSide> sides;
  sides.reserve(triangles.size() * 3);
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint64_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
      sides.push_back({a < b ? a << 32 | b : b << 32 | a, t, a < b});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const TriangleSide& a, const TriangleSide& b) {
    return a.key != b.key ? a.key < b.key : a.triangle < b.triangle;
  });
  return sides;
}

/// Smallest cosine between a triangle's normal and those of its neighbours, and the number of neighbours below
/// kMaxSuspiciousCosine.
struct Neighbours {
  double min_cosine = 1;
  int suspicious_count = 0;
  void add(double cosine) {
    min_cosine = std::min(min_cosine, cosine);
    suspicious_count += cosine < kMaxSuspiciousCosine;
  }
};

std::vector<Neighbours> neighbours_of(const std::vector<Vec3d>& normals,
                                      const std::vector<Triangle>& triangles) {
  std::vector<Neighbours> found(triangles.size());
  const std::vector<TriangleSide> sides = sorted_sides(triangles);
  for (std::size_t i = 1; i < sides.size(); ++i) {
    const TriangleSide &a = sides[i - 1], &b = sides[i];
    if (a.key != b.key || a.starts_at_lower == b.starts_at_lower) continue;
    const double cosine = dot(normals[a.triangle], normals[b.triangle]);
    found[a.triangle].add(cosine);
    found[b.triangle].add(cosine);
  }
  return found;
}

void bounding_box_of(const TriangleCorners& p, Vec3d& low, Vec3d& high) {
  low = {std::min({p[0].x, p[1].x, p[2].x}), std::min({p[0].y, p[1].y, p[2].y}),
         std::min({p[0].z, p[1].z, p[2].z})};
  high = {std::max({p[0].x, p[1].x, p[2].x}), std::max({p[0].y, p[1].y, p[2].y}),
          std::max({p[0].z, p[1].z, p[2].z})};
}

}  // namespace

/// The range of cells that a box touches along each axis, and the bits of its cells in a row along x.
struct MarkedCells::Range {
  std::array<std::size_t, 3> first{}, last{};
  Row bits{};

  Range(const Vec3d& low, const Vec3d& high) {
    const auto at = [](double x) {
      return static_cast<std::size_t>(
          std::clamp(static_cast<int>((x + 1) / 2 * kGridCells), 0, kGridCells - 1));
    };
    first = {at(low.x), at(low.y), at(low.z)};
    last = {at(high.x), at(high.y), at(high.z)};
    for (std::size_t x = first[0]; x <= last[0]; ++x) bits[x / 64] |= std::uint64_t{1} << x % 64;
  }
  /// Calls `body` with the index of each row, until it returns false.
  template <class Body>
  void each_row(const Body& body) const {
    for (std::size_t z = first[2]; z <= last[2]; ++z) {
      for (std::size_t y = first[1]; y <= last[1]; ++y) {
        if (!body(z * kGridCells + y)) return;
      }
    }
  }
};

void MarkedCells::mark(const Vec3d& low, const Vec3d& high) {
  if (rows_.empty()) rows_.resize(std::size_t{kGridCells} * kGridCells);
  const Range range(low, high);
  range.each_row([&](std::size_t row) {
    for (std::size_t i = 0; i < range.bits.size(); ++i) rows_[row][i] |= range.bits[i];
    return true;
  });
}

bool MarkedCells::touches(const Vec3d& low, const Vec3d& high) const {
  const Range range(low, high);
  bool any = false;
  range.each_row([&](std::size_t row) {
    for (std::size_t i = 0; i < range.bits.size(); ++i)
      any = any || (rows_[row][i] & range.bits[i]) != 0;
    return !any;
  });
  return any;
}

bool MarkedCells::contains(const MarkedCells& other) const {
  return std::equal(rows_.begin(), rows_.end(), other.rows_.begin(), other.rows_.end(),
                    [](const Row& all, const Row& some) {
                      for (std::size_t i = 0; i < all.size(); ++i) {
                        if ((some[i] & ~all[i]) != 0) return false;
                      }
                      return true;
                    });
}

/// Builds a tree of the high poly's triangles around the candidates. Most meshes have few candidates.
void SimplifyCheck::load_near(const std::vector<Vec3d>& points,
                              const std::vector<Triangle>& triangles,
                              std::span<const std::uint32_t> candidates) {
  if (surface_ && marked_cells_.empty()) return;  // The tree holds all triangles already
  const auto cells_around_candidates = [&](double margin) {
    MarkedCells cells;
    Vec3d low{}, high{};
    for (const std::uint32_t t : candidates) {
      bounding_box_of(corners_of(points, triangles[t]), low, high);
      const double reach = kSearchRadius + length(high - low) + margin;
      cells.mark(low - Vec3d{reach, reach, reach}, high + Vec3d{reach, reach, reach});
    }
    return cells;
  };
  if (marked_cells_.contains(cells_around_candidates(0))) return;
  // With this margin, the tree can still be used after repairs have moved some candidates.
  marked_cells_ = cells_around_candidates(kSearchMargin);
  std::vector<std::uint8_t> is_in_marked_cell(triangles_.size(), 0);
  parallel_for(triangles_.size(), kTrianglesOfPiece, [&](std::size_t begin, std::size_t end) {
    Vec3d from{}, to{};
    for (std::size_t i = begin; i < end; ++i) {
      const Triangle& t = triangles_[i];
      bounding_box_of(
          {to_double(positions_[t[0]]), to_double(positions_[t[1]]), to_double(positions_[t[2]])},
          from, to);
      is_in_marked_cell[i] = marked_cells_.touches(from, to) ? 1 : 0;
    }
  });
  near_triangles_.clear();
  for (std::size_t i = 0; i < triangles_.size(); ++i) {
    if (is_in_marked_cell[i] != 0) near_triangles_.push_back(triangles_[i]);
  }
  surface_ = std::make_unique<SurfaceDistance>(positions_, near_triangles_);
  kept_.emplace(surface_->corners());
}

/// True if the high poly faces in the opposite direction near at least three of four points on the triangle.
/// \param shell  true: if a wall of a thin shell near the triangle has a similar normal, the triangle does not face
///   away
bool SimplifyCheck::faces_away(const TriangleCorners& p, bool shell) const {
  if (kept_->find({to_float(p[0]), to_float(p[1]), to_float(p[2])}) != KeptTriangles::kNone)
    return false;
  const Vec3d normal = unit_or_zero(normal_of(p));
  const double longest = std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
  const double shell_reach = shell ? std::min(kShellReach * longest, kSearchRadius) : 0;
  std::size_t faces_away_at = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    Vec3d at{};
    for (std::size_t k = 0; k < 3; ++k) at += p[k] * (i == 3 ? 1.0 / 3 : i == k ? 0.6 : 0.2);
    const Vec3 point = to_float(at);
    const Vec3* corners = nullptr;
    const double nearest = surface_->squared(point, kSearchRadius * kSearchRadius, corners);
    if (corners == nullptr) return false;
    const auto agreement = [&](const Vec3* c) {
      return dot(normal,
                 unit_or_zero(normal_of({to_double(c[0]), to_double(c[1]), to_double(c[2])})));
    };
    double best = agreement(corners);
    const double radius = 1.1 * std::sqrt(nearest) + 1e-4;
    if (best < kMaxAwayCosine) {
      surface_->each_within(point, radius * radius, [&](const Vec3* c) {
        best = std::max(best, agreement(c));
        return best < kMaxAwayCosine;
      });
    }
    if (best < kMaxAwayCosine && shell_reach > radius) {
      surface_->each_within(point, shell_reach * shell_reach, [&](const Vec3* c) {
        if (agreement(c) > kShellCosine) best = 1;
        return best < kMaxAwayCosine;
      });
    }
    faces_away_at += best < kMaxAwayCosine;
    // Even if all remaining points faced away, fewer than three of four would
    if (i >= faces_away_at + 1) return false;
  }
  return faces_away_at >= 3;
}

/// True if the high poly near the triangle has a sharp edge or is thin.
bool SimplifyCheck::has_edge(const TriangleCorners& p) const {
  const Vec3d center = (p[0] + p[1] + p[2]) * (1.0 / 3);
  double radius = 0;
  for (const Vec3d& corner : p) radius = std::max(radius, length(corner - center));
  const Vec3d normal = unit_or_zero(normal_of(p));
  double max_cosine = -1, min_cosine = 1;
  const auto is_sharp = [&] {
    return max_cosine > -kMaxSharpCosine && min_cosine < kMaxSharpCosine;
  };
  surface_->each_within(to_float(center), radius * radius, [&](const Vec3* c) {
    const double cosine =
        dot(normal, unit_or_zero(normal_of({to_double(c[0]), to_double(c[1]), to_double(c[2])})));
    max_cosine = std::max(max_cosine, cosine);
    min_cosine = std::min(min_cosine, cosine);
    return !is_sharp();
  });
  return is_sharp();
}

Flaws SimplifyCheck::find(const std::vector<Vec3d>& points,
                          const std::vector<Triangle>& triangles) {
  return find_flaws_in(points, triangles, nullptr);
}

Flaws SimplifyCheck::find_selected(const std::vector<Vec3d>& points,
                                   const std::vector<Triangle>& triangles,
                                   std::span<const std::uint32_t> included) {
  std::vector<std::uint8_t> is_included(triangles.size(), 0);
  for (const std::uint32_t t : included) is_included[t] = 1;
  return find_flaws_in(points, triangles, &is_included);
}

Flaws SimplifyCheck::find_flaws_in(const std::vector<Vec3d>& points,
                                   const std::vector<Triangle>& triangles,
                                   const std::vector<std::uint8_t>* is_included) {
  const auto is_checked = [&](std::size_t t) {
    return is_included == nullptr || (*is_included)[t] != 0;
  };
  Flaws flaws;
  std::vector<Vec3d> normals(triangles.size()), around(points.size());
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    const TriangleCorners corners = corners_of(points, triangles[t]);
    const Vec3d normal = normal_of(corners);
    for (const std::uint32_t v : triangles[t]) around[v] += normal;
    normals[t] = unit_or_zero(normal);
    if (is_checked(t) && is_flat(corners)) flaws.flat.push_back(t);
    if (height_field_ && is_checked(t) &&
        !(upward_quality(corners[0], corners[1], corners[2]) > kMaxDegenerateHeight)) {
      flaws.facing_down.push_back(t);
    }
  }
  const std::vector<Neighbours> neighbours = neighbours_of(normals, triangles);
  std::vector<std::uint32_t> candidates;
  for (std::uint32_t t = 0; t < triangles.size(); ++t) {
    if (!is_checked(t)) continue;
    int opposed_neighbours = 0;
    for (const std::uint32_t v : triangles[t]) opposed_neighbours += dot(normals[t], around[v]) < 0;
    if (neighbours[t].min_cosine < kMaxSuspiciousCosine || opposed_neighbours >= 2)
      candidates.push_back(t);
  }
  std::vector<std::uint32_t> checked_triangles = candidates;
  checked_triangles.insert(checked_triangles.end(), flaws.flat.begin(), flaws.flat.end());
  checked_triangles.insert(checked_triangles.end(), flaws.facing_down.begin(),
                           flaws.facing_down.end());
  if (checked_triangles.empty()) return flaws;
  load_near(points, triangles, checked_triangles);
  std::vector<std::uint8_t> is_folded(candidates.size(), 0);
  constexpr std::size_t kCandidatesPerTask = 64;
  parallel_for(candidates.size(), kCandidatesPerTask, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const std::uint32_t t = candidates[i];
      const TriangleCorners corners = corners_of(points, triangles[t]);
      if (is_flat(corners)) continue;
      // A triangle at the rim of a shell makes a sharp angle with one neighbour, a folded triangle with several.
      const bool is_at_rim = neighbours[t].suspicious_count == 1;
      is_folded[i] = faces_away(corners, is_at_rim) ||
                     (neighbours[t].min_cosine < kMaxBackToBackCosine && !has_edge(corners));
    }
  });
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    if (is_folded[i] != 0) flaws.folded.push_back(candidates[i]);
  }
  return flaws;
}

bool SimplifyCheck::is_flaw(const TriangleCorners& p) const {
  if (is_flat(p) || faces_away(p, true)) return true;
  return height_field_ && !(upward_quality(p[0], p[1], p[2]) > kMinUpwardQuality);
}

std::uint64_t count_rims(std::span<const Triangle> triangles, std::size_t vertices) {
  std::vector<std::uint32_t> loop_parent(vertices);
  std::iota(loop_parent.begin(), loop_parent.end(), 0U);
  const auto find = [&](std::uint32_t v) {
    while (loop_parent[v] != v) v = loop_parent[v] = loop_parent[loop_parent[v]];
    return v;
  };
  std::vector<std::uint8_t> is_open(vertices, 0);
  SideLists(triangles, vertices)
      .each_edge([&](std::uint32_t a, std::span<const SideLists::Item> sides) {
        if (sides.size() != 1) return;
        const std::uint32_t b = SideLists::higher(sides[0]);
        is_open[a] = is_open[b] = 1;
        const std::uint32_t ra = find(a), rb = find(b);
        loop_parent[std::max(ra, rb)] = std::min(ra, rb);
      });
  std::uint64_t count = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) count += is_open[v] != 0 && find(v) == v;
  return count;
}

}  // namespace kiln
