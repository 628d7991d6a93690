// kiln.measure() and kiln.render(): comparisons of rendered pictures.
#pragma once

#include <nanobind/nanobind.h>

namespace kiln::python {

void add_measure(nanobind::module_& module);

}  // namespace kiln::python
