// Solid noise in double precision: the same values on every machine.
#pragma once

#include <cstdint>

namespace kiln::sample {

struct Point {
  double x = 0, y = 0, z = 0;
};

inline Point operator+(const Point& a, const Point& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Point operator-(const Point& a, const Point& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point operator*(double s, const Point& a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(const Point& a, const Point& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Returns 0 for values below `low`, 1 above `high`, and a smooth cubic between them.
double smooth_step(double low, double high, double x);

/// Gradient noise (Perlin, "Improving Noise", 2002), about [-1, 1], features of size 1.
double gradient_noise(const Point& p, std::uint32_t seed);

/// Sum of `octaves` of gradient noise, each with twice the frequency and half the amplitude of the previous one.
double fractal_noise(const Point& p, int octaves, std::uint32_t seed);

/// Ridged multifractal (Musgrave, in "Texturing and Modeling", 2003, chapter 16), about [0, 1]: sharp ridges, with
/// finer detail at greater heights.
double ridged_noise(const Point& p, int octaves, std::uint32_t seed);

/// Cellular noise (Worley 1996) with one random point a unit cell.
struct Cells {
  double nearest;           ///< Distance to the nearest point
  double border;            ///< Distance to the border of the nearest point's cell
  std::uint32_t cell_hash;  ///< Hash of the cell whose point is nearest
};
Cells cellular_noise(const Point& p, std::uint32_t seed);

/// A hash as a number in [0, 1).
double unit_from(std::uint32_t hash);

}  // namespace kiln::sample
