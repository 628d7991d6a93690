#include "clean/hole_patch.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>
#include <utility>

#include "mesh/ears.h"

namespace kiln {
namespace {

using TriangleCorners = std::array<std::uint32_t, 3>;

/// Smallest continuation_cosine() of holes whose patch continues the surface: the cosine of 70 degrees. Patches of
/// other holes are flat.
constexpr double kMinCurvedCosine = 0.342;
/// Growth of the target edge length per unit of distance from the rim.
constexpr double kSizeGrowth = 0.3;
/// An edge is split if it is longer than this many times the target length at its ends.
constexpr double kMaxEdgeRatio = 1.4;
/// If a patch has this many inner vertices, no more edges are split.
constexpr std::size_t kMaxInnerVertices = 20000;
/// Maximum number of rounds of splitting. Each round halves long edges.
constexpr int kMaxSplitRounds = 60;
/// Number of rounds of fairing. Each round uses the cotangent weights of the shape that the previous round made.
constexpr int kFairingRounds = 8;
/// Range to which cotangents are clamped, so that needle triangles around a scan's hole do not dominate the weights.
constexpr double kMinCotangent = 0.02, kMaxCotangent = 20;
constexpr std::uint32_t kNoNeighbour = std::numeric_limits<std::uint32_t>::max();

Vec3d corner_normal(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return cross(b - a, c - a); }

/// Cotangent of the angle at `tip`.
double cotangent(const Vec3d& tip, const Vec3d& a, const Vec3d& b) {
  const Vec3d u = a - tip, v = b - tip;
  const double doubled_area = length(cross(u, v));
  const double value = doubled_area > 0 ? dot(u, v) / doubled_area : kMaxCotangent;
  return std::clamp(value, kMinCotangent, kMaxCotangent);
}

/// Area vector of a polygon, whose length is twice the polygon's area.
Vec3d area_vector(std::span<const Vec3d> points) {
  Vec3d sum{};
  for (std::size_t i = 2; i < points.size(); ++i) {
    sum += corner_normal(points[0], points[i - 1], points[i]);
  }
  return sum;
}

/// A triangulation whose edges can be split and flipped.
class PatchTriangulation {
 public:
  PatchTriangulation(const HoleRim& rim, std::vector<TriangleCorners> triangles)
      : rim_(rim.points.size()), points(rim.points), triangles_(std::move(triangles)) {
    const std::size_t n = rim_;
    edge_lengths_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double previous_length = length(points[i] - points[(i + n - 1) % n]);
      const double next_length = length(points[(i + 1) % n] - points[i]);
      edge_lengths_[i] = (previous_length + next_length) / 2;
    }
    connect_sides();
  }

  std::size_t rim() const { return rim_; }
  const std::vector<TriangleCorners>& triangles() const { return triangles_; }

  /// Splits each inner edge for which `is` returns true.
  /// \returns true if there was at least one
  template <typename Is>
  bool split_edges(const Is& is) {
    std::vector<std::pair<double, std::uint32_t>> long_sides;
    for (std::uint32_t side = 0; side < 3 * triangles_.size(); ++side) {
      if (opposite_side_[side] == kNoNeighbour || opposite_side_[side] < side) continue;
      if (is(start(side), end(side))) {
        long_sides.emplace_back(-length(points[end(side)] - points[start(side)]), side);
      }
    }
    std::sort(long_sides.begin(), long_sides.end());
    // A split may renumber sides of its triangles. The check skips a side that was renumbered; the next round finds it
    // again.
    for (const auto& [size, side] : long_sides) {
      if (is(start(side), end(side)) && points.size() - rim_ < kMaxInnerVertices) split_at(side);
    }
    return !long_sides.empty() && points.size() - rim_ < kMaxInnerVertices;
  }

  bool is_long(std::uint32_t a, std::uint32_t b) const {
    return length(points[b] - points[a]) >
           kMaxEdgeRatio * (edge_lengths_[a] + edge_lengths_[b]) / 2;
  }

  /// Flips each edge whose two opposite angles exceed 180 degrees together.
  template <typename IsEdge>
  void flip_to_delaunay(const IsEdge& is_edge) {
    constexpr int kMaxRounds = 20;
    for (int round = 0; round < kMaxRounds; ++round) {
      bool has_flipped = false;
      for (std::uint32_t side = 0; side < 3 * triangles_.size(); ++side) {
        if (opposite_side_[side] != kNoNeighbour && should_flip(side, is_edge)) {
          flip(side);
          has_flipped = true;
        }
      }
      if (!has_flipped) return;
    }
  }

 private:
  static std::uint32_t next(std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; }
  static std::uint32_t previous_side(std::uint32_t side) {
    return side % 3 == 0 ? side + 2 : side - 1;
  }
  std::uint32_t start(std::uint32_t side) const { return triangles_[side / 3][side % 3]; }
  std::uint32_t end(std::uint32_t side) const { return start(next(side)); }
  std::uint32_t tip(std::uint32_t side) const { return start(previous_side(side)); }

  void join(std::uint32_t a, std::uint32_t b) {
    opposite_side_[a] = b;
    if (b != kNoNeighbour) opposite_side_[b] = a;
  }

  void connect_sides() {
    opposite_side_.assign(3 * triangles_.size(), kNoNeighbour);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> sides;
    for (std::uint32_t side = 0; side < opposite_side_.size(); ++side) {
      const auto [low, high] = std::minmax({start(side), end(side)});
      sides.emplace_back(std::uint64_t{low} << 32 | high, side);
    }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 1; i < sides.size(); ++i) {
      if (sides[i].first == sides[i - 1].first) join(sides[i].second, sides[i - 1].second);
    }
  }

  void split_at(std::uint32_t side) {
    const std::uint32_t opposite = opposite_side_[side];
    const std::uint32_t a = start(side), b = end(side), c = tip(side), d = tip(opposite);
    const auto middle = static_cast<std::uint32_t>(points.size());
    points.push_back((points[a] + points[b]) * 0.5);
    const double half = length(points[b] - points[a]) / 2;
    edge_lengths_.push_back(std::min(edge_lengths_[a], edge_lengths_[b]) + kSizeGrowth * half);
    // (a, b, c) becomes (a, middle, c) and (middle, b, c); (b, a, d) becomes (b, middle, d) and (middle, a, d).
    const auto first = static_cast<std::uint32_t>(3 * triangles_.size());
    triangles_.push_back({middle, b, c});
    triangles_.push_back({middle, a, d});
    opposite_side_.resize(3 * triangles_.size(), kNoNeighbour);
    const std::uint32_t b_c = next(side), a_d = next(opposite);
    join(first + 1, opposite_side_[b_c]);
    join(first + 4, opposite_side_[a_d]);
    triangles_[side / 3][next(side) % 3] = middle;
    triangles_[opposite / 3][next(opposite) % 3] = middle;
    join(b_c, first + 2);
    join(a_d, first + 5);
    join(side, first + 3);
    join(opposite, first);
  }

  template <typename IsEdge>
  bool should_flip(std::uint32_t side, const IsEdge& is_edge) const {
    const std::uint32_t opposite = opposite_side_[side];
    const std::uint32_t a = start(side), b = end(side), c = tip(side), d = tip(opposite);
    if (c == d) return false;
    const auto angle = [&](std::uint32_t at) {
      const Vec3d u = points[a] - points[at], v = points[b] - points[at];
      return std::atan2(length(cross(u, v)), dot(u, v));
    };
    constexpr double kAngleTolerance = 1e-9;
    if (!(angle(c) + angle(d) > std::numbers::pi + kAngleTolerance)) return false;
    if (is_edge(c, d) || has_edge(side)) return false;
    // The two triangles after the flip must not fold onto each other.
    const Vec3d n = corner_normal(points[a], points[b], points[c]) +
                    corner_normal(points[b], points[a], points[d]);
    return dot(corner_normal(points[a], points[d], points[c]), n) > 0 &&
           dot(corner_normal(points[d], points[b], points[c]), n) > 0;
  }

  /// True if the tips of the two triangles at a side are already connected by an edge.
  bool has_edge(std::uint32_t side) const {
    const std::uint32_t opposite_tip = tip(opposite_side_[side]);
    for (const bool outgoing : {true, false}) {
      std::uint32_t at =
          outgoing ? previous_side(side) : next(side);  // A side that starts or ends at the tip
      for (std::size_t visited_sides = 0; visited_sides < triangles_.size(); ++visited_sides) {
        const std::uint32_t opposite_side = opposite_side_[at];
        if (opposite_side == kNoNeighbour || opposite_side / 3 == side / 3) break;
        at = outgoing ? next(opposite_side) : previous_side(opposite_side);
        if ((outgoing ? end(at) : start(at)) == opposite_tip) return true;
      }
    }
    return false;
  }

  void flip(std::uint32_t side) {
    const std::uint32_t other = opposite_side_[side];
    const std::uint32_t a = start(side), b = end(side), c = tip(side), d = tip(other);
    const std::uint32_t b_c = opposite_side_[next(side)], c_a = opposite_side_[previous_side(side)];
    const std::uint32_t a_d = opposite_side_[next(other)],
                        d_b = opposite_side_[previous_side(other)];
    const std::uint32_t t = side / 3 * 3, u = other / 3 * 3;
    triangles_[side / 3] = {c, a, d};
    triangles_[other / 3] = {d, b, c};
    join(t, c_a);
    join(t + 1, a_d);
    join(u, d_b);
    join(u + 1, b_c);
    join(t + 2, u + 2);
  }

  std::size_t rim_;

 public:
  std::vector<Vec3d> points;

 private:
  std::vector<TriangleCorners> triangles_;
  std::vector<double> edge_lengths_;  ///< Target length of the edges at each vertex
  /// For each side (3 t + k), the side of the neighbouring triangle; kNoNeighbour if the side lies on the rim
  std::vector<std::uint32_t> opposite_side_;
};

using EdgeMatrix = Eigen::SparseMatrix<double>;
using Entry = Eigen::Triplet<double>;

/// Weights of edges, by both of their vertices, and areas of vertices.
struct Laplacian {
  std::vector<Entry> weights;  ///< Both directions of each edge; repeated entries are summed
  std::vector<double> areas;

  explicit Laplacian(std::size_t vertices) : areas(vertices, 0) {}

  void add(std::span<const Vec3d> points, const TriangleCorners& t) {
    const double area = length(corner_normal(points[t[0]], points[t[1]], points[t[2]])) / 6;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
      const double weight = cotangent(points[t[k]], points[a], points[b]) / 2;
      weights.emplace_back(static_cast<int>(a), static_cast<int>(b), weight);
      weights.emplace_back(static_cast<int>(b), static_cast<int>(a), weight);
      areas[t[k]] += area;
    }
  }

  /// Matrix of the weighted differences between the value of each of the first `rows` vertices and the values of its
  /// neighbours.
  EdgeMatrix matrix(std::size_t rows) const {
    std::vector<Entry> matrix_entries;
    matrix_entries.reserve(2 * weights.size());
    for (const Entry& entry : weights) {
      if (static_cast<std::size_t>(entry.row()) >= rows) continue;
      matrix_entries.push_back(entry);
      matrix_entries.emplace_back(entry.row(), entry.row(), -entry.value());
    }
    EdgeMatrix result(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(areas.size()));
    result.setFromTriplets(matrix_entries.begin(), matrix_entries.end());
    return result;
  }
};

/// A matrix of three values for each vertex, with one row per vertex.
using VertexValues = Eigen::Matrix<double, Eigen::Dynamic, 3>;

VertexValues values_of(std::span<const Vec3d> points) {
  VertexValues values(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    values.row(static_cast<Eigen::Index>(i)) << points[i].x, points[i].y, points[i].z;
  }
  return values;
}

/// Moves the `inside` vertices that follow the first `rim` vertices to the positions at which the surface bends least.
/// \returns false if the linear system has no solution
bool fair_patch(const HoleRim& rim, std::span<const TriangleCorners> triangles,
                std::vector<Vec3d>& points) {
  const std::size_t rim_count = rim.points.size(), point_count = points.size(),
                    inner_count = point_count - rim_count;
  std::vector<Vec3d> all = points;
  all.insert(all.end(), rim.surrounding_points.begin(), rim.surrounding_points.end());
  Laplacian laplacian(all.size());
  for (const TriangleCorners& t : triangles) laplacian.add(all, t);
  for (TriangleCorners t : rim.surrounding_triangles) {
    for (std::uint32_t& v : t) {
      if (v >= rim_count) v = static_cast<std::uint32_t>(v - rim_count + point_count);
    }
    laplacian.add(all, t);
  }
  const EdgeMatrix differences = laplacian.matrix(point_count);
  Eigen::VectorXd inverse_areas(static_cast<Eigen::Index>(point_count));
  for (std::size_t v = 0; v < point_count; ++v) {
    inverse_areas[static_cast<Eigen::Index>(v)] = 1 / std::max(laplacian.areas[v], 1e-300);
  }
  const auto begin = static_cast<Eigen::Index>(rim_count),
             count = static_cast<Eigen::Index>(inner_count);
  VertexValues at = values_of(all);
  at.middleRows(begin, count).setZero();
  const EdgeMatrix inner_columns = differences.middleCols(begin, count);
  const EdgeMatrix weighted = inverse_areas.asDiagonal() * inner_columns;
  const EdgeMatrix system = EdgeMatrix(inner_columns.transpose()) * weighted;
  Eigen::SimplicialLDLT<EdgeMatrix> solver(system);
  if (solver.info() != Eigen::Success) return false;
  const VertexValues right = -(weighted.transpose() * (differences * at));
  const VertexValues solved = solver.solve(right);
  if (solver.info() != Eigen::Success || !solved.allFinite()) return false;
  for (std::size_t i = 0; i < inner_count; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    points[rim_count + i] = {solved(row, 0), solved(row, 1), solved(row, 2)};
  }
  return true;
}

/// For each vertex, the corner of the rim that is nearest to it, measured along edges.
std::vector<std::uint32_t> nearest_corners(std::size_t rim, std::span<const Vec3d> points,
                                           std::span<const TriangleCorners> triangles) {
  std::vector<std::vector<std::uint32_t>> neighbours(points.size());
  for (const TriangleCorners& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      neighbours[t[k]].push_back(t[(k + 1) % 3]);
      neighbours[t[k]].push_back(t[(k + 2) % 3]);
    }
  }
  std::vector<std::uint32_t> nearest_corner(points.size(), kNoNeighbour);
  std::vector<double> rim_distance(points.size(), std::numeric_limits<double>::infinity());
  using Step = std::pair<double, std::uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> open_steps;
  for (std::uint32_t i = 0; i < rim; ++i) {
    nearest_corner[i] = i;
    rim_distance[i] = 0;
    open_steps.emplace(0, i);
  }
  while (!open_steps.empty()) {
    const auto [walked, v] = open_steps.top();
    open_steps.pop();
    if (walked > rim_distance[v]) continue;
    for (const std::uint32_t other : neighbours[v]) {
      const double far = walked + length(points[other] - points[v]);
      if (!(far < rim_distance[other])) continue;
      rim_distance[other] = far;
      nearest_corner[other] = nearest_corner[v];
      open_steps.emplace(far, other);
    }
  }
  return nearest_corner;
}

}  // namespace

double continuation_cosine(const HoleRim& rim) {
  const Vec3d area = area_vector(rim.points);
  const double size = length(area);
  if (!(size > 0)) return 0;
  double sum = 0, all = 0;
  for (std::size_t i = 0; i < rim.points.size(); ++i) {
    const double edge = length(rim.points[(i + 1) % rim.points.size()] - rim.points[i]);
    sum += edge * dot(rim.face_normals[i], area) / size;
    all += edge;
  }
  return all > 0 ? sum / all : 0;
}

HolePatch make_hole_patch(const HoleRim& rim,
                          const std::function<bool(std::uint32_t, std::uint32_t)>& is_edge) {
  const std::size_t corners = rim.points.size();
  std::vector<std::array<double, 3>> at;
  for (const Vec3d& p : rim.points) at.push_back({p.x, p.y, p.z});
  CornerTriangles ears;
  const FlatPolygon flat = seen_along_normal(at);
  if (flat.empty()) {
    std::vector<std::uint32_t> all(corners);
    for (std::uint32_t i = 0; i < corners; ++i) all[i] = i;
    split_as_convex(all, ears);
  } else if (shortest_ears(at, flat, ears)) {
    raise_smallest_angles(flat, ears);
  }
  HolePatch patch;
  patch.is_flat = continuation_cosine(rim) < kMinCurvedCosine;
  PatchTriangulation mesh(rim, std::move(ears));
  const auto is_existing_edge = [&](std::uint32_t a, std::uint32_t b) {
    return a < corners && b < corners && is_edge(a, b);
  };
  while (mesh.split_edges(is_existing_edge)) {
  }
  if (!patch.is_flat) {
    const auto is_long = [&](std::uint32_t a, std::uint32_t b) { return mesh.is_long(a, b); };
    for (int round = 0; round < kMaxSplitRounds && mesh.split_edges(is_long); ++round) {
      mesh.flip_to_delaunay(is_existing_edge);
    }
    for (int round = 0; round < kFairingRounds && mesh.points.size() > corners; ++round) {
      if (!fair_patch(rim, mesh.triangles(), mesh.points)) break;
      mesh.flip_to_delaunay(is_existing_edge);
    }
  }
  patch.points = std::move(mesh.points);
  patch.triangles = mesh.triangles();
  patch.nearest = nearest_corners(corners, patch.points, patch.triangles);
  return patch;
}

std::vector<Vec3d> interpolate_over_patch(const HolePatch& patch, std::span<const Vec3d> values) {
  std::vector<Vec3d> result(values.begin(), values.end());
  const std::size_t rim_count = values.size(), point_count = patch.points.size();
  result.resize(point_count);
  if (point_count == rim_count) return result;
  Laplacian laplacian(point_count);
  for (const TriangleCorners& t : patch.triangles) laplacian.add(patch.points, t);
  const EdgeMatrix differences = laplacian.matrix(point_count);
  const auto begin = static_cast<Eigen::Index>(rim_count),
             count = static_cast<Eigen::Index>(point_count - rim_count);
  const EdgeMatrix inside = -differences.middleCols(begin, count).bottomRows(count);
  Eigen::SimplicialLDLT<EdgeMatrix> solver(inside);
  const VertexValues right = (differences * values_of(result)).bottomRows(count);
  const VertexValues solved = solver.solve(right);
  for (std::size_t i = rim_count; i < point_count; ++i) {
    const auto row = static_cast<Eigen::Index>(i - rim_count);
    const bool is_solved = solver.info() == Eigen::Success && solved.row(row).allFinite();
    result[i] = is_solved ? Vec3d(solved(row, 0), solved(row, 1), solved(row, 2))
                          : values[patch.nearest[i]];
  }
  return result;
}

}  // namespace kiln
