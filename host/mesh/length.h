// Lengths in the working frame.
#pragma once

#include "kiln/types.h"
#include "mesh/frame.h"

namespace kiln {

/// Converts a length to frame units. A percentage refers to the high poly's diagonal.
inline double to_frame(const Length& length, const Frame& frame) {
  return (length.relative ? length.value * frame.diagonal : length.value) * frame.scale;
}

}  // namespace kiln
