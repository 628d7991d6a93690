// kiln.BakeSession and kiln.ViewSession: incremental bakes and matches on the device.
#pragma once

#include <nanobind/nanobind.h>

namespace kiln::python {

void add_session(nanobind::module_& module);

}  // namespace kiln::python
