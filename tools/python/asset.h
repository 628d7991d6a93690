// Low polys with their maps as one GLB, and maps of the caller's own values.
#pragma once

#include "mesh.h"

namespace kiln::python {

void add_asset(nb::module_& module);

}  // namespace kiln::python
