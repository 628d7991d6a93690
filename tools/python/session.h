// kiln.BakeSession and kiln.ViewSession: bakes and matches that stay on the device.
#pragma once

#include <nanobind/nanobind.h>

namespace kiln::python {

void add_session(nanobind::module_& module);

}  // namespace kiln::python
