// Texture coordinates by grown charts: see UnwrapMethod::charts in kiln/lowpoly.h.
#pragma once

#include "kiln/lowpoly.h"

namespace kiln {

/// \param options  checked
/// \param report   all but seconds and degenerate triangles is filled in; may be null
/// \param threads  0: thread_count(); never changes the result
Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads = 0);

}  // namespace kiln
