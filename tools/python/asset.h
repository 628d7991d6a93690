// GLB files of a low poly with its maps, and maps from the caller's values.
#pragma once

#include "mesh.h"

namespace kiln::python {

void add_asset(nb::module_& module);

}  // namespace kiln::python
