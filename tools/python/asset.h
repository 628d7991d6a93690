// Low polys with their maps as one GLB, and maps of the caller's own values.
#pragma once

#include "mesh.h"
#include "options/words.h"

namespace kiln::python {

inline constexpr Word<AlphaMode> kAlphaModes[] = {
    {"blend", AlphaMode::blend}, {"mask", AlphaMode::mask}, {"opaque", AlphaMode::opaque}};

void add_asset(nb::module_& module);

}  // namespace kiln::python
