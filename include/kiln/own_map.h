#pragma once

#include <cstdint>
#include <string>

#include "kiln/export.h"

namespace KILN_PUBLIC kiln {

/// A map of the caller's own: a function of the high poly's point in OpenCL C 1.2, run once a sample.
///
/// The source defines `float4 kiln_map(const kiln_point* point)`; kernels/detail/own.clh documents the point and
/// the ray caster. It may define further functions, and includes nothing. What it returns is averaged over a
/// texel's samples, number by number. Where nothing was found it is not called: those texels are filled from
/// their neighbours, or marked. Its places are measured from BakedMap::origin. Strings are copied; one OwnMap may serve bakes on several threads.
struct OwnMap {
  std::string name = "own";    ///< Of the map: a letter, then letters, digits and _
  std::string source = {};     ///< OpenCL C
  std::string file = {};       ///< The source's name in the messages of its build
  std::uint32_t channels = 3;  ///< 1, 3 or 4 of the numbers returned are kept
};

}  // namespace kiln
