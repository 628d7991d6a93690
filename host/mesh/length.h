// Lengths in the working frame.
#pragma once

#include "kiln/types.h"
#include "mesh/frame.h"

namespace kiln {

/// A length in frame units. Shares are of the high poly's diagonal.
inline double to_frame(const Length& length, const Frame& frame) {
  return (length.relative ? length.value * frame.diagonal : length.value) * frame.scale;
}

}  // namespace kiln
