// kiln.simplify() and kiln.unwrap(): low polys and their UVs.
#pragma once

#include "mesh.h"

namespace kiln::python {

void add_surface(nb::module_& module);

}  // namespace kiln::python
