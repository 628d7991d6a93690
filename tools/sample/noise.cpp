#include "noise.h"

#include <algorithm>
#include <cmath>

namespace kiln::sample {
namespace {

/// One word of the hash PCG3D (Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020).
std::uint32_t hash(std::int64_t ix, std::int64_t iy, std::int64_t iz, std::uint32_t seed) {
  std::uint32_t x = static_cast<std::uint32_t>(ix) * 1664525u + 1013904223u + seed;
  std::uint32_t y = static_cast<std::uint32_t>(iy) * 1664525u + 1013904223u;
  std::uint32_t z = static_cast<std::uint32_t>(iz) * 1664525u + 1013904223u;
  for (int round = 0; round < 2; ++round) {
    x += y * z;
    y += z * x;
    z += x * y;
    x ^= x >> 16;
    y ^= y >> 16;
    z ^= z >> 16;
  }
  return x ^ (y * 0x9E3779B9u) ^ (z * 0x85EBCA6Bu);
}

double slope(std::uint32_t h, double x, double y, double z) {
  switch (h &
          15u) {  // gradients: directions to the twelve edges of a cube, four of them used twice
    case 0:
    case 12:
      return x + y;
    case 1:
    case 13:
      return y - x;
    case 2:
      return x - y;
    case 3:
      return -x - y;
    case 4:
      return x + z;
    case 5:
      return z - x;
    case 6:
      return x - z;
    case 7:
      return -x - z;
    case 8:
      return y + z;
    case 9:
    case 14:
      return z - y;
    case 10:
      return y - z;
    default:
      return -y - z;
  }
}

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double mix(double a, double b, double t) { return a + (b - a) * t; }

}  // namespace

double unit_from(std::uint32_t hash) { return hash * 0x1p-32; }

double smooth_step(double low, double high, double x) {
  const double t = std::clamp((x - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

double gradient_noise(const Point& p, std::uint32_t seed) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  const auto ix = static_cast<std::int64_t>(fx), iy = static_cast<std::int64_t>(fy);
  const auto iz = static_cast<std::int64_t>(fz);
  const double x = p.x - fx, y = p.y - fy, z = p.z - fz;
  const auto corner = [&](int dx, int dy, int dz) {
    return slope(hash(ix + dx, iy + dy, iz + dz, seed), x - dx, y - dy, z - dz);
  };
  const double u = fade(x), v = fade(y), w = fade(z);
  return mix(
      mix(mix(corner(0, 0, 0), corner(1, 0, 0), u), mix(corner(0, 1, 0), corner(1, 1, 0), u), v),
      mix(mix(corner(0, 0, 1), corner(1, 0, 1), u), mix(corner(0, 1, 1), corner(1, 1, 1), u), v),
      w);
}

double fractal_noise(const Point& p, int octaves, std::uint32_t seed) {
  double sum = 0, height = 1;
  Point q = p;
  for (int i = 0; i < octaves; ++i) {
    sum += height * gradient_noise(q, seed + static_cast<std::uint32_t>(i));
    height *= 0.5;
    q = 2.03 * q;  // a factor of exactly 2 would align the lattices of all octaves
  }
  return sum;
}

double ridged_noise(const Point& p, int octaves, std::uint32_t seed) {
  double sum = 0, height = 0.5, weight = 1;
  Point q = p;
  for (int i = 0; i < octaves; ++i) {
    double ridge = 1 - std::abs(gradient_noise(q, seed + static_cast<std::uint32_t>(i)));
    ridge *= ridge * weight;
    weight = std::clamp(2 * ridge, 0.0, 1.0);
    sum += height * ridge;
    height *= 0.5;
    q = 2.03 * q;
  }
  return sum;
}

Cells cellular_noise(const Point& p, std::uint32_t seed) {
  const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
  Point nearest, second;
  double nearest_square = 1e30, second_square = 1e30;
  std::uint32_t nearest_hash = 0;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const std::uint32_t h =
            hash(static_cast<std::int64_t>(fx) + dx, static_cast<std::int64_t>(fy) + dy,
                 static_cast<std::int64_t>(fz) + dz, seed);
        const Point offset{fx + dx + (h & 1023u) / 1024.0 - p.x,
                           fy + dy + ((h >> 10) & 1023u) / 1024.0 - p.y,
                           fz + dz + ((h >> 20) & 1023u) / 1024.0 - p.z};
        const double square = dot(offset, offset);
        if (square < nearest_square) {
          second = nearest;
          second_square = nearest_square;
          nearest = offset;
          nearest_square = square;
          nearest_hash = h * 0x9E3779B1u;
        } else if (square < second_square) {
          second = offset;
          second_square = square;
        }
      }
    }
  }
  // Distance to the plane half-way between the two nearest points.
  const Point between = second - nearest;
  const double apart = std::sqrt(std::max(dot(between, between), 1e-12));
  return {std::sqrt(nearest_square), (second_square - nearest_square) / (2 * apart), nearest_hash};
}

}  // namespace kiln::sample
