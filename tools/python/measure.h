// kiln.measure(): the error of rendered normals.
#pragma once

#include <nanobind/nanobind.h>

namespace kiln::python {

void add_measure(nanobind::module_& module);

}  // namespace kiln::python
