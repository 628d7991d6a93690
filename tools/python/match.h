// kiln.Match: which point of the high poly each texel stands for.
#pragma once

#include <memory>

#include "source.h"

namespace kiln::python {

/// Arrays that Python sees lie in it.
struct PyMatch {
  std::shared_ptr<const Match> match;
  PyMesh high;
  nb::object report;
};

void add_match(nb::module_& module);

}  // namespace kiln::python
