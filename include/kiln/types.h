#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

namespace kiln {

struct Vec2 {
  float x = 0, y = 0;
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

struct Vec3 {
  float x = 0, y = 0, z = 0;
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

/// Three indices, counter-clockwise seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// A length in world units, or as a share of the dense mesh's bounding-box diagonal.
struct Length {
  double value = 0;
  bool relative = true;
  static Length share(double of_diagonal) { return {of_diagonal, true}; }
  static Length absolute(double units) { return {units, false}; }
};

/// Called with the share done, in [0, 1], and what is being done; return false to cancel.
using Progress = std::function<bool(double done, std::string_view stage)>;

}  // namespace kiln
