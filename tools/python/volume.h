// kiln.contour() and kiln.volume(): meshes from voxels.
#pragma once

#include <nanobind/nanobind.h>

namespace kiln::python {

void add_volume(nanobind::module_& module);

}  // namespace kiln::python
