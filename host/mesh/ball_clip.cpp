// CMakeLists.txt compiles this file without traps and errno for floating-point operations, so that loops over lanes
// become vector instructions. Neither setting changes a result.
#include "mesh/ball_clip.h"

#include <cmath>
#include <numbers>

// Functions called in loops over lanes must be inlined: the loops are compiled once for each instruction set.
#if defined(__GNUC__)
#define KILN_INLINE __attribute__((always_inline)) inline
#define KILN_INLINE_LAMBDA __attribute__((always_inline))
#else
#define KILN_INLINE inline
#define KILN_INLINE_LAMBDA
#endif

namespace kiln {
namespace {

struct Point {
  double x, y, z;
};
KILN_INLINE Point operator-(const Point& a, const Point& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
KILN_INLINE double dot_of(const Point& a, const Point& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
KILN_INLINE Point cross_of(const Point& a, const Point& b) {
  return {a.y * b.z - b.y * a.z, a.z * b.x - b.z * a.x, a.x * b.y - b.x * a.y};
}
KILN_INLINE double lesser(double a, double b) { return b < a ? b : a; }
KILN_INLINE double greater(double a, double b) { return a < b ? b : a; }

/// Angle of a complex number in [-pi, pi], to 1.5 units in the last place, without branches. The bits are the same with
/// any math library.
KILN_INLINE double angle_of(double imaginary, double real) {
  constexpr double kTanPiOver8 = 0.41421356237309503;  // tan(pi / 8)
  const double x = std::abs(real), y = std::abs(imaginary);
  const double high = greater(x, y), low = lesser(x, y);
  // Computes atan(low / high). If the result exceeds pi / 8, computes it as pi / 4 + atan((low - high) / (low + high)).
  const double least = kTanPiOver8 * high;
  const double above = low > least ? low - high : low, below = low > least ? low + high : high;
  const double z = above / (below > 0 ? below : 1), s = z * z;
  // (atan(z) / z - 1) / z^2 as a polynomial in z^2, interpolated at the Chebyshev nodes between z = 0 and tan(pi / 8).
  // The error of atan(z) is below 2e-18.
  double sum = -0x1.3a31b1c0fd3b7p-6;
  sum = sum * s + 0x1.4162c02b1dda3p-5;
  sum = sum * s - 0x1.a0999c632b6edp-5;
  sum = sum * s + 0x1.dfe6497e96323p-5;
  sum = sum * s - 0x1.10fa77b1a6d57p-4;
  sum = sum * s + 0x1.3b1263064f6b9p-4;
  sum = sum * s - 0x1.745d0b28a7e37p-4;
  sum = sum * s + 0x1.c71c71853d7fap-4;
  sum = sum * s - 0x1.2492492436201p-3;
  sum = sum * s + 0x1.999999999934cp-3;
  sum = sum * s - 0x1.5555555555555p-2;
  double angle = z + z * (s * sum);
  angle = low > least ? angle + std::numbers::pi / 4 : angle;
  angle = y > x ? std::numbers::pi / 2 - angle : angle;
  angle = real < 0 ? std::numbers::pi - angle : angle;
  return std::copysign(angle, imaginary);
}

/// clip_by_ball() for one lane, without branches.
KILN_INLINE BallClip clip(const Point& a, const Point& b, const Point& c, double squared_radius) {
  const Point across = cross_of(b - a, c - a);
  const double doubled_area = std::sqrt(dot_of(across, across));
  const double inverse = doubled_area > 0 ? 1 / (doubled_area > 0 ? doubled_area : 1) : 0;
  const Point normal{across.x * inverse, across.y * inverse, across.z * inverse};
  const double plane_distance = dot_of(normal, a);
  const double squared_circle_radius = squared_radius - plane_distance * plane_distance;
  // Adds the angles of the sectors by multiplying complex numbers, so that one arctangent suffices.
  double real = 1, imaginary = 0;
  const auto turn = [&](double least, double cosine, double sine) KILN_INLINE_LAMBDA {
    const double turned_real = real * cosine - imaginary * sine;
    const double turned_imaginary = real * sine + imaginary * cosine;
    real = least > 0 ? turned_real : real;
    imaginary = least > 0 ? turned_imaginary : imaginary;
  };
  double triangles = 0;
  // The circle's centre lies in the triangle if no edge has it on its right. All lines are far from it if all margins
  // are positive.
  double least_side = HUGE_VAL, least_margin = HUGE_VAL;
  const auto clip_edge = [&](const Point& p, const Point& q) KILN_INLINE_LAMBDA {
    const Point edge_vector = q - p;
    const double squared_length = dot_of(edge_vector, edge_vector),
                 start_dot_edge = dot_of(p, edge_vector), squared_start = dot_of(p, p);
    const double root =
        start_dot_edge * start_dot_edge - squared_length * (squared_start - squared_radius);
    // Above 0 if the line through the edge meets the ball
    const double squared_half_chord = lesser(root, squared_length);
    const double reach = std::sqrt(squared_half_chord > 0 ? root : 0),
                 scale = 1 / (squared_length > 0 ? squared_length : 1);
    const double begin = squared_half_chord > 0 ? greater(0, (-start_dot_edge - reach) * scale) : 1;
    const double end = squared_half_chord > 0 ? lesser(1, (-start_dot_edge + reach) * scale) : 0;
    const double length = end - begin;  // Above 0 if a part of the edge lies in the ball
    const double share = length > 0 ? length : 0;
    // Dot and cross products of the end points of the edge's part in the ball, relative to the circle's centre.
    const double in_plane = squared_start - plane_distance * plane_distance,
                 side = dot_of(normal, cross_of(p, edge_vector));
    least_side = lesser(least_side, side);
    least_margin =
        lesser(least_margin, side * side - 0.81 * squared_circle_radius * squared_length);
    triangles += side * share;
    const double before = length > 0 ? begin : 1, after = length > 0 ? 1 - end : 0;
    turn(before, in_plane + before * start_dot_edge, side * before);
    turn(after, in_plane + (1 + end) * start_dot_edge + end * squared_length, side * after);
    return share;
  };
  BallClip result;
  result.edge_share[0] = clip_edge(a, b);
  result.edge_share[1] = clip_edge(b, c);
  result.edge_share[2] = clip_edge(c, a);
  // The angle lies in [0, 2 pi], and below pi if the centre lies outside. Rounding must not turn 0 into 2 pi, or 2 pi
  // into 0.
  constexpr double kMinAngle = 1e-9, kFullTurn = 2 * std::numbers::pi;
  const double principal_angle = angle_of(imaginary, real);
  const double lowest_angle = least_side >= 0 ? 0 : -std::numbers::pi / 2;
  const double positive =
      principal_angle < lowest_angle ? principal_angle + kFullTurn : principal_angle;
  const double size = least_side >= 0 ? std::abs(principal_angle) : kFullTurn;
  const double full_or_no_turn = least_margin > 0 ? kFullTurn : 0;
  const double angle = size < kMinAngle ? full_or_no_turn : positive;
  const double sectors = (triangles + squared_circle_radius * angle) / 2;
  const double area = lesser(greater(sectors, 0), doubled_area / 2);
  result.area = lesser(squared_circle_radius, doubled_area) > 0 ? area : 0;
  return result;
}

/// \tparam kSkips  true: skips triangles that lie entirely inside or outside of the ball, which needs branches
template <bool kSkips>
KILN_INLINE void sum_lanes(BallBatch& batch, double squared_radius) {
  const double* __restrict const from = batch.corner[0].data();
  const double* __restrict const angles = batch.angle[0].data();
  double* __restrict const areas = batch.area.data();
  double* __restrict const bends = batch.bend.data();
  constexpr std::size_t n = BallBatch::kLanes;
  for (std::size_t i = 0; i < n; ++i) {
    const Point a{from[i], from[i + n], from[i + 2 * n]},
        b{from[i + 3 * n], from[i + 4 * n], from[i + 5 * n]},
        c{from[i + 6 * n], from[i + 7 * n], from[i + 8 * n]};
    const double farthest = greater(greater(dot_of(a, a), dot_of(b, b)), dot_of(c, c));
    // The nearest point of the triangle's box
    const auto nearest = [](double p, double q, double r) KILN_INLINE_LAMBDA {
      return greater(greater(lesser(lesser(p, q), r), -greater(greater(p, q), r)), 0);
    };
    const Point near{nearest(a.x, b.x, c.x), nearest(a.y, b.y, c.y), nearest(a.z, b.z, c.z)};
    const double nearest_squared = dot_of(near, near);
    if constexpr (kSkips) {
      if (farthest <= squared_radius) continue;
      if (nearest_squared >= squared_radius) {
        areas[i] = bends[i] = 0;
        continue;
      }
    }
    const BallClip clipped = clip(a, b, c, squared_radius);
    const Point ab = b - a, bc = c - b, ca = a - c;
    double bend = 0;
    bend += angles[i] * clipped.edge_share[0] * std::sqrt(dot_of(ab, ab)) / 4;
    bend += angles[i + n] * clipped.edge_share[1] * std::sqrt(dot_of(bc, bc)) / 4;
    bend += angles[i + 2 * n] * clipped.edge_share[2] * std::sqrt(dot_of(ca, ca)) / 4;
    const double whole_area = areas[i], whole_bend = bends[i];
    const double cut_area = nearest_squared < squared_radius ? clipped.area : 0;
    const double cut_bend = nearest_squared < squared_radius ? bend : 0;
    areas[i] = farthest <= squared_radius ? whole_area : cut_area;
    bends[i] = farthest <= squared_radius ? whole_bend : cut_bend;
  }
}

using Sum = void (*)(BallBatch&, double);

void sum_plain(BallBatch& batch, double squared_radius) { sum_lanes<true>(batch, squared_radius); }

// With GCC on Windows, stacks are not aligned for AVX.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(_WIN32)
__attribute__((target("avx2"))) void sum_avx2(BallBatch& batch, double squared_radius) {
  sum_lanes<false>(batch, squared_radius);
}
__attribute__((target("avx512f,avx512dq,avx512vl"))) void sum_avx512(BallBatch& batch,
                                                                     double squared_radius) {
  sum_lanes<false>(batch, squared_radius);
}

Sum choose_sum() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl"))
    return sum_avx512;
  return __builtin_cpu_supports("avx2") ? sum_avx2 : sum_plain;
}
#else
Sum choose_sum() { return sum_plain; }
#endif

}  // namespace

BallClip clip_by_ball(const std::array<Vec3d, 3>& corners, double squared_radius) {
  const auto point = [&](std::size_t k) { return Point{corners[k].x, corners[k].y, corners[k].z}; };
  return clip(point(0), point(1), point(2), squared_radius);
}

void sum_in_ball(BallBatch& batch, double squared_radius) {
  static const Sum sum = choose_sum();
  sum(batch, squared_radius);
}

}  // namespace kiln
