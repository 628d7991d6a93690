// kiln.run(): runs a whole job.
#pragma once

#include "call.h"

namespace kiln::python {

void add_job(nb::module_& module);

}  // namespace kiln::python
