#include "carving.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

#include "noise.h"

namespace kiln::sample {
namespace {

/// Offset of `x` from the middle of its repeat of the pattern: [-0.5, 0.5).
double offset_in_repeat(double x) { return x - std::floor(x) - 0.5; }

/// Height of a half circle of radius `radius` at distance `d` from its middle line; 0 outside.
double half_circle_height(double d, double radius) {
  return std::sqrt(std::max(0.0, radius * radius - d * d));
}

/// Half the width of a leaf, in units of the pattern's repeat. `t` runs from the leaf's foot (0) to its tip (1); the
/// leaf's outline is an ogive.
double leaf_half_width(double t) {
  if (t <= 0 || t >= 1) return 0;
  const double widest_position = 0.42;
  if (t < widest_position)
    return 0.40 + 0.08 * std::sin(0.5 * std::numbers::pi * t / widest_position);
  const double u = (t - widest_position) / (1 - widest_position);
  return 0.48 * std::pow(1 - u * u, 0.75);
}

/// Height of one leaf at a distance `x` from its midrib, in widths of the repeated pattern; negative outside the leaf.
double leaf(const BandPoint& p, double x, double tip) {
  const double size = 0.38 * p.height;  // scale of the relief; the width of a repeat varies with y
  const double t = p.y / tip;
  const double half = leaf_half_width(t) * p.width;
  const double across = std::abs(x) * p.width;
  // Distance to the leaf's outline: the distance along x, shortened by the outline's slope.
  const double step = 0.01;
  const double slant = (leaf_half_width(t + step) - leaf_half_width(t - step)) * p.width /
                       (2 * step * tip * p.height);
  const double inside = (half - across) / std::sqrt(1 + slant * slant);
  if (half <= 0 || inside <= -p.edge) return -1;
  const double rise = smooth_step(-p.edge / 2, p.edge, inside);
  const double share = std::clamp(across / half, 0.0, 1.0);
  const double bulge = 0.09 * size * (1 - share * share) * smooth_step(0, 0.35, t);
  const double rim_width = 0.05 * size;
  const double rim = 0.055 * size * half_circle_height(inside - rim_width, rim_width) / rim_width;
  const double rib =
      0.06 * size * std::exp(-std::pow(across / (0.055 * size), 2)) * smooth_step(1, 0.75, t);
  // Veins branch off the midrib towards the tip.
  const double vein_phase = (p.y * p.height - 0.7 * across) / (0.24 * size);
  const double vein_line = std::abs(vein_phase - std::round(vein_phase)) * 0.24 * size;
  const double vein = -0.035 * size * smooth_step(0.05 * size, 0.01 * size, vein_line) *
                      smooth_step(rim_width * 1.8, rim_width * 2.8, inside) *
                      smooth_step(0.05 * size, 0.12 * size, across);
  const double curl = 0.05 * size * smooth_step(0.6, 1.0, t);  // the tip bends outwards
  return 0.62 * rise * (0.09 * size + bulge + rim + rib + vein + curl);
}

constexpr int kMeanderRows = 7, kMeanderColumns = 8;
// The comments make clang-format keep one row per line.
constexpr std::array<std::string_view, kMeanderRows> kMeanderPattern = {
    "#######.",   // the band's end
    "#.....#.",   //
    "#.###.#.",   //
    "#.#...#.",   //
    "#.#####.",   //
    "#.......",   //
    "########"};  // the band's start

double is_raised_meander_cell(int column, int row) {
  if (row < 0 || row >= kMeanderRows) return 0;
  column = ((column % kMeanderColumns) + kMeanderColumns) % kMeanderColumns;
  return kMeanderPattern[static_cast<std::size_t>(kMeanderRows - 1 - row)]
                        [static_cast<std::size_t>(column)] == '#'
             ? 1.0
             : 0.0;
}

}  // namespace

double beads(const BandPoint& p) {
  const double radius = 0.5 * std::min(p.width, p.height) * 0.96;
  const double d = std::hypot(offset_in_repeat(p.x) * p.width, (p.y - 0.5) * p.height);
  return 0.75 * half_circle_height(d, radius);
}

double half_round_moulding(const BandPoint& p) {
  return 0.7 * half_circle_height((p.y - 0.5) * p.height, 0.5 * p.height);
}

double rope(const BandPoint& p) {
  const double round = half_circle_height((p.y - 0.5) * p.height, 0.5 * p.height);
  const double strand = offset_in_repeat(p.x + 0.9 * (p.y - 0.5));
  return round * (0.45 + 0.4 * std::sqrt(std::max(0.0, 1 - 4 * strand * strand)));
}

double leaves(const BandPoint& p) {
  const double front = leaf(p, offset_in_repeat(p.x), 0.84);
  const double back = leaf(p, offset_in_repeat(p.x + 0.5), 1.0) - 0.015 * p.height;
  return std::max({front, back, 0.0});
}

double guilloche(const BandPoint& p) {
  const double t = 2 * std::numbers::pi * p.x;
  const double cord_amplitude = 0.31 * p.height;
  const double cord = 0.155 * p.height;
  const double y = (p.y - 0.5) * p.height;
  double max_height = 0;
  for (const double side : {1.0, -1.0}) {
    const double middle = side * cord_amplitude * std::sin(t);
    const double steep = side * cord_amplitude * std::cos(t) * 2 * std::numbers::pi / p.width;
    const double d = (y - middle) / std::sqrt(1 + steep * steep);
    if (std::abs(d) >= cord) continue;
    const double over = side * std::cos(t);  // positive where this cord passes above the other one
    const double round = std::sqrt(1 - d * d / (cord * cord));
    const double groove_line = std::abs(std::abs(d) - 0.42 * cord);
    const double groove = smooth_step(0.16 * cord, 0.04 * cord, groove_line);
    max_height = std::max(max_height, cord * (0.45 * std::min(1.0, 1.6 * round) +
                                              0.28 * over * round - 0.20 * groove + 0.12));
  }
  // A boss in each opening between the cords: a ring around a half sphere.
  const double eye = offset_in_repeat(2 * p.x) * 0.5 * p.width;
  const double d = std::hypot(eye, y);
  const double boss = 0.15 * p.height;
  max_height = std::max(max_height, 0.8 * half_circle_height(d, 0.62 * boss));
  max_height = std::max(max_height, 0.9 * half_circle_height(d - 0.86 * boss, 0.14 * boss));
  // Small beads fill the corners between the crossings and the borders.
  const double corner =
      std::hypot(offset_in_repeat(2 * p.x + 0.5) * 0.5 * p.width, std::abs(y) - 0.36 * p.height);
  return std::max(max_height, 0.7 * half_circle_height(corner, 0.085 * p.height));
}

double scales(const BandPoint& p, int rows) {
  const double row_pitch = p.height / rows;
  const double y = p.y * p.height;
  // A scale's free edge is the lower half of an ellipse. Each row of scales covers the row below it.
  const double radius_x = 0.52 * p.width, radius_y = 1.25 * row_pitch;
  const int row = static_cast<int>(std::floor(y / row_pitch));
  // Visits the rows from the top down: the first scale that contains this point covers all others.
  for (int r = row + 1; r >= row - 1; --r) {
    const double centre = (r + 0.55) * row_pitch;
    if (r < 0 || r >= rows) continue;
    const double dx = offset_in_repeat(p.x + (r % 2 == 0 ? 0.0 : 0.5)) * p.width;
    const double dy = y - centre;
    if (dy > 0.55 * row_pitch && r < rows - 1) continue;
    const double q = std::hypot(dx / radius_x, std::min(dy, 0.0) / radius_y);
    if (q >= 1) continue;
    const double inside = (1 - q) * row_pitch;
    const double rise = smooth_step(0, p.edge, inside);
    const double tilt = 0.30 * row_pitch * std::clamp(-dy / radius_y + 0.45, 0.0, 1.4);
    const double keel = 0.14 * row_pitch * std::exp(-std::pow(dx / (0.13 * p.width), 2));
    const double line = std::abs(q - 0.80);
    const double groove = 0.05 * row_pitch * smooth_step(0.07, 0.02, line);
    return rise * (0.10 * row_pitch + tilt + keel - groove +
                   0.08 * row_pitch * (1 - dx * dx / (radius_x * radius_x)));
  }
  return 0;
}

double meander(const BandPoint& p) {
  const double margin = 0.04;
  const double row = (p.y - margin) / (1 - 2 * margin) * kMeanderRows - 0.5;
  const double column = (p.x - std::floor(p.x)) * kMeanderColumns - 0.5;
  const double cell = std::min(p.width / kMeanderColumns, p.height / kMeanderRows);
  const double half =
      std::min(0.5, 0.5 * p.edge / cell);  // half the width of a hard edge, in cells
  const int r = static_cast<int>(std::floor(row)), c = static_cast<int>(std::floor(column));
  const double v = smooth_step(0.5 - half, 0.5 + half, row - r);
  const double u = smooth_step(0.5 - half, 0.5 + half, column - c);
  const double low = is_raised_meander_cell(c, r) * (1 - u) + is_raised_meander_cell(c + 1, r) * u;
  const double high =
      is_raised_meander_cell(c, r + 1) * (1 - u) + is_raised_meander_cell(c + 1, r + 1) * u;
  return 0.75 * cell * (low * (1 - v) + high * v);
}

double flutes(const BandPoint& p) {
  const double radius = 0.40 * p.width;
  const double dx = offset_in_repeat(p.x) * p.width;
  const double y = (p.y - 0.5) * p.height;
  const double beyond = std::max(0.0, std::abs(y) - (0.5 * p.height - 1.2 * radius));
  const double d = std::hypot(dx, beyond) / radius;
  return d >= 1 ? 0 : -0.65 * radius * std::sqrt(1 - d * d);
}

double gadroons(const BandPoint& p, double twist) {
  const double x = 2 * offset_in_repeat(p.x + twist * p.y);
  const double end = smooth_step(0, 0.10, p.y) * smooth_step(1, 0.92, p.y);
  const double round = std::sqrt(std::max(0.0, 1 - x * x));
  const double crease = smooth_step(0.0, 0.10, 1 - std::abs(x));
  return end * p.width * 0.24 * (0.2 + 0.8 * round) * crease;
}

}  // namespace kiln::sample
