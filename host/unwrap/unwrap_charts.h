// Texture coordinates by grown charts: see UnwrapMethod::charts in kiln/unwrap.h.
#pragma once

#include <memory>

#include "kiln/unwrap.h"
#include "unwrap/texel_detail.h"

namespace kiln {

/// Charts of one mesh, kept for another size. Where there are very many, the size did not matter to them: growing
/// them again would give the same ones.
class KnownCharts {
 public:
  KnownCharts();  ///< None are known.
  ~KnownCharts();
  KnownCharts(const KnownCharts&) = delete;
  KnownCharts& operator=(const KnownCharts&) = delete;

  struct State;
  State& state() { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

/// unwrap(), for a high poly whose detail is known: charts get texels by it.
/// \param detail  null: texels by area, or by UnwrapOptions::detail_of
/// \param known   of this mesh, for another size or border; out: for the next one. Null: nothing is kept. Never
///                changes the result
Mesh unwrap_for(const Mesh& mesh, const UnwrapOptions& options, const TexelDetail* detail,
                UnwrapReport* report, KnownCharts* known = nullptr);

/// \param options  checked; detail_of is not read
/// \param report   all but seconds and degenerate triangles is filled in; may be null
/// \param threads  0: thread_count(); never changes the result
/// \param detail   of the high poly, for texels by it; null: by area
/// \param known    see unwrap_for()
Mesh unwrap_charts(const Mesh& mesh, const UnwrapOptions& options, UnwrapReport* report,
                   int threads = 0, const TexelDetail* detail = nullptr,
                   KnownCharts* known = nullptr);

}  // namespace kiln
