// Closed parts whose triangles face inwards.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Counts of closed components that are inside out. Components share vertices.
struct InsideOut {
  std::uint64_t closed = 0;  ///< Components without an open edge.
  std::uint64_t count =
      0;  ///< Components of negative volume that lie in no box of a component of positive volume.
  Vec3d place{};  ///< A point of the first inside-out component.
};

/// Inner walls of shells are no errors: they lie within the box of another component.
InsideOut find_inside_out(const Work& work);

/// Warns that hulls of these components would lie inside of them.
/// \param in_words  formats a point
void warn_of_inside_out(const Work& work, const std::function<std::string(const Vec3d&)>& in_words,
                        std::vector<Warning>& warnings);

}  // namespace kiln
