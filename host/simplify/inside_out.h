// Closed parts whose triangles face inwards.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "kiln/error.h"
#include "simplify/simplify_input.h"

namespace kiln {

/// Parts of a mesh, by shared vertices, that are closed and inside out.
struct InsideOut {
  std::uint64_t closed = 0;  ///< Parts without an open edge
  std::uint64_t count =
      0;        ///< Parts with negative volume, outside the box of every part with positive volume
  Vec3d place;  ///< In the first of them
};

/// Inner sides of shells face inwards rightly: they lie in the box of another part.
InsideOut find_inside_out(const Work& work);

/// For hulls, which would lie within. \param in_words  a place
void warn_of_inside_out(const Work& work, const std::function<std::string(const Vec3d&)>& in_words,
                        std::vector<Warning>& warnings);

}  // namespace kiln
