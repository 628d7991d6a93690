// Solvers of flat charts; each round solves a sparse linear system.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <vector>

#include "unwrap/flat_chart.h"
#include "unwrap/flat_predicates.h"
#include "unwrap/flat_system.h"

namespace kiln {
namespace {

/// The symmetric 2 x 2 matrix ((xx, xy), (xy, yy)).
struct SymmetricMatrix2 {
  double xx = 1, xy = 0, yy = 1;
};

/// A map's first derivatives on a triangle: the rows of the Jacobian.
struct Jacobian {
  Vec2d u{}, v{};
};

Jacobian jacobian(const FlatChart& chart, std::size_t i, const std::vector<Vec2d>& points) {
  Jacobian j;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2d& p = points[chart.triangles[i][k]];
    j.u = j.u + chart.rest[i].gradient[k] * p.x;
    j.v = j.v + chart.rest[i].gradient[k] * p.y;
  }
  return j;
}

/// Rotation nearest to the map, as cosine and sine.
Vec2d nearest_rotation(const Jacobian& j) {
  const double c = j.u.x + j.v.y, s = j.v.x - j.u.y, size = std::sqrt(c * c + s * s);
  return size > 0 ? Vec2d{c / size, s / size} : Vec2d{1, 0};
}

/// Weight matrix of the squared distance between the Jacobian and its nearest rotation. With this weight, the distance
/// has the same gradient as the symmetric Dirichlet energy (Rabinovich et al. 2017, equation 15).
SymmetricMatrix2 dirichlet_weight(const Jacobian& j) {
  const double det = cross(j.u, j.v);
  const double sum = dot(j.u, j.u) + dot(j.v, j.v);
  const double root = std::sqrt(std::max(0.0, sum * sum - 4 * det * det));
  const double a2 = 0.5 * (sum + root), a = std::sqrt(a2), b = det / a, b2 = b * b;
  const auto g = [](double s) { return (s + 1) * (s * s + 1) / (s * s * s); };
  if (a2 - b2 < 1e-9 * a2) return {g(a), 0, g(a)};
  const double slope = (g(a) - g(b)) / (a2 - b2), intercept = g(a) - slope * a2;
  return {intercept + slope * dot(j.u, j.u), slope * dot(j.u, j.v),
          intercept + slope * dot(j.v, j.v)};
}

double energy(const FlatChart& chart, const std::vector<Vec2d>& points) {
  double sum = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Jacobian j = jacobian(chart, i, points);
    const double det = cross(j.u, j.v);
    if (!(det > 0)) return std::numeric_limits<double>::infinity();
    sum += chart.rest[i].area * (dot(j.u, j.u) + dot(j.v, j.v)) * (1 + 1 / (det * det));
  }
  return sum;
}

/// The largest step along `direction` before a triangle degenerates (Smith, Schaefer 2015, section 3.3).
double flip_distance(const FlatChart& chart, const std::vector<Vec2d>& direction) {
  double best = std::numeric_limits<double>::infinity();
  for (const Triangle& t : chart.triangles) {
    const Vec2d e = chart.points[t[1]] - chart.points[t[0]];
    const Vec2d f = chart.points[t[2]] - chart.points[t[0]];
    const Vec2d de = direction[t[1]] - direction[t[0]], df = direction[t[2]] - direction[t[0]];
    const double a = cross(de, df), b = cross(e, df) + cross(de, f), c = cross(e, f);
    const double discriminant = b * b - 4 * a * c;
    if (discriminant < 0) continue;
    // Both roots are computed without cancellation. The result is the smaller positive one.
    const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
    for (const double root : {a != 0 ? q / a : -1.0, q != 0 ? c / q : -1.0}) {
      if (root > 0) best = std::min(best, root);
    }
  }
  return best;
}

/// The linear system of one step. Its solution minimizes the weighted distances to the nearest rotations.
class StepSystem {
 public:
  /// \param known  linear system of the same triangles, or null
  StepSystem(const FlatChart& chart, const RigidSystem* known)
      : system_(known != nullptr ? known->pattern() : std::make_shared<const FlatPattern>(chart)) {}

  /// \returns false if there is no solution
  /// \param pinned  vertices that are held in place by a large weight
  bool solve(const FlatChart& chart, std::vector<Vec2d>& target,
             std::span<const std::uint32_t> pinned = {}) {
    // Weight of the proximal term. It keeps the system definite, although the whole chart can move and rotate freely,
    // and damps large steps.
    constexpr double kProximalWeight = 1e-4;
    system_.clear();
    target = chart.points;
    for (std::uint32_t v = 0; v < target.size(); ++v) {
      target[v] = target[v] * kProximalWeight;
      system_.vertex_block(v) = {kProximalWeight, 0, 0, kProximalWeight};
    }
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) add(chart, i, target);
    constexpr double kPinWeight = 1e3;  // Weight of a pin, relative to the weights of triangles
    for (const std::uint32_t v : pinned) {
      FlatSystem<2>::Block& diagonal_block = system_.vertex_block(v);
      const double by = kPinWeight * (diagonal_block[0] + diagonal_block[3]);
      diagonal_block[0] += by, diagonal_block[3] += by;
      target[v] = target[v] + chart.points[v] * by;
    }
    return system_.factorize() && system_.solve(target);
  }

 private:
  static void add(FlatSystem<2>::Block& block, double weight, const SymmetricMatrix2& m) {
    block[0] += weight * m.xx;
    block[1] += weight * m.xy;
    block[2] += weight * m.xy;
    block[3] += weight * m.yy;
  }

  void add(const FlatChart& chart, std::size_t i, std::vector<Vec2d>& right) {
    const Jacobian j = jacobian(chart, i, chart.points);
    const SymmetricMatrix2 m = dirichlet_weight(j);
    const Vec2d r = nearest_rotation(j);
    const RestShape& rest = chart.rest[i];
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec2d& g = rest.gradient[k];
      const Vec2d rotated_gradient{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      Vec2d& force = right[chart.triangles[i][k]];
      force = force + Vec2d{m.xx * rotated_gradient.x + m.xy * rotated_gradient.y,
                            m.xy * rotated_gradient.x + m.yy * rotated_gradient.y} *
                          rest.area;
      add(system_.corner_block(i, k), rest.area * dot(g, g), m);
      add(system_.edge_block(i, k), rest.area * dot(g, rest.gradient[(k + 1) % 3]), m);
    }
  }

  FlatSystem<2> system_;
};

/// Finds border vertices that would touch the border after a full step, and pins them.
/// \returns true if there are any
bool pin_touching(const FlatChart& chart, const std::vector<Vec2d>& to,
                  std::vector<std::uint32_t>& pinned) {
  constexpr std::size_t kMaxTouches = 1000, kPinReach = 2;
  std::vector<Vec2d> border;
  for (const std::uint32_t v : chart.boundary) border.push_back(to[v]);
  const auto found = touching_sides(border, chart.min_border_distance, kMaxTouches);
  if (found.empty()) return false;
  const std::size_t count = border.size();
  std::vector<std::uint8_t> is_pinned(chart.points.size(), 0);
  for (const std::uint32_t v : pinned) is_pinned[v] = 1;
  for (const auto& [a, b] : found) {
    for (const std::size_t side : {a, b}) {
      for (std::size_t n = 0; n < 2 * kPinReach + 2; ++n) {
        const std::uint32_t v = chart.boundary[(side + n + count * kPinReach - kPinReach) % count];
        if (is_pinned[v] == 0) pinned.push_back(v);
        is_pinned[v] = 1;
      }
    }
  }
  return true;
}

}  // namespace

std::shared_ptr<RigidSystem> rigid_system(const FlatChart& chart) {
  return std::make_shared<RigidSystem>(chart);
}

bool rigid_rounds(FlatChart& chart, int rounds, RigidSystem& system, const FlatStart* start) {
  system.fill(chart, {});
  std::vector<Vec2d> hold_forces;
  if (start != nullptr) {
    for (std::uint32_t v = 0; v < chart.points.size(); ++v) {
      double& diagonal = system.vertex_block(v)[0];
      const double weight = start->hold_weights[v] * diagonal;
      diagonal += weight;
      hold_forces.push_back(start->vertex_positions[v] * weight);
    }
    chart.points = start->vertex_positions;
  }
  // Anchors vertex 0 at its position. The other forces sum to 0, so the anchor causes no distortion.
  double& weight = system.vertex_block(0)[0];
  const Vec2d anchor = chart.points[0] * weight;
  weight += weight;
  if (!system.factorize()) return false;
  std::vector<Vec2d> points(chart.points.size());
  for (int round = 0; round < rounds; ++round) {
    if (hold_forces.empty()) {
      std::fill(points.begin(), points.end(), Vec2d{});
    } else {
      points = hold_forces;
    }
    points[0] = points[0] + anchor;
    for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
      const Vec2d r = round == 0 && start != nullptr
                          ? start->rotations[i]
                          : nearest_rotation(jacobian(chart, i, chart.points));
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec2d g = chart.rest[i].gradient[k] * chart.rest[i].area;
        Vec2d& force = points[chart.triangles[i][k]];
        force = force + Vec2d{r.x * g.x - r.y * g.y, r.y * g.x + r.x * g.y};
      }
    }
    if (!system.solve(points)) return false;
    std::swap(chart.points, points);
  }
  return true;
}

double rigid_energy(const FlatChart& chart) {
  double area = 0, sum = 0;
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const Jacobian j = jacobian(chart, i, chart.points);
    const Vec2d r = nearest_rotation(j);
    const Vec2d u = j.u - Vec2d{r.x, -r.y}, v = j.v - Vec2d{r.y, r.x};
    area += chart.rest[i].area;
    sum += chart.rest[i].area * (dot(u, u) + dot(v, v));
  }
  return sum / area;
}

void injective_rounds(FlatChart& chart, int rounds, const ChartLimits* until,
                      const RigidSystem* known, bool pins) {
  constexpr double kMinConvergedProgress = 1e-5, kMinUsefulProgress = 0.01;
  double current_energy = energy(chart, chart.points);
  // The limit in the units of energy(), which sums over the area.
  const double area = std::accumulate(chart.rest.begin(), chart.rest.end(), 0.0,
                                      [](double sum, const RestShape& r) { return sum + r.area; });
  const double target_energy = until == nullptr
                                   ? std::numeric_limits<double>::infinity()
                                   : 4 * area * (1 + until->energy + chart.roughness_energy);
  std::optional<StepSystem> system;
  std::vector<std::uint32_t> pinned;
  for (int round = 0; round < rounds; ++round) {
    if (until != nullptr && is_within_limits(chart, *until)) return;
    if (!system) system.emplace(chart, known);
    std::vector<Vec2d> direction;
    if (!system->solve(chart, direction, pinned)) return;
    if (pins && round < rounds / 2 && pin_touching(chart, direction, pinned) &&
        !system->solve(chart, direction, pinned))
      return;
    for (std::size_t v = 0; v < direction.size(); ++v)
      direction[v] = direction[v] - chart.points[v];
    double step = std::min(1.0, 0.8 * flip_distance(chart, direction));
    const std::vector<Vec2d> points_before = chart.points;
    const double previous_energy = current_energy;
    bool any_moved = false;
    for (int attempt = 0; attempt < 12 && !any_moved; ++attempt, step *= 0.5) {
      for (std::size_t v = 0; v < points_before.size(); ++v) {
        chart.points[v] = points_before[v] + direction[v] * step;
      }
      current_energy = energy(chart, chart.points);
      any_moved =
          current_energy < previous_energy && is_injective(chart, chart.min_border_distance);
    }
    if (!any_moved) {
      chart.points = points_before;
      return;
    }
    // Stops on convergence. While the energy is above the limit, also stops when progress is too slow to reach the
    // limit.
    if (previous_energy - current_energy <
        (current_energy > target_energy ? kMinUsefulProgress : kMinConvergedProgress) *
            previous_energy)
      return;
  }
}

}  // namespace kiln
