// Checks the invariants of volumes that readers return.
#pragma once

#include <cmath>
#include <cstdint>
#include <string>

#include "kiln/volume.h"

namespace kiln::test {

/// The first invariant of kiln/volume.h that the volume violates; empty if it violates none.
inline std::string broken_promise(const Volume& volume) {
  std::uint64_t bytes = size_of(volume.type);
  for (const std::uint32_t n : volume.size) {
    if (n == 0) return "a size of 0";
    bytes *= n;
  }
  if (bytes != volume.voxels.size()) return "the number of voxels differs from the size";
  for (const double value : volume.origin) {
    if (!std::isfinite(value)) return "origin not finite";
  }
  const auto& [u, v, w] = volume.axes;
  long double length = 1;
  for (const auto& axis : volume.axes) length *= std::hypot(axis[0], axis[1], axis[2]);
  const auto minor = [](long double a, long double b, long double c, long double d) {
    return a * d - b * c;
  };
  const long double cell = u[0] * minor(v[1], v[2], w[1], w[2]) -
                           u[1] * minor(v[0], v[2], w[0], w[2]) +
                           u[2] * minor(v[0], v[1], w[0], w[1]);
  if (!(std::abs(cell) >= 0.99e-4L * length)) return "axes not independent";
  return {};
}

}  // namespace kiln::test
