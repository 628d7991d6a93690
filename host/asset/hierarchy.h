// Affine maps and unique names, for the readers of formats with a hierarchy of nodes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>

namespace kiln {

/// An affine map as a 4 x 4 matrix in column-major order.
using AffineMap = std::array<double, 16>;
inline constexpr AffineMap kIdentityMap{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};

/// The product of two maps. The result applies `b` first.
inline AffineMap product(const AffineMap& a, const AffineMap& b) {
  AffineMap result{};
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t row = 0; row < 4; ++row) {
      for (std::size_t k = 0; k < 4; ++k) {
        result[4 * column + row] += a[4 * k + row] * b[4 * column + k];
      }
    }
  }
  return result;
}

/// Makes names unique by adding numbers, as Blender does: "arm", "arm.001".
class UniqueNames {
 public:
  std::string add(const std::string& name) {
    const auto [entry, added] = request_counts_.emplace(name, 0);
    if (added) return name;
    for (;;) {
      char number[16];
      std::snprintf(number, sizeof number, ".%03u", ++entry->second);
      if (request_counts_.emplace(name + number, 0).second) return name + number;
    }
  }

 private:
  // Names in use, with the number of requests for each
  std::map<std::string, std::uint32_t> request_counts_;
};

}  // namespace kiln
