// kiln.Match: the point of the high poly for each texel sample.
#pragma once

#include <memory>

#include "kiln/match.h"
#include "source.h"

namespace kiln::python {

/// A match. Arrays in Python refer to its memory.
struct PyMatch {
  std::shared_ptr<const Match> match;
  PyMesh high;
  nb::object report;
};

void add_match(nb::module_& module);

}  // namespace kiln::python
