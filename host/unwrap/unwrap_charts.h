// UV unwrapping by grown charts: see UnwrapMethod::charts in kiln/unwrap.h.
#pragma once

#include <memory>

#include "kiln/unwrap.h"
#include "unwrap/texel_detail.h"

namespace kiln {

/// Cache of one mesh's charts, to be reused for another map size if the charts do not depend on the size, as for very
/// many charts.
class KnownCharts {
 public:
  KnownCharts();  ///< An empty cache.
  ~KnownCharts();
  KnownCharts(const KnownCharts&) = delete;
  KnownCharts& operator=(const KnownCharts&) = delete;

  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

/// unwrap() for a high poly whose detail is precomputed: charts get texels by it.
/// \param detail  null: texels by area, or by UnwrapOptions::detail_of
/// \param known   charts of this mesh from a call with another size or padding; updated. Null: nothing is cached. Never
///     changes the result
Mesh unwrap_for(const Mesh& mesh, const UnwrapOptions& options, const TexelDetail* detail,
                UnwrapReport* report, KnownCharts* known = nullptr);

/// \param options  validated; detail_of is ignored
/// \param report   all but seconds and degenerate triangles is filled in; may be null
/// \param threads  0: thread_count(); never changes the result
/// \param detail   of the high poly, to distribute texels by detail; null: by area
/// \param known    see unwrap_for()
Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads = 0, const TexelDetail* detail = nullptr,
                   KnownCharts* known = nullptr);

}  // namespace kiln
