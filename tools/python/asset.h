// Encodes GLB files from a low poly with its maps, and pads maps that the caller provides.
#pragma once

#include "mesh.h"

namespace kiln::python {

void add_asset(nb::module_& module);

}  // namespace kiln::python
