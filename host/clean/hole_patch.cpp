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

using Corners = std::array<std::uint32_t, 3>;

/// Smallest continuation_cosine() of holes whose patch follows the surface: 70 degrees.
constexpr double kMinCurvedCosine = 0.342;
/// Growth of edge lengths with the distance from the rim.
constexpr double kSizeGrowth = 0.3;
/// An edge is split where it is so many times as long as its ends' edges should be.
constexpr double kMaxEdgeRatio = 1.4;
/// Splits end at this number of vertices inside.
constexpr std::size_t kMaxInside = 20000;
/// Splits end after so many rounds, each of which halves long edges.
constexpr int kMaxSplitRounds = 60;
/// Rounds of fairing, each with weights of the shape before.
constexpr int kFairingRounds = 8;
/// Range of cotangents, so that needles around a scan's hole do not decide alone.
constexpr double kMinCotangent = 0.02, kMaxCotangent = 20;
constexpr std::uint32_t kNoNeighbour = std::numeric_limits<std::uint32_t>::max();

Vec3d corner_normal(const Vec3d& a, const Vec3d& b, const Vec3d& c) { return cross(b - a, c - a); }

/// Cotangent of the angle at `tip`.
double cotangent(const Vec3d& tip, const Vec3d& a, const Vec3d& b) {
  const Vec3d u = a - tip, v = b - tip;
  const double across = length(cross(u, v));
  const double value = across > 0 ? dot(u, v) / across : kMaxCotangent;
  return std::clamp(value, kMinCotangent, kMaxCotangent);
}

/// Area vector of a polygon, twice its size.
Vec3d area_vector(std::span<const Vec3d> points) {
  Vec3d sum{};
  for (std::size_t i = 2; i < points.size(); ++i) {
    sum += corner_normal(points[0], points[i - 1], points[i]);
  }
  return sum;
}

/// A triangulation whose edges are split and flipped.
class PatchTriangulation {
 public:
  PatchTriangulation(const HoleRim& rim, std::vector<Corners> triangles)
      : rim_(rim.points.size()), points(rim.points), triangles_(std::move(triangles)) {
    const std::size_t n = rim_;
    sizes_.resize(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double before = length(points[i] - points[(i + n - 1) % n]);
      const double after = length(points[(i + 1) % n] - points[i]);
      sizes_[i] = (before + after) / 2;
    }
    connect();
  }

  std::size_t rim() const { return rim_; }
  const std::vector<Corners>& triangles() const { return triangles_; }

  /// Splits each edge inside for which `is` returns true. \returns whether there was one
  template <typename Is>
  bool split_edges(const Is& is) {
    std::vector<std::pair<double, std::uint32_t>> sides;
    for (std::uint32_t side = 0; side < 3 * triangles_.size(); ++side) {
      if (beside_[side] == kNoNeighbour || beside_[side] < side) continue;
      if (is(start(side), end(side))) {
        sides.emplace_back(-length(points[end(side)] - points[start(side)]), side);
      }
    }
    std::sort(sides.begin(), sides.end());
    // A split keeps the ends of other sides of these triangles, but may renumber one: it is looked at in the next round.
    for (const auto& [size, side] : sides) {
      if (is(start(side), end(side)) && points.size() - rim_ < kMaxInside) split(side);
    }
    return !sides.empty() && points.size() - rim_ < kMaxInside;
  }

  bool is_long(std::uint32_t a, std::uint32_t b) const {
    return length(points[b] - points[a]) > kMaxEdgeRatio * (sizes_[a] + sizes_[b]) / 2;
  }

  /// Flips edges whose opposite angles exceed 180 degrees together.
  template <typename IsEdge>
  void flip_to_delaunay(const IsEdge& is_edge) {
    constexpr int kMaxRounds = 20;
    for (int round = 0; round < kMaxRounds; ++round) {
      bool flipped = false;
      for (std::uint32_t side = 0; side < 3 * triangles_.size(); ++side) {
        if (beside_[side] != kNoNeighbour && wants_flip(side, is_edge)) {
          flip(side);
          flipped = true;
        }
      }
      if (!flipped) return;
    }
  }

 private:
  static std::uint32_t next(std::uint32_t side) { return side % 3 == 2 ? side - 2 : side + 1; }
  static std::uint32_t before(std::uint32_t side) { return side % 3 == 0 ? side + 2 : side - 1; }
  std::uint32_t start(std::uint32_t side) const { return triangles_[side / 3][side % 3]; }
  std::uint32_t end(std::uint32_t side) const { return start(next(side)); }
  std::uint32_t tip(std::uint32_t side) const { return start(before(side)); }

  void join(std::uint32_t a, std::uint32_t b) {
    beside_[a] = b;
    if (b != kNoNeighbour) beside_[b] = a;
  }

  void connect() {
    beside_.assign(3 * triangles_.size(), kNoNeighbour);
    std::vector<std::pair<std::uint64_t, std::uint32_t>> sides;
    for (std::uint32_t side = 0; side < beside_.size(); ++side) {
      const auto [low, high] = std::minmax({start(side), end(side)});
      sides.emplace_back(std::uint64_t{low} << 32 | high, side);
    }
    std::sort(sides.begin(), sides.end());
    for (std::size_t i = 1; i < sides.size(); ++i) {
      if (sides[i].first == sides[i - 1].first) join(sides[i].second, sides[i - 1].second);
    }
  }

  void split(std::uint32_t side) {
    const std::uint32_t other = beside_[side];
    const std::uint32_t a = start(side), b = end(side), c = tip(side), d = tip(other);
    const auto middle = static_cast<std::uint32_t>(points.size());
    points.push_back((points[a] + points[b]) * 0.5);
    const double half = length(points[b] - points[a]) / 2;
    sizes_.push_back(std::min(sizes_[a], sizes_[b]) + kSizeGrowth * half);
    // (a, b, c) becomes (a, middle, c) and (middle, b, c); (b, a, d) becomes (b, middle, d) and (middle, a, d).
    const auto first = static_cast<std::uint32_t>(3 * triangles_.size());
    triangles_.push_back({middle, b, c});
    triangles_.push_back({middle, a, d});
    beside_.resize(3 * triangles_.size(), kNoNeighbour);
    const std::uint32_t b_c = next(side), a_d = next(other);
    join(first + 1, beside_[b_c]);
    join(first + 4, beside_[a_d]);
    triangles_[side / 3][next(side) % 3] = middle;
    triangles_[other / 3][next(other) % 3] = middle;
    join(b_c, first + 2);
    join(a_d, first + 5);
    join(side, first + 3);
    join(other, first);
  }

  template <typename IsEdge>
  bool wants_flip(std::uint32_t side, const IsEdge& is_edge) const {
    const std::uint32_t other = beside_[side];
    const std::uint32_t a = start(side), b = end(side), c = tip(side), d = tip(other);
    if (c == d) return false;
    const auto angle = [&](std::uint32_t at) {
      const Vec3d u = points[a] - points[at], v = points[b] - points[at];
      return std::atan2(length(cross(u, v)), dot(u, v));
    };
    constexpr double kTolerance = 1e-9;
    if (!(angle(c) + angle(d) > std::numbers::pi + kTolerance)) return false;
    if (is_edge(c, d) || has_edge(side)) return false;
    // The flipped pair must not fold.
    const Vec3d n = corner_normal(points[a], points[b], points[c]) +
                    corner_normal(points[b], points[a], points[d]);
    return dot(corner_normal(points[a], points[d], points[c]), n) > 0 &&
           dot(corner_normal(points[d], points[b], points[c]), n) > 0;
  }

  /// True if an edge joins the tips of both triangles at a side already.
  bool has_edge(std::uint32_t side) const {
    const std::uint32_t wanted = tip(beside_[side]);
    for (const bool outgoing : {true, false}) {
      std::uint32_t at = outgoing ? before(side) : next(side);  // a side from or to the tip
      for (std::size_t steps = 0; steps < triangles_.size(); ++steps) {
        const std::uint32_t across = beside_[at];
        if (across == kNoNeighbour || across / 3 == side / 3) break;
        at = outgoing ? next(across) : before(across);
        if ((outgoing ? end(at) : start(at)) == wanted) return true;
      }
    }
    return false;
  }

  void flip(std::uint32_t side) {
    const std::uint32_t other = beside_[side];
    const std::uint32_t a = start(side), b = end(side), c = tip(side), d = tip(other);
    const std::uint32_t b_c = beside_[next(side)], c_a = beside_[before(side)];
    const std::uint32_t a_d = beside_[next(other)], d_b = beside_[before(other)];
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
  std::vector<Corners> triangles_;
  std::vector<double> sizes_;  ///< Per vertex, the length that its edges should have
  std::vector<std::uint32_t>
      beside_;  ///< Per side (3 t + k), the side of the neighbour; kNoNeighbour: at the rim
};

using Sparse = Eigen::SparseMatrix<double>;
using Entry = Eigen::Triplet<double>;

/// Weights of edges by both vertices, and areas of vertices.
struct Laplacian {
  std::vector<Entry> weights;  ///< Both directions of each edge; repeated entries are summed
  std::vector<double> areas;

  explicit Laplacian(std::size_t vertices) : areas(vertices, 0) {}

  void add(std::span<const Vec3d> points, const Corners& t) {
    const double area = length(corner_normal(points[t[0]], points[t[1]], points[t[2]])) / 6;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[(k + 1) % 3], b = t[(k + 2) % 3];
      const double weight = cotangent(points[t[k]], points[a], points[b]) / 2;
      weights.emplace_back(static_cast<int>(a), static_cast<int>(b), weight);
      weights.emplace_back(static_cast<int>(b), static_cast<int>(a), weight);
      areas[t[k]] += area;
    }
  }

  /// Differences of each of the first `rows` vertices' values and their neighbours'.
  Sparse matrix(std::size_t rows) const {
    std::vector<Entry> entries;
    entries.reserve(2 * weights.size());
    for (const Entry& entry : weights) {
      if (static_cast<std::size_t>(entry.row()) >= rows) continue;
      entries.push_back(entry);
      entries.emplace_back(entry.row(), entry.row(), -entry.value());
    }
    Sparse result(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(areas.size()));
    result.setFromTriplets(entries.begin(), entries.end());
    return result;
  }
};

/// Columns of values at vertices.
using Values = Eigen::Matrix<double, Eigen::Dynamic, 3>;

Values values_of(std::span<const Vec3d> points) {
  Values values(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    values.row(static_cast<Eigen::Index>(i)) << points[i].x, points[i].y, points[i].z;
  }
  return values;
}

/// Moves vertices from `rim` to `inside` + rim to where the surface bends least. \returns false if that has no solution
bool fair_once(const HoleRim& rim, std::span<const Corners> triangles, std::vector<Vec3d>& points) {
  const std::size_t fixed = rim.points.size(), own = points.size(), inside = own - fixed;
  std::vector<Vec3d> all = points;
  all.insert(all.end(), rim.around.begin(), rim.around.end());
  Laplacian laplacian(all.size());
  for (const Corners& t : triangles) laplacian.add(all, t);
  for (Corners t : rim.collar) {
    for (std::uint32_t& v : t) {
      if (v >= fixed) v = static_cast<std::uint32_t>(v - fixed + own);
    }
    laplacian.add(all, t);
  }
  const Sparse differences = laplacian.matrix(own);
  Eigen::VectorXd shares(static_cast<Eigen::Index>(own));
  for (std::size_t v = 0; v < own; ++v) {
    shares[static_cast<Eigen::Index>(v)] = 1 / std::max(laplacian.areas[v], 1e-300);
  }
  const auto begin = static_cast<Eigen::Index>(fixed), count = static_cast<Eigen::Index>(inside);
  Values at = values_of(all);
  at.middleRows(begin, count).setZero();
  const Sparse free = differences.middleCols(begin, count);
  const Sparse weighted = shares.asDiagonal() * free;
  const Sparse system = Sparse(free.transpose()) * weighted;
  Eigen::SimplicialLDLT<Sparse> solver(system);
  if (solver.info() != Eigen::Success) return false;
  const Values right = -(weighted.transpose() * (differences * at));
  const Values solved = solver.solve(right);
  if (solver.info() != Eigen::Success || !solved.allFinite()) return false;
  for (std::size_t i = 0; i < inside; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    points[fixed + i] = {solved(row, 0), solved(row, 1), solved(row, 2)};
  }
  return true;
}

/// For each vertex, the corner of the rim that is nearest along edges.
std::vector<std::uint32_t> nearest_corners(std::size_t rim, std::span<const Vec3d> points,
                                           std::span<const Corners> triangles) {
  std::vector<std::vector<std::uint32_t>> beside(points.size());
  for (const Corners& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      beside[t[k]].push_back(t[(k + 1) % 3]);
      beside[t[k]].push_back(t[(k + 2) % 3]);
    }
  }
  std::vector<std::uint32_t> nearest(points.size(), kNoNeighbour);
  std::vector<double> distance(points.size(), std::numeric_limits<double>::infinity());
  using Step = std::pair<double, std::uint32_t>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> steps;
  for (std::uint32_t i = 0; i < rim; ++i) {
    nearest[i] = i;
    distance[i] = 0;
    steps.emplace(0, i);
  }
  while (!steps.empty()) {
    const auto [walked, v] = steps.top();
    steps.pop();
    if (walked > distance[v]) continue;
    for (const std::uint32_t other : beside[v]) {
      const double far = walked + length(points[other] - points[v]);
      if (!(far < distance[other])) continue;
      distance[other] = far;
      nearest[other] = nearest[v];
      steps.emplace(far, other);
    }
  }
  return nearest;
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
    raise_angles(flat, ears);
  }
  HolePatch patch;
  patch.is_flat = continuation_cosine(rim) < kMinCurvedCosine;
  PatchTriangulation mesh(rim, std::move(ears));
  const auto exists = [&](std::uint32_t a, std::uint32_t b) {
    return a < corners && b < corners && is_edge(a, b);
  };
  while (mesh.split_edges(exists)) {
  }
  if (!patch.is_flat) {
    const auto is_long = [&](std::uint32_t a, std::uint32_t b) { return mesh.is_long(a, b); };
    for (int round = 0; round < kMaxSplitRounds && mesh.split_edges(is_long); ++round) {
      mesh.flip_to_delaunay(exists);
    }
    for (int round = 0; round < kFairingRounds && mesh.points.size() > corners; ++round) {
      if (!fair_once(rim, mesh.triangles(), mesh.points)) break;
      mesh.flip_to_delaunay(exists);
    }
  }
  patch.points = std::move(mesh.points);
  patch.triangles = mesh.triangles();
  patch.nearest = nearest_corners(corners, patch.points, patch.triangles);
  return patch;
}

std::vector<Vec3d> interpolate_over_patch(const HolePatch& patch, std::span<const Vec3d> values) {
  std::vector<Vec3d> result(values.begin(), values.end());
  const std::size_t fixed = values.size(), all = patch.points.size();
  result.resize(all);
  if (all == fixed) return result;
  Laplacian laplacian(all);
  for (const Corners& t : patch.triangles) laplacian.add(patch.points, t);
  const Sparse differences = laplacian.matrix(all);
  const auto begin = static_cast<Eigen::Index>(fixed),
             count = static_cast<Eigen::Index>(all - fixed);
  const Sparse inside = -differences.middleCols(begin, count).bottomRows(count);
  Eigen::SimplicialLDLT<Sparse> solver(inside);
  const Values right = (differences * values_of(result)).bottomRows(count);
  const Values solved = solver.solve(right);
  for (std::size_t i = fixed; i < all; ++i) {
    const auto row = static_cast<Eigen::Index>(i - fixed);
    const bool is_solved = solver.info() == Eigen::Success && solved.row(row).allFinite();
    result[i] = is_solved ? Vec3d(solved(row, 0), solved(row, 1), solved(row, 2))
                          : values[patch.nearest[i]];
  }
  return result;
}

}  // namespace kiln
