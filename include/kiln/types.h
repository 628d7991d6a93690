#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string_view>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// Two numbers: a position in a UV layout, u to the right and v up.
struct Vec2 {
  float x = 0;  ///< Along u
  float y = 0;  ///< Along v
  friend bool operator==(const Vec2&, const Vec2&) = default;
};

/// Three numbers: a point or a direction.
struct Vec3 {
  float x = 0;  ///< Along the first axis
  float y = 0;  ///< Along the second axis
  float z = 0;  ///< Along the third axis
  friend bool operator==(const Vec3&, const Vec3&) = default;
};

/// Three indices, counter-clockwise seen from outside.
using Triangle = std::array<std::uint32_t, 3>;

/// A length in world units, or as a share of the high poly's bounding-box diagonal.
struct Length {
  double value = 0;      ///< Length in world units, or share of the diagonal (0.02 is 2%)
  bool relative = true;  ///< `value` is a share of the diagonal
  /// A share of the diagonal.
  static Length share(double of_diagonal) { return {of_diagonal, true}; }
  /// World units.
  static Length absolute(double units) { return {units, false}; }
};

/// Default search distance of matches, as a share of the high poly's diagonal.
inline constexpr double kSearchDistance = 0.02;

/// Default width of the padding around charts, texels.
inline constexpr std::int32_t kPaddingTexels = 16;

/// Called with the completed share of the work, in [0, 1], and the name of the current step; return false to
/// cancel.
///
/// Threads: it runs on the thread that called Kiln, never concurrently for one call. It is called ten times a
/// second, also while the driver compiles kernels. If it cancels then, the function returns at once; the
/// compilation continues in a thread of the Device, for the next call that needs the kernels. The callback may
/// block (the work waits), throw, and call functions of Kiln that do not use the same Device. It must not
/// change the call's arguments. Its exceptions leave the function that was called, without a partial result.
/// Lifetimes: `stage` is valid during the callback. The callback is not called after the function has returned.
using Progress = std::function<bool(double done, std::string_view stage)>;

}  // namespace kiln
