// Closed parts whose triangles face inwards.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Counts of closed components that are inside out. A component is connected over shared vertices.
struct InsideOut {
  std::uint64_t closed = 0;  ///< Number of components without an open edge
  /// Number of components of negative volume that lie in no box of a component of positive volume
  std::uint64_t count = 0;
  Vec3d example{};  ///< A point of the first inside-out component.
};

/// Inner walls of hollow bodies do not count as inside out: they lie within the box of another component.
InsideOut find_inside_out(const Work& work);

/// Warns that hulls of inside-out components would lie inside of these.
/// \param format_point  formats a point
void warn_of_inside_out(const Work& work,
                        const std::function<std::string(const Vec3d&)>& format_point,
                        std::vector<Warning>& warnings);

}  // namespace kiln
