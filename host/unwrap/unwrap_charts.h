// UV unwrapping that grows charts: see UnwrapMethod::charts in kiln/unwrap.h.
#pragma once

#include <memory>

#include "kiln/unwrap.h"
#include "unwrap/texel_detail.h"

namespace kiln {

/// Cache of one mesh's charts. The charts are reused for another map size unless they depend on the size. If a mesh has
/// a very large number of charts, they do not.
class KnownCharts {
 public:
  KnownCharts();  ///< Creates an empty cache
  ~KnownCharts();
  KnownCharts(const KnownCharts&) = delete;
  KnownCharts& operator=(const KnownCharts&) = delete;

  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

/// Variant of unwrap() with precomputed detail of the high poly: charts get more texels where the detail needs them.
/// \param detail  if null, texels are distributed by area, or by UnwrapOptions::detail_of
/// \param known   [in, out] charts of this mesh from a call with another size or padding; if null, nothing is cached.
///   Never changes the result
Mesh unwrap_for(const Mesh& mesh, const UnwrapOptions& options, const TexelDetail* detail,
                UnwrapReport* report, KnownCharts* known = nullptr);

/// \param options  validated; detail_of is ignored
/// \param report   receives everything except seconds and degenerate triangles; may be null
/// \param threads  number of threads; 0 for thread_count(); never changes the result
/// \param detail   detail of the high poly, by which texels are distributed; if null, by area
/// \param known    see unwrap_for()
Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads = 0, const TexelDetail* detail = nullptr,
                   KnownCharts* known = nullptr);

}  // namespace kiln
