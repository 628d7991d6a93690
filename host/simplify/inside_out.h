// Finds closed components whose triangles face inwards.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Number of closed components, and of those that are inside out. A component is connected over shared vertices.
struct InsideOutComponents {
  std::uint64_t closed = 0;  ///< Number of components without an open edge
  /// Number of components that have a negative volume and lie in no box of a component of positive volume
  std::uint64_t count = 0;
  Vec3d example{};  ///< A point of the first inside-out component
};

/// Finds closed components that face inwards. The inner wall of a hollow body does not count as inside out, since it
/// lies within the box of another component.
InsideOutComponents find_inside_out(const Work& work);

/// Warns that the hull of an inside-out component would lie inside of that component.
/// \param format_point  formats a point for the message
void warn_of_inside_out(const Work& work,
                        const std::function<std::string(const Vec3d&)>& format_point,
                        std::vector<Warning>& warnings);

}  // namespace kiln
