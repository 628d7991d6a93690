// Texture coordinates by grown charts: see UnwrapMethod::charts in kiln/lowpoly.h.
#pragma once

#include "kiln/lowpoly.h"
#include "lowpoly/texel_detail.h"

namespace kiln {

/// unwrap(), for a high poly whose detail is known: charts get texels by it.
/// \param detail  null: texels by area, or by UnwrapOptions::detail_of
Mesh unwrap_for(const Mesh& mesh, const UnwrapOptions& options, const TexelDetail* detail,
                UnwrapReport* report);

/// \param options  checked; detail_of is not read
/// \param report   all but seconds and degenerate triangles is filled in; may be null
/// \param threads  0: thread_count(); never changes the result
/// \param detail   of the high poly, for texels by it; null: by area
Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads = 0, const TexelDetail* detail = nullptr);

}  // namespace kiln
